"""An upper bound that is proved when somebody asks for it, and kept.

Deciding on beams must not wait for a proof that nobody reads: a run designs beams by the
thousand, and looks at no bound.
"""

from __future__ import annotations

from collections.abc import Callable


class Proof:
    """A bound on the sum rate of every feasible design, or the way to one.

    Parameters
    ----------
    bound
        bit/s/Hz; or what returns it, called at most once.
    """

    __slots__ = ("_bound",)

    def __init__(self, bound: float | Callable[[], float]) -> None:
        self._bound = bound

    @property
    def bound(self) -> float:
        """The bound, bit/s/Hz; infinite where nothing was proved."""
        if callable(self._bound):
            self._bound = self._bound()
        return self._bound

    @property
    def known(self) -> bool:
        """Whether the bound stands already."""
        return not callable(self._bound)

    def __repr__(self) -> str:
        """Show the bound if it is known; showing is not asking."""
        return f"Proof({'not asked for yet' if callable(self._bound) else self._bound})"
