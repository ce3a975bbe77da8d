"""Comparison of the given speeds with the positions.

Three questions are answered for a trace:

- *To which time does a speed belong?* SUMO's default (Euler) steps give at t the mean over the
  step before it, other simulators the mean over the step after it. If a vehicle's speed changes,
  the positions decide: the distance driven is a weighted mean of the sums over the speeds at the
  ends and at the beginnings of the steps, and the speeds belong to the samples' times if both
  weights are one half. Otherwise motion is taken from positions alone.
- *In which unit is it?* The sum of speed times duration must be the distance driven.
- *Is it a speed at all?* Zero or a negative number in every row of a moving vehicle is a mark for
  an unknown speed, unless its magnitude is right: logs of two directions have signed speeds.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum, auto

from echobeam.traces.breaks import SLACK
from echobeam.traces.sample import Sample

_ENOUGH = 0.2
"""Smallest significant difference of the two sums, m: above the rounding of two digits."""

_LONGEST_SUM = 5.0
"""Longest duration of a sum, s: rounding errors accumulate."""

_OFF_CENTRE = 0.08
"""Largest offset of speeds from their samples' times, as a share of a step."""

_EXACT = 0.01
_GROSS, _WRONG_UNIT = 0.05, 0.25
"""Relative differences between speeds and positions: consistent up to the first, refused in most
vehicles above the second, refused in any vehicle above the third."""

_FEW_METRES = 5.0
_ONE_METRE = 1.0
_LITTLE = 0.2
_NO_LANE = 1.0
"""Smallest sideways step of a change of lane, m."""
_SCATTER = 0.05
"""Difference, per duration of a step, m/s^2, of its mean speed and the mean of the speeds at its
ends, for vehicles that start and stop within it."""

_SAME_SIZE = 0.1

_NOTHING = (0.0, 0.0, 0.0, 0.0)


class Verdict(Enum):
    """Consistency of the speeds of one vehicle with its positions."""

    TRUE = auto()
    """Speeds that agree with the positions, or no speeds."""
    MARK = auto()
    """Mark for an unknown speed: the same number in all rows."""
    INEXACT = auto()
    """Speeds that differ from the positions by more than one per cent."""
    GROSS = auto()
    """Speeds that differ by more than 5 per cent."""
    WRONG = auto()
    """Speeds that differ by more than 25 per cent: speeds, times or positions have another unit."""


@dataclass(slots=True)
class Timing:
    """Timing of speeds within the step before their sample, over all vehicles.

    Least squares of the share f in: distance driven = f (sum with the speeds at the ends of steps)
    + (1 - f) (sum with those at their beginnings). One half if undetermined.

    ``rounding`` is the largest error of times, s.
    """

    cross: float = 0.0
    square: float = 0.0
    rounding: float = 0.0

    @property
    def share(self) -> float:
        """Share from 0 (mean over the step after) to 1 (mean over the step before)."""
        return self.cross / self.square if self.square > 0 else 0.5

    @property
    def at_samples(self) -> bool:
        """Whether the speeds belong to the samples' times."""
        return abs(self.share - 0.5) <= _OFF_CENTRE

    def take(self, way: float, by_end: float, by_begin: float) -> None:
        """Add some steps of a vehicle, m."""
        difference = by_end - by_begin
        share = (way - by_begin) / difference
        if -0.5 <= share <= 1.5:  # otherwise the unit differs, or there is no motion
            self.cross += share * difference**2
            self.square += difference**2


@dataclass(slots=True)
class SpeedTally:
    """Sums over one vehicle's speeds.

    Attributes
    ----------
    timing
        Timing of the whole trace.
    low, high
        Smallest and largest speed, m/s.
    steps, time
        Number and duration, s, of the steps within visits.
    path, net
        Path driven in all of them, and sum of the net displacements of visits, m.
    fastest
        Speed of the fastest step, m/s.
    aside
        Excess length of the path due to changes of lane in a single step, m.
    counted, moved, by_end, by_begin
        Number of the steps with non-zero speeds at both ends; distance driven in them, m, and the
        same distance from the speeds at their ends and at their beginnings.
    """

    timing: Timing
    low: float = math.inf
    high: float = -math.inf
    steps: int = 0
    time: float = 0.0
    path: float = 0.0
    net: float = 0.0
    fastest: float = 0.0
    aside: float = 0.0
    counted: int = 0
    moved: float = 0.0
    by_end: float = 0.0
    by_begin: float = 0.0
    _begin: Sample | None = None
    _last: Sample | None = None
    _sums: tuple[float, float, float, float] = _NOTHING
    _direction: tuple[float, float] = (0.0, 0.0)

    def begin(self, sample: Sample) -> None:
        """Begin a visit with its first sample."""
        self.end()
        self._note(sample)
        self._begin, self._sums = sample, _NOTHING

    def take(self, sample: Sample, duration: float) -> None:
        """Add the next sample of a visit, ``duration`` seconds after the one before."""
        last = self._last
        assert last is not None
        self._note(sample)
        dx, dy = sample.x - last.x, sample.y - last.y
        way = math.hypot(dx, dy)
        self.aside += self._aside(dx, dy, way)
        self.steps += 1
        self.time += duration
        self.path += way
        self.fastest = max(self.fastest, way / duration)
        by_end, by_begin = abs(sample.speed) * duration, abs(last.speed) * duration
        if sample.speed * last.speed > 0:
            self.counted += 1
            self.moved += way
            self.by_end += by_end
            self.by_begin += by_begin
        self._weigh(way, by_end, by_begin, duration)

    def _aside(self, dx: float, dy: float, way: float) -> float:
        """Return the excess length of a step due to a change of lane, m."""
        ux, uy = self._direction
        if _NO_LANE < abs(dx * uy - dy * ux) <= SLACK:
            return way - abs(dx * ux + dy * uy)
        if way > _LITTLE:
            self._direction = dx / way, dy / way
        return 0.0

    def end(self) -> None:
        """End a visit."""
        if self._begin is not None and self._last is not None:
            dx, dy = self._last.x - self._begin.x, self._last.y - self._begin.y
            self.net += math.hypot(dx, dy)
        self._begin = None

    @property
    def constant(self) -> bool:
        """Whether all rows have the same speed."""
        return self.low == self.high

    @property
    def known(self) -> bool:
        """Whether any row has a speed."""
        return self.low <= self.high

    def ratio(self) -> float:
        """Return the ratio of the given speeds to those of the positions."""
        return self._way() / self.moved if self.moved > 0 else math.inf

    def verdict(self) -> Verdict:
        """Return the verdict, after all vehicles have been added."""
        if not self.known:
            return Verdict.TRUE
        if self.constant and self.high <= 0:
            way = -self.low * self.time
            excess = max(way - self.path, self.net - way)
            if excess > _SAME_SIZE * max(way, self.path) + _ONE_METRE:
                return Verdict.MARK
        return self._agreement()

    def _agreement(self) -> Verdict:
        if self.counted == 0:
            return Verdict.TRUE
        way = self._way()
        # Noise of the positions lengthens the path, but not the net displacement.
        excess = max(way - self.moved, min(self.net, self.moved) - self.aside - way)
        step = min(self.time / self.steps, _LONGEST_SUM)
        scatter = _SCATTER * step**2 * math.sqrt(self.counted)
        scatter += 2 * self.timing.rounding * self.path / self.time
        size = max(way, self.moved)
        if excess > _WRONG_UNIT * size + _FEW_METRES + 4 * scatter:
            return Verdict.WRONG
        if excess > _GROSS * size + _FEW_METRES + 4 * scatter:
            return Verdict.GROSS
        return Verdict.INEXACT if excess > _EXACT * size + _LITTLE + scatter else Verdict.TRUE

    def _way(self) -> float:
        share = self.timing.share
        return share * self.by_end + (1 - share) * self.by_begin

    def _note(self, sample: Sample) -> None:
        self._last = sample
        if sample.speed < self.low:
            self.low = sample.speed
        if sample.speed > self.high:
            self.high = sample.speed

    def _weigh(self, way: float, by_end: float, by_begin: float, duration: float) -> None:
        """Add steps to the timing, if they are significant."""
        ways, ends, begins, time = self._sums
        ways, ends, begins, time = ways + way, ends + by_end, begins + by_begin, time + duration
        if abs(ends - begins) > _ENOUGH:
            self.timing.take(ways, ends, begins)
            self._sums = _NOTHING
        elif time > _LONGEST_SUM or math.isnan(ends + begins):
            self._sums = _NOTHING
        else:
            self._sums = (ways, ends, begins, time)
