"""Echoes of a slot as the tracker on the ground uses them, and the law of their variance."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from echobeam.physics.measurement import measured_place
from echobeam.physics.polar import POLAR
from echobeam.schemes.base import View
from echobeam.tracking.ground import polar_of
from echobeam.tracking.road_grid import PositionGrid
from echobeam.values import Array, BoolArray, Tracks


@dataclass(frozen=True, slots=True)
class Echoes:
    """Measurements ``(T, K, M)``, variances stated with them, and strengths ``(T, K)``."""

    value: Array
    stated: Array
    strength: Array | None

    def of(self, trials: BoolArray) -> Echoes:
        """Return those of some trials ``(T,)``."""
        strength = None if self.strength is None else self.strength[trials]
        return Echoes(self.value[trials], self.stated[trials], strength)

    def for_each(self, change: Callable[[Array], Array]) -> Echoes:
        """Return the same with a change of the objects' axis."""
        strength = None if self.strength is None else change(self.strength)
        return Echoes(change(self.value), change(self.stated), strength)

    def of_objects(self, chosen: BoolArray) -> Echoes:
        """Return those of some objects ``(T, K)``, an object each: ``(M, 1, ...)``."""
        strength = None if self.strength is None else self.strength[chosen][:, None]
        return Echoes(self.value[chosen][:, None], self.stated[chosen][:, None], strength)


def law_on(grid: PositionGrid, echoes: Echoes, view: View) -> Array:
    """Return the law of the variance at every point of a grid, ``(T, K, G, M)``."""
    assert view.sent is not None
    shape = grid.state.shape
    place = polar_of(grid.state, view.uav).reshape(shape[0], -1, POLAR.size)
    law = view.system.law
    with np.errstate(all="ignore"):  # unknown objects
        snr = law.snr(view.sent, place, along=True).reshape(shape[:-1])
        if echoes.strength is not None:
            snr = snr * echoes.strength[..., None]
        variance = law.variance(view.sent, place, snr.reshape(shape[0], -1))
    return variance.reshape(*shape[:-1], -1)


def strength_of(tracks: Tracks, value: Array, stated: Array, view: View) -> Array | None:
    """Return how strong each echo is over its mean, ``(T, K)``; None where all are alike.

    The receiver sees it; the variance of the delay is stated for it, at the prediction or, without
    one, at the measured place.
    """
    if not (view.system.law_known and not view.system.detection.fluctuation.steady):
        return None
    assert view.sent is not None
    here = np.where(tracks.known[..., None], tracks.mean, measured_place(value))
    with np.errstate(all="ignore"):
        steady = view.system.law.variance(view.sent, here)
        ratio = steady[..., 1] / stated[..., 1]
    return np.where(np.isfinite(ratio) & (ratio > 0.0), ratio, 1.0)
