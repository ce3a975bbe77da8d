"""Visits: each vehicle's samples, cut where no vehicle can have gone from one to the next.

A simulator takes a jammed vehicle off the road and puts it elsewhere (a teleport), a log marks a
missing position by an absurd one (a sentinel), and an id may come again as that of another
vehicle. In each case the step between two samples is no motion. Two rules find such a step, and
neither looks at the speeds that the file gives, which may be wrong themselves:

- it is faster than any road vehicle, or
- its velocity differs from those of the steps before and after it by more than a vehicle can
  brake, or accelerate and brake again. Where it is the first or the last step of a visit, the one
  neighbour that it has must agree with that neighbour's own.

SUMO's mark for an unknown position is dropped, and the vehicle is gone for that moment.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import takewhile
from typing import NamedTuple

from echobeam.traces.sample import NO_VALUE, Sample

FASTEST = 100.0
"""m/s (360 km/h): no road vehicle is faster."""

HARDEST = 10.0
"""m/s^2: no road vehicle brakes harder."""

_TO_AND_FRO = 5.0
"""m/s^2: no road vehicle accelerates harder, and so none makes a step that is faster or slower by
more than this than the steps on both sides."""

SLACK = 5.0
"""m by which positions may jump by themselves: a change of lane in one step."""

_ROUGHNESS = 4.0
"""Multiples of the mean roughness of a vehicle's way, by which positions may jump besides: those
of a noisy receiver."""

_SHORTEST = 0.01
"""s added to a step before its speed is judged: time stamps may be rounded to two digits."""


class Visit(NamedTuple):
    """Sample with the number of the visit that it belongs to, counted for each vehicle."""

    sample: Sample
    number: int


class Step(NamedTuple):
    """Step between two successive samples of a vehicle: velocity, m/s, and duration, s."""

    vx: float
    vy: float
    duration: float
    impossible: bool

    def away(self, other: Step) -> float:
        """Return how far from here the velocity of a neighbour would have led, m."""
        return math.hypot(self.vx - other.vx, self.vy - other.vy) * self.duration

    def differs(self, other: Step, slack: float, acceleration: float) -> bool:
        """Whether more than an acceleration, and some slack, lies between it and a neighbour."""
        between = (self.duration + other.duration) / 2
        return self.away(other) > slack + acceleration * between * self.duration

    def sticks_out(self, one: Step, other: Step) -> bool:
        """Whether both neighbours differ from this step to the same side."""
        dx, dy = self.vx - one.vx, self.vy - one.vy
        return dx * (self.vx - other.vx) + dy * (self.vy - other.vy) > 0


def _step(one: Sample, other: Sample) -> Step:
    duration = other.time - one.time
    dx, dy = other.x - one.x, other.y - one.y
    impossible = math.hypot(dx, dy) > FASTEST * (duration + _SHORTEST) + SLACK
    return Step(dx / duration, dy / duration, duration, impossible)


class Jump(NamedTuple):
    """Step that no vehicle can have made."""

    before: Sample
    after: Sample

    @property
    def distance(self) -> float:
        """How far, m."""
        return math.hypot(self.after.x - self.before.x, self.after.y - self.before.y)

    @property
    def speed(self) -> float:
        """How fast, m/s."""
        return self.distance / (self.after.time - self.before.time)


@dataclass(slots=True)
class Breaks:
    """Findings about the steps of one vehicle.

    Attributes
    ----------
    steps, jumps
        Numbers of steps between its samples, and of those that are none of a vehicle.
    first_jump
        The first of the latter.
    unplaced
        Samples without a position: how many, and the first.
    """

    steps: int = 0
    jumps: int = 0
    first_jump: Jump | None = None
    unplaced: int = 0
    first_unplaced: Sample | None = None


@dataclass(slots=True)
class _Follower:
    """One vehicle's samples, until later ones show whether a step was a jump.

    The first of ``samples`` is decided and passed on already; ``steps[i]`` leads from sample i to
    the next one. ``before`` is the step that led to the first sample, if it was motion, and
    ``steady`` whether that one agreed with its own predecessor. ``known`` is the last step that
    was motion, also in an earlier visit.
    """

    found: Breaks
    visit: int = 0
    samples: list[Sample] = field(default_factory=list)
    steps: list[Step] = field(default_factory=list)
    before: Step | None = None
    steady: bool = False
    known: Step | None = None
    roughness: float = 0.0
    turns: int = 0

    def take(self, sample: Sample) -> Iterator[Visit]:
        if NO_VALUE in (sample.x, sample.y):
            yield from self.finish()
            self._lose(sample)
        elif not self.samples:
            self.samples.append(sample)
            yield Visit(sample, self.visit)
        else:
            self.steps.append(_step(self.samples[-1], sample))
            self.samples.append(sample)
            if len(self.steps) > 1:
                self.turns += 1
                self.roughness += min(self.steps[-2].away(self.steps[-1]), SLACK)
            if len(self.steps) == 3:
                yield self._decide()

    def finish(self) -> Iterator[Visit]:
        """Pass the waiting samples on."""
        while self.steps:
            yield self._decide()

    def _lose(self, sample: Sample) -> None:
        self.found.unplaced += 1
        self.found.first_unplaced = self.found.first_unplaced or sample
        if self.samples:
            self.visit += 1
        self.samples, self.before, self.steady = [], None, False

    def _decide(self) -> Visit:
        step = self.steps.pop(0)
        before = self.samples.pop(0)
        self.found.steps += 1
        agrees = self.before is not None and not self._differ(step, self.before, _TO_AND_FRO)
        if step.impossible or (not agrees and self._is_odd(step)):
            self.found.jumps += 1
            self.found.first_jump = self.found.first_jump or Jump(before, self.samples[0])
            self.visit += 1
            self.before, self.steady = None, False
        else:
            self.before, self.known, self.steady = step, step, agrees
        return Visit(self.samples[0], self.visit)

    def _is_odd(self, step: Step) -> bool:
        """Whether a step that does not agree with the one before it is none of a vehicle."""
        after = list(takewhile(lambda other: not other.impossible, self.steps))
        if self.before is None:
            if len(after) > 1:
                return self._differ(step, after[0]) and not self._differ(after[0], after[1])
            return self.known is not None and self._differ(step, self.known)
        if not after:
            return self.steady and self._differ(step, self.before)
        limit = _TO_AND_FRO if step.sticks_out(self.before, after[0]) else HARDEST
        return self._differ(step, self.before, limit) and self._differ(step, after[0], limit)

    def _differ(self, step: Step, other: Step, acceleration: float = HARDEST) -> bool:
        rough = self.roughness / self.turns if self.turns else 0.0
        return step.differs(other, SLACK + _ROUGHNESS * rough, acceleration)


def unbroken(samples: Iterable[Sample], found: dict[str, Breaks]) -> Iterator[Visit]:
    """Yield a trace's samples with the visits that they belong to.

    Parameters
    ----------
    samples
        A trace's samples, each vehicle's in order of time.
    found
        Filled with the findings about each vehicle, by name.

    Yields
    ------
    Visit
        Each vehicle's samples in order of time; those without a position are left out.
    """
    followers: dict[str, _Follower] = {}
    for sample in samples:
        follower = followers.get(sample.name)
        if follower is None:
            found[sample.name] = Breaks()
            follower = followers[sample.name] = _Follower(found[sample.name])
        yield from follower.take(sample)
    for follower in followers.values():
        yield from follower.finish()


def whole(samples: Iterable[Sample]) -> Iterator[Visit]:
    """Yield the samples of a trace in which there is nothing to break at."""
    for sample in samples:
        yield Visit(sample, 0)
