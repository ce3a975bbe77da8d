"""What a solver hands to `design`, which judges it."""

from __future__ import annotations

from dataclasses import dataclass

from echobeam.beamforming.answer import Outcome
from echobeam.beamforming.certify.certificate import Violation
from echobeam.beamforming.certify.proof import Proof
from echobeam.values import ComplexArray


@dataclass(frozen=True, slots=True, eq=False)
class Proposal:
    """Beams and what their solver says of them; rates and violation are not its to say.

    Attributes
    ----------
    beams
        ``(K, N)``, sqrt(power).
    proof
        Of a bound on the sum rate of every feasible design.
    outcome, message
        As in `BeamAnswer`.
    iterations
        What it took.
    examined
        Their violation, if `certificate.violation` has been asked already.
    """

    beams: ComplexArray
    proof: Proof
    outcome: Outcome
    message: str
    iterations: int
    examined: Violation | None = None
