"""Models as arguments of a filter: how a state moves, and how it is measured."""

from __future__ import annotations

from typing import Protocol

from echobeam.values import Array, StateSpace, UavState


class MotionModel(Protocol):
    """Motion of a state from one slot to the next."""

    @property
    def space(self) -> StateSpace:
        """Components of the state."""

    def step(self, state: Array, uav: UavState) -> Array:
        """Return the state ``(..., K, S)`` one slot later without noise, g(e).

        ``uav`` is the UAV in the slot that ends.
        """

    def jacobian(self, state: Array, uav: UavState) -> Array:
        """Return G = dg/de at a state, ``(..., K, S, S)``."""

    def noise(self) -> Array:
        """Return the covariance Q_s of the process noise for each slot, ``(S, S)``."""


class MeasurementModel(Protocol):
    """Measurement of a state."""

    @property
    def names(self) -> tuple[str, ...]:
        """Components of the measurement."""

    def expected(self, state: Array, uav: UavState) -> Array:
        """Return the measurement ``(..., K, M)`` of a state without noise, h(e)."""

    def jacobian(self, state: Array, uav: UavState) -> Array:
        """Return H = dh/de at a state, ``(..., K, M, S)``."""

    def residual(self, value: Array, expected: Array) -> Array:
        """Return measured minus expected, ``(..., K, M)``, angles wrapped to (-pi, pi]."""
