"""Visits: each vehicle's samples, split where a step is impossible for a vehicle.

A simulator moves a jammed vehicle elsewhere (a teleport), a log marks a missing position by an
impossible one (a sentinel), and an id may be reused for another vehicle. In each case the step
between two samples is not motion. Two rules detect such a step; neither uses the speeds in the
file, which may be wrong themselves:

- it is faster than any road vehicle, or
- its velocity differs from those of the steps before and after it by more than a vehicle can
  brake, or accelerate and brake again. The first and the last step of a visit have one neighbouring
  step, which must then agree with its own neighbour.

A sample with SUMO's mark for an unknown position is dropped; the vehicle is absent at that time.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import takewhile
from typing import NamedTuple

from echobeam.traces.sample import NO_VALUE, Sample

FASTEST = 100.0
"""Largest speed of a road vehicle, m/s (360 km/h)."""

HARDEST = 10.0
"""Largest deceleration of a road vehicle, m/s^2."""

_TO_AND_FRO = 5.0
"""Largest acceleration of a road vehicle, m/s^2: it limits the excess speed of a step over the
steps on both sides."""

SLACK = 5.0
"""Tolerated jump of a position, m: a change of lane in one step."""

_ROUGHNESS = 4.0
"""Further tolerated jump of a position, in multiples of the mean roughness of a vehicle's path, for
noisy receivers."""

_SHORTEST = 0.01
"""Addition to the duration of a step for its speed check, s: time stamps may have two digits."""


class Visit(NamedTuple):
    """Sample with the number of its visit, counted for each vehicle."""

    sample: Sample
    number: int


class Step(NamedTuple):
    """Step between two successive samples of a vehicle: velocity, m/s, and duration, s."""

    vx: float
    vy: float
    duration: float
    impossible: bool

    def away(self, other: Step) -> float:
        """Return the displacement difference to a step at the velocity of a neighbour, m."""
        return math.hypot(self.vx - other.vx, self.vy - other.vy) * self.duration

    def differs(self, other: Step, slack: float, acceleration: float) -> bool:
        """Return whether a neighbour differs by more than an acceleration and some slack."""
        between = (self.duration + other.duration) / 2
        return self.away(other) > slack + acceleration * between * self.duration

    def sticks_out(self, one: Step, other: Step) -> bool:
        """Return whether this step differs from both neighbours in the same direction."""
        dx, dy = self.vx - one.vx, self.vy - one.vy
        return dx * (self.vx - other.vx) + dy * (self.vy - other.vy) > 0


def _step(one: Sample, other: Sample) -> Step:
    duration = other.time - one.time
    dx, dy = other.x - one.x, other.y - one.y
    impossible = math.hypot(dx, dy) > FASTEST * (duration + _SHORTEST) + SLACK
    return Step(dx / duration, dy / duration, duration, impossible)


class Jump(NamedTuple):
    """Step that is impossible for a vehicle."""

    before: Sample
    after: Sample

    @property
    def distance(self) -> float:
        """Length of the jump, m."""
        return math.hypot(self.after.x - self.before.x, self.after.y - self.before.y)

    @property
    def speed(self) -> float:
        """Speed of the jump, m/s."""
        return self.distance / (self.after.time - self.before.time)


@dataclass(slots=True)
class Breaks:
    """Findings about the steps of one vehicle.

    Attributes
    ----------
    steps, jumps
        Numbers of steps between its samples, and of those that are jumps.
    first_jump
        First jump.
    unplaced
        Number of samples without a position, and the first of them.
    """

    steps: int = 0
    jumps: int = 0
    first_jump: Jump | None = None
    unplaced: int = 0
    first_unplaced: Sample | None = None


@dataclass(slots=True)
class _Follower:
    """Buffer of one vehicle's samples, until later ones decide whether a step was a jump.

    The first of ``samples`` is decided and already yielded; ``steps[i]`` leads from sample i to the
    next one. ``before`` is the step to the first sample, if it was motion, and ``steady`` whether
    it agreed with its own predecessor. ``known`` is the last step that was motion, also of an
    earlier visit.
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
        """Yield the samples in the buffer."""
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
        """Return whether a step that disagrees with the one before it is a jump."""
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
    """Yield a trace's samples with their visits.

    Parameters
    ----------
    samples
        A trace's samples, each vehicle's in order of time.
    found
        Filled with the findings of each vehicle, by name.

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
    """Yield the samples of a trace without jumps, each vehicle in one visit."""
    for sample in samples:
        yield Visit(sample, 0)
