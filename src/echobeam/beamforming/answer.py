"""What a beam design answers: beams, what they achieve, and what no design can beat."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from echobeam.beamforming.certify.certificate import Violation
from echobeam.beamforming.certify.proof import Proof
from echobeam.brief import Brief, brief, html_table
from echobeam.values import Array, ComplexArray

Status = Literal["optimal", "infeasible", "fallback"]

Outcome = Literal["converged", "unproved", "floors lowered", "flat", "violated"]
"""Outcomes of a design, see `BeamAnswer.outcome`."""

STATUS: dict[Outcome, Status] = {
    "converged": "optimal",
    "unproved": "optimal",
    "floors lowered": "fallback",
    "flat": "fallback",
    "violated": "fallback",
}
"""Status of each outcome: a fallback misses a constraint, or is flat for want of other beams."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BeamAnswer(Brief):
    """The answer to one `BeamProblem`.

    Attributes
    ----------
    beams
        ``(K, n_tx)`` complex, sqrt(power).
    objective
        Sum rate at the predicted channel, bit/s/Hz, Eq. (38a).
    proof
        Of `upper_bound`, which is computed when first asked for.
    outcome
        ``"converged"``: all constraints are kept, and the solver proved a (local) optimum.
        ``"unproved"``: all constraints are kept, but the search ended early. ``"floors lowered"``:
        the floors (38e) cannot all be met; the beams serve all objects fairly and the message names
        the fault. ``"flat"``: the cover leaves no better beams than flat ones. ``"violated"``: no
        beams were found that keep all constraints.
    message
        What happened, in words.
    rates
        ``(K,)`` bit/s/Hz at the predicted channel.
    max_violation
        Relative violation of power, rate floors and coverage on the full grid.
    seconds, iterations
        What the decision took; a bound that is proved later is not counted.
    """

    beams: ComplexArray
    objective: float
    proof: Proof
    outcome: Outcome
    message: str
    rates: Array
    max_violation: Violation
    seconds: float
    iterations: int

    @property
    def status(self) -> Status:
        """``"optimal"`` where all constraints are kept, ``"fallback"`` where not, or flat."""
        return STATUS[self.outcome]

    @property
    def upper_bound(self) -> float:
        """No feasible design has a larger objective; infinite where nothing was proved.

        Rounding may put the last digit of an exact optimum above its bound, so that the objective
        counts where it is the larger one.
        """
        return max(self.proof.bound, self.objective)

    @property
    def gap(self) -> float:
        """Relative certified gap: (upper_bound - objective) / objective."""
        difference = self.upper_bound - self.objective
        if difference <= 0.0:
            return 0.0
        return difference / self.objective if self.objective > 0.0 else np.inf

    def __repr__(self) -> str:
        """Return what was reached; the bound if it is known: showing is not asking for a proof."""
        return brief(self, self._figures())

    def _repr_html_(self) -> str:
        """Return the same as a table, for notebooks."""
        return html_table(f"Beams of {len(self.beams)} objects", self._figures())

    def _figures(self) -> dict[str, object]:
        message = {"message": self.message} if self.message else {}
        return {
            "status": self.status,
            "objective": self.objective,
            "upper_bound": self.upper_bound if self.proof.known else self.proof,
            "rates": self.rates,
            "max_violation": self.max_violation.largest,
            "seconds": self.seconds,
            "iterations": self.iterations,
            **message,
            "beams": self.beams,
        }


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BatchAnswer(Brief):
    """The answers to a `ProblemBatch`.

    Attributes
    ----------
    beams
        ``(T, K, n_tx)`` complex; zero for inactive objects.
    objective
        ``(T,)`` bit/s/Hz.
    fallback
        ``(T,)`` bool: the beams are a stated fallback, see `BeamAnswer.status`.
    messages
        One text per trial that fell back, by trial.
    """

    beams: ComplexArray
    objective: Array
    fallback: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
    messages: dict[int, str] = field(default_factory=dict)
