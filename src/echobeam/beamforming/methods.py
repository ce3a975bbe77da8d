"""Methods of beam design, by name: the one table that the door, the shell and benchmarks read."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module
from typing import Any


@dataclass(frozen=True, slots=True)
class Method:
    """Home of a function ``solve(problem) -> Proposal``, imported when first used.

    Its module may have a function ``load()`` for what must not count as time of a design.

    Attributes
    ----------
    module, function
        Its place.
    about
        What it does, in words.
    """

    module: str
    function: str
    about: str

    def solver(self) -> Any:
        """Return the function, with all that it needs loaded or compiled."""
        module = import_module(self.module)
        getattr(module, "load", lambda: None)()
        return getattr(module, self.function)


METHODS = {
    "fast": Method(
        "echobeam.beamforming.fast", "solve", "the direct solver, compiled; then the relaxation"
    ),
    "sdp": Method("echobeam.beamforming.relaxation.solver", "solve", "the reduced relaxation"),
    "reference": Method(
        "echobeam.beamforming.reference", "solve", "the paper's SDR + SCA + IRM through CVXPY"
    ),
}
"""Every method by its name; the first one is the default."""

DEFAULT = next(iter(METHODS))
