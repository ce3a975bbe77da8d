"""Figures and claims as records, read alike by the command, the tests and the documentation.

A figure lists points (scenarios run for some trials) and converts their results to a record of all
numbers shown, the source of picture, table and JSON. A claim belongs to a figure; it measures a
quantity in the same results, and its rule derives the verdict from the measured estimates.
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
    """Number with its 95 % interval; both ends equal the value if it is deterministic.

    Attributes
    ----------
    value, low, high
        Infinite if outside the evaluated range; NaN if undefined.
    looked
        Ends of the evaluated range, if the number is a position in it.
    """

    value: float
    low: float
    high: float
    looked: tuple[float, float] | None = None

    @classmethod
    def exact(cls, value: float) -> Estimate:
        """Return a deterministic number."""
        return cls(float(value), float(value), float(value))

    @property
    def random(self) -> bool:
        """Whether the interval has a non-zero width."""
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
    """Estimates measured for a claim.

    Attributes
    ----------
    estimates
        Estimates by name; the first is reported, the rule uses all.
    unit
        Unit of the first as printed: ``"%"``, ``"deg"``, ``""``.
    """

    estimates: Mapping[str, Estimate]
    unit: str = ""

    @property
    def headline(self) -> Estimate:
        """Estimate that is reported as ours."""
        return next(iter(self.estimates.values()))


@dataclass(frozen=True, slots=True)
class Rule:
    """Rule that derives a verdict from the measured estimates.

    Attributes
    ----------
    text
        Text of the rule, printed beside every verdict.
    decide
        Function from estimates to verdict.
    """

    text: str
    decide: Callable[[Measured], Verdict]


@dataclass(frozen=True, slots=True)
class Figure:
    """Figure of the paper.

    Attributes
    ----------
    id
        Label in the paper.
    caption
        Content of the figure, in a line.
    points
        Setups to run; figures with the same setup share its trials.
    data
        Function from the results of these points to all numbers of the figure.
    place
        Position among the figures, in ascending order.
    """

    id: str
    caption: str
    points: tuple[Setup, ...]
    data: Callable[[Results], FigureData]
    place: float


@dataclass(frozen=True, slots=True)
class Claim:
    """Claim of the paper that can be compared with numbers.

    Attributes
    ----------
    id, figure
        Name, and id of the figure whose points are measured.
    text
        Claim in the paper's words, quoted or shortened.
    paper
        Value in the paper: a number in the measure's unit, or words if it gives none.
    reading
        Interpretation of the claim, and the calibrated values.
    measure
        Function from results to estimates.
    judge
        Rule from estimates to the verdict.
    remark
        Qualification of the verdict, printed beside it.
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
    """Claim with its measured estimates and the verdict of its rule."""

    claim: Claim
    measured: Measured
    verdict: Verdict = field(init=False)

    def __post_init__(self) -> None:
        """Set the verdict by the rule."""
        object.__setattr__(self, "verdict", self.claim.judge.decide(self.measured))


@dataclass(frozen=True, slots=True)
class Entry:
    """Row of the sensitivity map: a claim measured and judged under one reading.

    Attributes
    ----------
    finding
        Claim with the estimates under this reading, and its rule's verdict.
    reading
        Label of the default reading, or of the change from it.
    trials
        Smallest number of trials of a point.
    fallbacks
        Largest share of directional slots with fallback beams, over the points and schemes that the
        claim uses.
    """

    finding: Finding
    reading: str
    trials: int
    fallbacks: float = 0.0

    @property
    def fallback(self) -> bool:
        """Whether most beams were a fallback, so that the row does not evaluate the design."""
        return self.fallbacks > 0.5

    @property
    def judgement(self) -> Judgement:
        """Verdict, or "not judged" if most beams were a fallback or there is no number."""
        numbers = self.finding.measured.estimates.values()
        if self.fallback or any(math.isnan(one.value) for one in numbers):
            return "not judged"
        return self.finding.verdict
