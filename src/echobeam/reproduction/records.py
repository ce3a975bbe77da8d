"""What a figure and a claim are: records, so that command, tests and documentation read the same.

A figure asks for points (scenarios run for some trials) and turns their results into a record of
all numbers in it, from which picture, table and JSON come. A claim belongs to a figure; it
measures something in the same results, and a rule that the record holds turns what was measured
into a verdict.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from echobeam.plots.record import FigureData
from echobeam.reproduction.results import Results
from echobeam.reproduction.setups import Setup

Verdict = Literal["reproduced", "in part", "not reproduced"]
Judgement = Verdict | Literal["not judged"]


@dataclass(frozen=True, slots=True)
class Estimate:
    """A number with its 95 % interval; without one (a deterministic number) both ends are it.

    Attributes
    ----------
    value, low, high
        Infinite where it lies beyond what was looked at; NaN where there is none.
    looked
        Least and greatest that was looked at, if it is a place among them.
    """

    value: float
    low: float
    high: float
    looked: tuple[float, float] | None = None

    @classmethod
    def exact(cls, value: float) -> Estimate:
        """Return a number that no chance went into."""
        return cls(float(value), float(value), float(value))

    @property
    def random(self) -> bool:
        """Whether the interval says anything."""
        return self.low < self.high

    def scaled(self, factor: float, shift: float = 0.0) -> Estimate:
        """Return ``factor x + shift``, factor positive."""
        value, low, high = (factor * x + shift for x in (self.value, self.low, self.high))
        return Estimate(value, low, high)

    def negated(self) -> Estimate:
        """Return the number with the other sign."""
        return Estimate(-self.value, -self.high, -self.low)


@dataclass(frozen=True, slots=True)
class Measured:
    """What a claim's measure found.

    Attributes
    ----------
    estimates
        By name; the first is the one that is reported, the rule sees all.
    unit
        Of the first, as it is printed: ``"%"``, ``"deg"``, ``""``.
    """

    estimates: Mapping[str, Estimate]
    unit: str = ""

    @property
    def headline(self) -> Estimate:
        """The number that is reported as ours."""
        return next(iter(self.estimates.values()))


@dataclass(frozen=True, slots=True)
class Rule:
    """How a verdict follows from what was measured.

    Attributes
    ----------
    text
        The rule in words, printed beside every verdict.
    decide
        The rule itself.
    """

    text: str
    decide: Callable[[Measured], Verdict]


@dataclass(frozen=True, slots=True)
class Figure:
    """One figure of the paper.

    Attributes
    ----------
    id
        The paper's own label.
    caption
        What it shows, in a line.
    points
        What has to be run for it; figures that name the same setup share its trials.
    data
        From the results of at least these points to all numbers in it.
    place
        Its place among the figures, in ascending order.
    """

    id: str
    caption: str
    points: tuple[Setup, ...]
    data: Callable[[Results], FigureData]
    place: float


@dataclass(frozen=True, slots=True)
class Claim:
    """One sentence of the paper that can be held against numbers.

    Attributes
    ----------
    id, figure
        Its name, and the id of the figure whose points it is measured on.
    text
        What the paper says, quoted or shortened.
    paper
        The paper's value: a number in the measure's unit, or words where it gives none.
    reading
        How the sentence was read, and which values were calibrated.
    measure
        From results to numbers.
    judge
        From numbers to the verdict.
    remark
        What a reader has to know of the verdict, printed beside it.
    """

    id: str
    figure: str
    text: str
    paper: float | str
    reading: str
    measure: Callable[[Results], Measured]
    judge: Rule
    remark: str = ""


@dataclass(frozen=True, slots=True)
class Finding:
    """A claim together with what was measured and the verdict that its rule gives."""

    claim: Claim
    measured: Measured
    verdict: Verdict = field(init=False)

    def __post_init__(self) -> None:
        """Let the rule decide; nobody else can."""
        object.__setattr__(self, "verdict", self.claim.judge.decide(self.measured))


@dataclass(frozen=True, slots=True)
class Entry:
    """One row of the sensitivity map: a claim measured and judged again under some reading.

    Attributes
    ----------
    finding
        The claim with what was measured there, and its rule's verdict.
    reading
        The default, or what was changed from it.
    trials
        Of the point that had fewest.
    fallbacks
        Share of directional slots whose beams were a fallback, in the point and scheme that had
        most, of those that the claim is measured on.
    """

    finding: Finding
    reading: str
    trials: int
    fallbacks: float = 0.0

    @property
    def fallback(self) -> bool:
        """Whether most beams were a fallback, so that the row says little of the design."""
        return self.fallbacks > 0.5

    @property
    def judgement(self) -> Judgement:
        """The verdict, unless there is no design to judge or no number."""
        numbers = self.finding.measured.estimates.values()
        if self.fallback or any(math.isnan(one.value) for one in numbers):
            return "not judged"
        return self.finding.verdict
