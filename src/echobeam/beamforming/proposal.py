"""What a solver hands to `design`, which judges it."""

from __future__ import annotations

from dataclasses import dataclass

from echobeam.beamforming.answer import Status
from echobeam.values import ComplexArray


@dataclass(frozen=True, slots=True, eq=False)
class Proposal:
    """Beams and what their solver says of them; rates and violation are not its to say.

    Attributes
    ----------
    beams
        ``(K, N)``, sqrt(power).
    upper_bound
        Proved bound on the sum rate of every feasible design, bit/s/Hz; infinite if none was.
    status, message
        As in `BeamAnswer`.
    iterations
        What it took.
    """

    beams: ComplexArray
    upper_bound: float
    status: Status
    message: str
    iterations: int
