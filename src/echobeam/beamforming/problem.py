"""Problem (38): one slot's beam design, for one problem and for a batch of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, SupportsIndex, TypeVar

import numpy as np
import numpy.typing as npt

from echobeam.beamforming.checking import (
    checked_array,
    checked_scalar,
    checked_vector,
    checked_warm_start,
    fitting_loss,
    off_the_sphere,
    out_of_plane,
    out_of_range,
    stated_loss,
)
from echobeam.brief import Brief
from echobeam.faults import InputError
from echobeam.physics.link import channel_loss
from echobeam.physics.planar import AntennaArray, PlanarArray
from echobeam.values import Array, Axis, BoolArray, ComplexArray, IntArray

ValueArray = TypeVar("ValueArray", Array, ComplexArray)

DEFAULT_RESOLUTION = math.radians(0.1)


class ProblemError(InputError):
    """Fault of a beam problem that makes no sense; the message lists every fault."""


@dataclass(frozen=True, slots=True, eq=False, init=False, repr=False)
class BeamProblem(Brief):
    """Design the beams of one slot, Eq. (38).

    Attributes
    ----------
    angles
        ``(K,)`` rad: the predicted angles theta-bar, where rates are evaluated and which the
        coverage is centred on. With a planar array ``(K, 2)`` direction cosines (u, v). One angle
        (one pair) is one object; all other values may be given once for all objects.
    distances
        ``(K,)`` m: the predicted distances.
    coverage_halfwidths
        ``(K,)`` rad: l sigma_theta of (38f), imposed at ``angle + j resolution`` for
        ``|j| <= ceil(halfwidth / resolution)``. With a planar array ``(K, 2, 2)``: positive
        definite matrices C of the ellipses x^T C^-1 x <= 1 in direction cosines, imposed on a
        square lattice and on the edge; zero for no cover but the direction itself.
    ripple
        ``(K,)``: B_k of (38f), at least 0; from the number of elements on it allows any pattern.
    min_rate
        ``(K,)`` bit/s/Hz: Gamma_k of (38e).
    power, noise
        P_T of (38b) and sigma_C^2, linear.
    alpha0
        Amplitude of the channel at 1 m.
    array
        The transmit array, linear or planar; instead of a linear one ``n_tx`` (number of
        antennas), ``spacing`` (wavelengths, 0.5 by default) and ``axis`` may be given:
        ``"vertical"``, the phase follows sin(angle), as in the paper, or ``"horizontal"``,
        cos(angle).
    resolution
        Step of the coverage grid, rad or direction cosine.
    warm_start
        ``(K, n_tx)`` complex: beams to start from, e.g. those of the last slot.

    Raises
    ------
    ProblemError
        If a value is out of its range or a shape does not fit; all faults in one message.
    """

    angles: Array
    distances: Array
    coverage_halfwidths: Array
    ripple: Array
    min_rate: Array
    power: float
    noise: float
    alpha0: float
    resolution: float
    warm_start: ComplexArray | None
    array: AntennaArray

    def __init__(
        self,
        angles: npt.ArrayLike,
        distances: npt.ArrayLike,
        coverage_halfwidths: npt.ArrayLike,
        ripple: npt.ArrayLike,
        min_rate: npt.ArrayLike,
        power: float,
        noise: float,
        n_tx: SupportsIndex | None = None,
        alpha0: float = 1.0,
        spacing: float = 0.5,
        axis: Axis = "vertical",
        resolution: float = DEFAULT_RESOLUTION,
        warm_start: npt.ArrayLike | None = None,
        array: AntennaArray | None = None,
    ) -> None:
        faults: list[str] = []
        pair = (2,) if isinstance(array, PlanarArray) else ()
        centres = checked_vector("angles", angles, None, faults, trailing=pair)
        n_objects = len(centres) if centres.size or not faults else None
        values = {
            "angles": centres,
            "distances": checked_vector("distances", distances, n_objects, faults),
            "coverage_halfwidths": checked_vector(
                "coverage_halfwidths", coverage_halfwidths, n_objects, faults, trailing=2 * pair
            ),
            "ripple": checked_vector("ripple", ripple, n_objects, faults),
            "min_rate": checked_vector("min_rate", min_rate, n_objects, faults),
        }
        given = {"power": power, "noise": noise, "alpha0": alpha0, "resolution": resolution}
        scalars = {name: checked_scalar(name, value, faults) for name, value in given.items()}
        flat = {name: vector.tolist() for name, vector in values.items()}
        if pair:
            del flat["coverage_halfwidths"]
            faults += off_the_sphere(centres, values["coverage_halfwidths"])
        else:
            faults += out_of_plane(flat["angles"], flat["coverage_halfwidths"])
        faults += out_of_range(flat, scalars)
        chosen = checked_array(array, n_tx, spacing, axis, faults)
        loss = stated_loss(values["distances"], scalars)
        if not faults and not fitting_loss(loss, scalars["power"]).all():
            faults.append("noise distances^2 / (power alpha0^2) is beyond 1e-24 to 1e24")
        warm = None
        if warm_start is not None and n_objects is not None and chosen is not None:
            warm = checked_warm_start("warm_start", warm_start, (n_objects, chosen.n), faults)
        if faults:
            raise ProblemError("; ".join(faults))
        for name, vector in values.items():
            vector.flags.writeable = False
            object.__setattr__(self, name, vector)
        for name, number in scalars.items():
            object.__setattr__(self, name, number)
        object.__setattr__(self, "array", chosen)
        object.__setattr__(self, "warm_start", warm)

    def replace(self, **changes: Any) -> BeamProblem:
        """Return the problem with other values of some attributes, checked as a new one.

        Raises
        ------
        ProblemError
            As for a new one.
        """
        return replace(self, **changes)

    @property
    def n_objects(self) -> int:
        """K."""
        return len(self.angles)

    @property
    def n_tx(self) -> int:
        """N_t, number of weights of a beam."""
        return self.array.n

    @property
    def loss(self) -> Array:
        """``(K,)``: noise over path gain, sigma_C^2 d^2 / alpha0^2."""
        return channel_loss(self.distances, self.noise, self.alpha0)

    def batch(self) -> ProblemBatch:
        """Return this problem as a batch of one."""
        warm = self.warm_start
        return ProblemBatch(
            angles=self.angles[np.newaxis],
            loss=self.loss[np.newaxis],
            coverage_halfwidths=self.coverage_halfwidths[np.newaxis],
            active=np.ones((1, self.n_objects), dtype=bool),
            ripple=self.ripple,
            min_rate=self.min_rate,
            power=self.power,
            array=self.array,
            resolution=self.resolution,
            warm_start=None if warm is None else warm[np.newaxis],
        )


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class ProblemBatch(Brief):
    """Many problems (38) on one array: a leading axis of ``T`` trials over `BeamProblem`.

    The values come from our own trackers and are not examined again; `BeamProblem` is the
    door for users' values.

    Attributes
    ----------
    angles, loss, coverage_halfwidths
        ``(T, K)``, with a planar array ``(T, K, 2)``, ``(T, K)`` and ``(T, K, 2, 2)``; anything
        where ``active`` is false. ``loss`` is noise over path gain.
    active
        ``(T, K)``: the objects that get a beam; those of the others are zero.
    ripple, min_rate
        ``(K,)``.
    power
        P_T.
    array
        The transmit array.
    warm_start
        ``(T, K, n_tx)`` complex, NaN where there is none.
    """

    angles: Array
    loss: Array
    coverage_halfwidths: Array
    active: BoolArray
    ripple: Array
    min_rate: Array
    power: float
    array: AntennaArray
    resolution: float = DEFAULT_RESOLUTION
    warm_start: ComplexArray | None = None

    def __len__(self) -> int:
        """T."""
        return int(self.angles.shape[0])

    @property
    def n_tx(self) -> int:
        """N_t."""
        return self.array.n

    def taken(self, trials: IntArray) -> ProblemBatch:
        """Return some of the trials, in the order given."""
        warm = self.warm_start
        return replace(
            self,
            angles=self.angles[trials],
            loss=self.loss[trials],
            coverage_halfwidths=self.coverage_halfwidths[trials],
            active=self.active[trials],
            warm_start=None if warm is None else warm[trials],
        )

    def problem(self, trial: int) -> BeamProblem:
        """Return one trial's problem, with its active objects only."""
        active = self.active[trial]
        warm = None if self.warm_start is None else self.warm_start[trial, active]
        if warm is not None and not np.isfinite(warm).all():
            warm = None
        return BeamProblem(
            angles=self.angles[trial, active],
            distances=_distances(self.loss[trial, active]),
            coverage_halfwidths=self.coverage_halfwidths[trial, active],
            ripple=self.ripple[active],
            min_rate=self.min_rate[active],
            power=self.power,
            noise=1.0,
            resolution=self.resolution,
            warm_start=warm,
            array=self.array,
        )


def only_active(active: BoolArray, values: ValueArray) -> ValueArray:
    """Return values ``(T, K, ...)`` with zeros for inactive objects, whose values may be NaN."""
    there = active.reshape(*active.shape, *(1,) * (values.ndim - active.ndim))
    return np.where(there, values, 0.0)


def _distances(loss: Array) -> Array:
    """Return distances that have a loss with unit noise and alpha0."""
    with np.errstate(invalid="ignore"):  # a lost track; `BeamProblem` says so
        distances: Array = np.sqrt(loss)
    return distances
