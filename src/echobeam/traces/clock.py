"""Even sample times behind rounded time stamps.

Steps of 0.025 s, rounded to two digits, read 0.03, 0.05, 0.08: the times jitter by a fifth of a
step, and every speed would too. If the steps of a trace differ by no more than the last digit, and
the times fit a line to within it, the steps were even, and the times are moved to the line. The
slope of the line is common to the trace (least squares over all vehicles); its offset is that of
each vehicle. Times that truly jitter, as those of a receiver, depart from a line and are unchanged.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from echobeam.values import Array, BoolArray

_FINEST = 6
_SAME_STEP = 1.25
"""Largest ratio of two steps that may be the same, whatever the digits of their times."""

_LEAST_DIGITS = 1.5
"""Smallest step in units of the last digit: in shorter ones a lost sample looks like rounding."""

_NOTICED = 0.005
"""Smallest last digit that is corrected, as a share of a step: finer ones do not affect motion."""

_FLOAT_SLACK = 1e-3


class EvenStep(NamedTuple):
    """Even step between samples with rounded times, and their last digit, both in s."""

    duration: float
    digit: float


def last_digit(value: float, digits: int) -> int:
    """Return the number of decimals of a number, from ``digits`` up to six."""
    while digits < _FINEST:
        scaled = value * 10.0**digits
        if abs(scaled - round(scaled)) <= _FLOAT_SLACK:
            break
        digits += 1
    return digits


@dataclass(slots=True)
class Ticks:
    """Sums over one vehicle's times since its last longer gap: step number against time."""

    begin: float = math.nan
    last: float = math.nan
    count: int = 0
    generation: int = 0
    k: float = 0.0
    kk: float = 0.0
    t: float = 0.0
    kt: float = 0.0
    tt: float = 0.0


@dataclass(slots=True)
class ClockFit:
    """Least squares of time against step number, over all vehicles.

    ``shortest`` and ``longest`` are the extremes of the steps that may all be the same; a much
    shorter step restarts the fit, a longer one ends a vehicle's run.
    """

    digits: int = 0
    shortest: float = math.inf
    longest: float = 0.0
    generation: int = 0
    steps: int = 0
    time: float = 0.0
    samples: float = 0.0
    sums: Array = field(default_factory=lambda: np.zeros(3))

    @property
    def period(self) -> float:
        """Mean of the steps that may all be the same, s."""
        return self.time / self.steps if self.steps else math.inf

    def take(self, ticks: Ticks, time: float) -> float:
        """Add a vehicle's next time; return the step to it, without the rounding known so far."""
        self.digits = last_digit(time, self.digits)
        step = time - ticks.last
        ticks.last = time
        if self.shortest > self._longest_like(step):
            self.shortest, self.longest = step, step
            self.steps, self.time, self.samples, self.sums = 0, 0.0, 0.0, np.zeros(3)
            self.generation += 1
        if not step <= self._longest_like(self.shortest):  # also true at the vehicle's first time
            self._close(ticks)
            ticks.begin, ticks.count, ticks.generation = time, 1, self.generation
            ticks.k = ticks.kk = ticks.t = ticks.kt = ticks.tt = 0.0
            return step
        if ticks.generation != self.generation:  # the previous time begins a run of the new steps
            ticks.begin, ticks.count, ticks.generation = time - step, 1, self.generation
            ticks.k = ticks.kk = ticks.t = ticks.kt = ticks.tt = 0.0
        self.shortest, self.longest = min(self.shortest, step), max(self.longest, step)
        self.steps, self.time = self.steps + 1, self.time + step
        k, t = float(ticks.count), time - ticks.begin
        ticks.count += 1
        ticks.k += k
        ticks.kk += k * k
        ticks.t += t
        ticks.kt += k * t
        ticks.tt += t * t
        return self.period if self._jitters() else step

    def _longest_like(self, step: float) -> float:
        """Return the longest step that may be the same as a given one."""
        digit = 10.0**-self.digits
        rounded = step + 1.5 * digit if step > _LEAST_DIGITS * digit else step
        return max(_SAME_STEP * step, rounded)

    def _jitters(self) -> bool:
        """Return whether the steps differ, but by no more than the times' last digit."""
        digit = 10.0**-self.digits
        spread = self.longest - self.shortest
        noticed = _NOTICED * self.shortest < digit < self.shortest / _LEAST_DIGITS
        return noticed and 0.5 * digit < spread < 1.5 * digit

    def _close(self, ticks: Ticks) -> None:
        """Add a finished run to the fit."""
        if ticks.count > 2 and ticks.generation == self.generation:
            n = ticks.count
            self.sums += [
                ticks.kk - ticks.k**2 / n,
                ticks.kt - ticks.k * ticks.t / n,
                ticks.tt - ticks.t**2 / n,
            ]
            self.samples += n

    def even_step(self, ticks: Iterable[Ticks]) -> EvenStep | None:
        """Return the even step behind rounded times; None if the times are not rounded.

        Parameters
        ----------
        ticks
            Times of all vehicles; no times can be added afterwards.
        """
        for one in ticks:
            self._close(one)
        if not self._jitters() or self.sums[0] == 0:
            return None
        digit = 10.0**-self.digits
        kk, kt, tt = self.sums
        step = kt / kk
        variance = (tt - kt * step) / self.samples
        # A rounding error is uniform over a digit, with variance digit^2 / 12.
        return EvenStep(float(step), digit) if variance <= 2 * digit**2 / 12 else None


def evened(time: Array, linked: BoolArray, step: EvenStep) -> Array:
    """Return times moved to even steps, each unbroken run with its own line.

    Among the lines within half a digit of all times of a run, the one nearest to its first time is
    taken.

    Parameters
    ----------
    time
        ``(n,)`` s, in order for each vehicle.
    linked
        ``(n - 1,)``: whether a time and the next belong to one run.
    step
        The even step.
    """
    run = np.append(0, np.cumsum(~linked))
    ticks = np.append(
        0.0, np.cumsum(np.where(linked, np.round(np.diff(time) / step.duration), 0.0))
    )
    first = np.flatnonzero(np.append(True, ~linked))
    number = ticks - ticks[first][run]
    offset = time - number * step.duration
    low, high = np.minimum.reduceat(offset, first), np.maximum.reduceat(offset, first)
    nearest = np.clip(offset[first], high - step.digit / 2, low + step.digit / 2)
    result: Array = nearest[run] + number * step.duration
    return result
