"""One trial of one scheme on the ground: its beams, its covers, and places in two coordinates."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from echobeam.beamforming.ellipse import square_root
from echobeam.physics.coordinates import direction_of
from echobeam.physics.plane import GroundGeometry
from echobeam.plots.source import Source
from echobeam.schemes.base import System
from echobeam.schemes.configure import system_for
from echobeam.simulation.statistics import cover_centre
from echobeam.values import Array, BoolArray, ComplexArray, ModeArray, UavState, with_beams

SHARE = 0.95
"""Probability of the regions drawn around positions."""

REGION = float(-2.0 * np.log(1.0 - SHARE))
"""Square of the standard deviations of the region that holds `SHARE` of a Gaussian in the plane."""

_TURN = np.linspace(0.0, 2.0 * np.pi, 73)


class GroundRun(NamedTuple):
    """Beams, places and covers of one trial of one scheme.

    ``slot`` and ``mode`` are ``(slot,)``, ``uav`` is ``(slot, 3)`` m; ``present`` is ``(slot,
    object)``; states ``truth``, ``predicted``, ``estimated`` are ``(slot, object, 4)``,
    ``predicted_cov`` and ``estimated_cov`` their covariances; ``centre`` ``(slot, object, 2)`` and
    ``cover`` ``(slot, object, 2, 2)`` are those of the ellipses of direction cosines; ``beams`` is
    ``(slot, object, weight)``, sqrt(power), of which that of ``shared`` ones is one.
    """

    slot: npt.NDArray[np.int64]
    mode: ModeArray
    uav: Array
    present: BoolArray
    truth: Array
    predicted: Array
    predicted_cov: Array
    estimated: Array
    estimated_cov: Array
    centre: Array
    cover: Array
    beams: ComplexArray
    shared: BoolArray
    system: System
    power: float

    @property
    def geometry(self) -> GroundGeometry:
        """The ground's geometry."""
        assert isinstance(self.system.geometry, GroundGeometry)
        return self.system.geometry

    @property
    def has_beam(self) -> BoolArray:
        """Whether a beam was sent for the object, ``(slot, object)``."""
        # NaN > 0 is false: no beams in omnidirectional and pilot slots.
        return np.asarray((np.abs(self.beams) > 0.0).any(axis=-1))

    @property
    def cover_words(self) -> str:
        """Name of the cover's edge, with its width."""
        return f"edge of the cover, {self.system.coverage.width:g}σ"

    def has_cover(self, index: int, k: int) -> bool:
        """Return whether the beam of an object was designed to cover an ellipse in a slot."""
        return bool(np.isfinite(self.centre[index, k]).all() and
                    np.isfinite(self.cover[index, k]).all())  # fmt: skip

    def objects(self, chosen: list[int]) -> list[int]:
        """Return the objects that are in the scene, or have a beam, in some of the slots."""
        seen = (self.present[chosen] | self.has_beam[chosen]).any(axis=0)
        return [int(k) for k in np.flatnonzero(seen)]

    def cosines(self, states: Array) -> Array:
        """Return the direction cosines ``(slot, object, 2)`` of states in their slots.

        They are NaN behind the array.
        """
        uav = UavState(self.uav[:, None], np.zeros_like(self.uav[:, None]))
        place = self.geometry.place(states, uav)
        return np.where(np.isfinite(place[..., 2:3]), direction_of(place, 2), np.nan)

    def radiated(self, index: int, cosines: Array) -> Array:
        """Return the power sent towards directions ``(..., 2)`` in a slot, the sum of all beams.

        Without beams it is the power of uncorrelated antennas, the same in all directions.
        """
        if not with_beams(self.mode[index]):
            return np.full(cosines.shape[:-1], self.power)
        beams = self.beams[index][np.isfinite(self.beams[index]).all(axis=-1)]
        if self.shared[index].any():  # one beam for several objects is sent once
            beams = np.unique(beams, axis=0)
        flat = cosines.reshape(1, -1, 2)
        power: Array = self.system.transmitter.pattern(beams, flat).sum(axis=0)
        return power.reshape(cosines.shape[:-1])

    def on_ground(self, index: int, cosines: Array) -> Array:
        """Return the points on the ground, ``(..., 2)`` m, in directions seen in a slot.

        Parameters
        ----------
        index
            Index of the slot.
        cosines
            ``(..., 2)``; NaN where the direction does not meet the ground or is not visible.
        """
        sight = self.geometry.sight(cosines)
        down = -sight[..., 2]
        inside = (np.sum(cosines**2, axis=-1) <= 1.0) & (down > 0.0)
        reach = np.where(inside, self.uav[index, 2] / np.where(inside, down, 1.0), np.nan)
        points: Array = self.uav[index, :2] + reach[..., None] * sight[..., :2]
        return points

    def seen(self, index: int, points: Array) -> tuple[Array, Array]:
        """Return direction cosines ``(..., 2)`` and distances ``(...)`` of points on the ground.

        The distance is infinite behind the array.
        """
        states = np.concatenate([points, np.zeros_like(points)], axis=-1)
        still = UavState(self.uav[index], np.zeros(3))
        place = self.geometry.place(states, still)
        return place[..., :2], place[..., 2]


def read_ground(source: Source) -> GroundRun:
    """Return the chosen trial and scheme of a run on the ground."""
    one = source.one_trial(
        "truth", "present", "predicted", "predicted_cov", "estimated", "estimated_cov", "cover",
        "beam", "mode", "uav_position",
    ).transpose("slot", "object", "state", "state_b", "cosine", "cosine_b", "antenna",
                 ...)  # fmt: skip
    system = system_for(source.scenario, source.one_scheme())
    beam = one["beam"]
    run = GroundRun(
        slot=one["slot"].values,
        mode=one["mode"].values,
        uav=one["uav_position"].values,
        present=one["present"].values.astype(bool),
        truth=one["truth"].values,
        predicted=one["predicted"].values,
        predicted_cov=one["predicted_cov"].values,
        estimated=one["estimated"].values,
        estimated_cov=one["estimated_cov"].values,
        centre=np.empty(0),
        cover=one["cover"].values,
        beams=beam.sel(part="re").values + 1j * beam.sel(part="im").values,
        shared=_shared(source, one["present"].shape),
        system=system,
        power=source.scenario.radio.power,
    )
    predicted, estimated = (run.cosines(one)[None] for one in (run.predicted, run.estimated))
    centre = cover_centre(predicted, estimated, system.coverage.centre, 2)[0]
    return run._replace(centre=centre)


def _shared(source: Source, shape: tuple[int, ...]) -> BoolArray:
    """Return ``(slot, object)``: whether one beam serves the object and others."""
    if "shared" not in source.result:
        return np.zeros(shape, dtype=bool)
    shared = source.one_trial("shared").transpose("slot", "object")["shared"]
    return np.asarray(shared.values, dtype=bool)


def edge(centre: Array, matrix: Array) -> Array:
    """Return points ``(n, 2)`` of the edge of an ellipse (x - c)^T M^-1 (x - c) = 1, a closed line.

    Parameters
    ----------
    centre, matrix
        ``(2,)`` and ``(2, 2)``.
    """
    circle = np.stack([np.cos(_TURN), np.sin(_TURN)], axis=-1)
    points: Array = centre + circle @ square_root(matrix).T
    return points
