"""Problem (38): one slot's beam design, for one problem and for a batch of them."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from echobeam.faults import InputError
from echobeam.physics.array import LinearArray
from echobeam.physics.link import channel_loss
from echobeam.physics.planar import AntennaArray, PlanarArray
from echobeam.values import Array, Axis, BoolArray, ComplexArray, IntArray

DEFAULT_RESOLUTION = math.radians(0.1)

MOST = {
    "power": 1e30,
    "noise": 1e30,
    "alpha0": 1e30,
    "resolution": 1e30,
    "spacing": 100.0,
    "distances": 1e30,
    "ripple": 1e30,
    "min_rate": 300.0,
}
"""Largest values, and 1 / 1e30 the least positive ones: beyond them squares leave the numbers."""

LEAST = 1e-30

MOST_ANGLE = math.pi + 1e-9
"""rad: largest angle of a direction; more are degrees, most probably."""

VISIBLE, SYMMETRIC, THIN = 1e-9, 1e-9, 1e-12
"""What rounding may do to u^2 + v^2 of a direction, to the symmetry of a cover's matrix, and to the
ratio of its eigenvalues."""

MOST_SHOWN = 80
"""Characters of a wrong value that a message repeats."""

MOST_LOSS = 1e24
"""Largest noise d^2 / (power alpha0^2), and its inverse the least one."""


class ProblemError(InputError):
    """A beam problem that makes no sense; the message lists every fault."""


@dataclass(frozen=True, slots=True, eq=False, init=False)
class BeamProblem:
    """Design the beams of one slot, Eq. (38).

    Attributes
    ----------
    angles
        ``(K,)`` rad: the predicted angles theta-bar, where rates are evaluated and which the
        coverage is centred on. With a planar array ``(K, 2)`` direction cosines (u, v).
    distances
        ``(K,)`` m: the predicted distances.
    coverage_halfwidths
        ``(K,)`` rad: l sigma_theta of (38f), imposed at ``angle + j resolution`` for
        ``|j| <= ceil(halfwidth / resolution)``. With a planar array ``(K, 2, 2)``: positive
        definite matrices C of the ellipses x^T C^-1 x <= 1 in direction cosines, imposed on a
        square lattice and on the edge; zero for no cover but the direction itself.
    ripple
        Scalar or ``(K,)``: B_k of (38f), 0 to the number of elements.
    min_rate
        Scalar or ``(K,)`` bit/s/Hz: Gamma_k of (38e).
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
        n_tx: int | None = None,
        alpha0: float = 1.0,
        spacing: float = 0.5,
        axis: Axis = "vertical",
        resolution: float = DEFAULT_RESOLUTION,
        warm_start: npt.ArrayLike | None = None,
        array: AntennaArray | None = None,
    ) -> None:
        faults: list[str] = []
        pair = (2,) if isinstance(array, PlanarArray) else ()
        centres = _vector("angles", angles, None, faults, trailing=pair)
        n_objects = len(centres) if centres.size or not faults else None
        values = {
            "angles": centres,
            "distances": _vector("distances", distances, n_objects, faults),
            "coverage_halfwidths": _vector(
                "coverage_halfwidths", coverage_halfwidths, n_objects, faults, trailing=2 * pair
            ),
            "ripple": _vector("ripple", ripple, n_objects, faults, broadcast=True),
            "min_rate": _vector("min_rate", min_rate, n_objects, faults, broadcast=True),
        }
        given = {"power": power, "noise": noise, "alpha0": alpha0, "resolution": resolution}
        scalars = {name: _scalar(name, value, faults) for name, value in given.items()}
        flat = {name: vector.tolist() for name, vector in values.items()}
        if pair:
            del flat["coverage_halfwidths"]
            faults += _off_the_sphere(centres, values["coverage_halfwidths"])
        else:
            faults += _out_of_plane(flat["angles"], flat["coverage_halfwidths"])
        faults += _out_of_range(flat, scalars)
        chosen = _array(array, n_tx, spacing, axis, faults)
        loss = _loss(values["distances"], scalars)
        if not faults and not fitting_loss(loss, scalars["power"]).all():
            faults.append("noise distances^2 / (power alpha0^2) is beyond 1e-24 to 1e24")
        warm = None
        if warm_start is not None and n_objects is not None and chosen is not None:
            warm = _warm("warm_start", warm_start, (n_objects, chosen.n), faults)
        if faults:
            raise ProblemError("; ".join(faults))
        for name, vector in values.items():
            vector.flags.writeable = False
            object.__setattr__(self, name, vector)
        for name, number in scalars.items():
            object.__setattr__(self, name, number)
        object.__setattr__(self, "array", chosen)
        object.__setattr__(self, "warm_start", warm)

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


@dataclass(frozen=True, slots=True, eq=False)
class ProblemBatch:
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


def fitting_directions(array: AntennaArray, directions: Array, covers: Array) -> BoolArray:
    """Return where directions and covers are ones that a solver takes, ``(...)``."""
    if isinstance(array, PlanarArray):
        finite = np.isfinite(directions).all(axis=-1) & np.isfinite(covers).all(axis=(-2, -1))
        known = np.where(finite[..., np.newaxis, np.newaxis], covers, 0.0)
        squares = np.linalg.eigvalsh(known)
        some = np.asarray(np.any(known != 0.0, axis=(-2, -1)))
        thin = squares[..., 0] <= THIN * squares[..., 1]
        return np.asarray(finite & (squares[..., 1] <= 1.0) & ~(some & thin))
    return np.asarray(np.isfinite(directions) & (covers >= 0.0) & (covers <= np.pi / 2))


def fitting_loss(loss: Array, power: float) -> BoolArray:
    """Return where noise d^2 / (power alpha0^2) is within the numbers that a solver takes."""
    with np.errstate(
        divide="ignore", invalid="ignore"
    ):  # no loss, or a lost track: they do not fit
        size = np.log(loss / power)
    fits: BoolArray = np.abs(size) <= math.log(MOST_LOSS)
    return fits


def _distances(loss: Array) -> Array:
    """Return distances that have a loss with unit noise and alpha0."""
    with np.errstate(invalid="ignore"):  # a lost track; `BeamProblem` says so
        distances: Array = np.sqrt(loss)
    return distances


def _loss(distances: Array, scalars: dict[str, float]) -> Array:
    with np.errstate(all="ignore"):  # values out of their range are named elsewhere
        return channel_loss(distances, scalars["noise"], scalars["alpha0"])


def _array(
    array: object,
    n_tx: object,
    spacing: object,
    axis: object,
    faults: list[str],
) -> AntennaArray | None:
    """Return the array that is given, or made of its three numbers; None if it is at fault."""
    if array is not None:
        if not isinstance(array, AntennaArray):
            kind = type(array).__name__
            faults.append(f"array must be a LinearArray or a PlanarArray, not a {kind}")
            return None
        if n_tx is not None and n_tx != array.n:
            faults.append(
                f"n_tx = {n_tx!r} contradicts the array, whose beams have {array.n} weights"
            )
        return array
    before = len(faults)
    if n_tx is None:
        faults.append("n_tx or array must be given")
        number = 1.0
    else:
        number = _scalar("n_tx", n_tx, faults)
        if number < 1 or number != int(number):
            faults.append(f"n_tx must be a whole number from 1, not {number:g}")
    distance = _scalar("spacing", spacing, faults)
    most = MOST["spacing"]
    if not distance > 0.0:
        faults.append(f"spacing must be positive, not {distance:g}")
    elif not LEAST <= distance <= most:
        faults.append(f"spacing must lie between {LEAST:g} and {most:g}, not {distance:g}")
    if not isinstance(axis, str) or axis not in ("vertical", "horizontal"):
        faults.append(f"axis must be 'vertical' or 'horizontal', not {axis!r}")
    if len(faults) > before:
        return None
    return LinearArray(int(number), distance, axis)  # type: ignore[arg-type]


def _out_of_range(vectors: dict[str, list[float]], scalars: dict[str, float]) -> list[str]:
    """Return a fault for every value that lies outside its range.

    Plain numbers: with so few, NumPy would take longer than the solver.
    """
    faults = []
    given = vectors | {name: [number] for name, number in scalars.items()}
    for name, most in MOST.items():
        if name not in given:
            continue
        if not all(x <= 0.0 or LEAST <= x <= most for x in given[name]):
            faults.append(f"{name} must lie between {LEAST:g} and {most:g}, not {given[name]}")
    if not all(x > 0.0 for x in vectors["distances"]):
        faults.append(f"distances must be positive, not {vectors['distances']}")
    for name in ("ripple", "min_rate"):
        if not all(x >= 0.0 for x in vectors[name]):
            faults.append(f"{name} must not be negative: {vectors[name]}")
    faults += [
        f"{name} must be positive, not {number:g}"
        for name, number in scalars.items()
        if not number > 0.0
    ]
    return faults


def _out_of_plane(angles: list[float], halfwidths: list[float]) -> list[str]:
    """Return the faults of angles and half-widths of a linear array."""
    faults = []
    if not all(abs(x) <= MOST_ANGLE for x in angles):
        faults.append(f"angles must lie between -pi and pi rad (are they degrees?), not {angles}")
    if not all(0.0 <= x <= math.pi / 2 for x in halfwidths):
        faults.append(
            f"coverage_halfwidths must lie between 0 and pi/2 (the half plane), not {halfwidths}"
        )
    return faults


def _off_the_sphere(directions: Array, covers: Array) -> list[str]:
    """Return the faults of directions and ellipses of a planar array."""
    faults = []
    if directions.size and not np.all(np.sum(directions**2, axis=-1) <= 1.0 + VISIBLE):
        faults.append(
            "angles must be direction cosines (u, v) with u^2 + v^2 <= 1, "
            f"not {_shown(directions.tolist())}"
        )
    if not covers.size:
        return faults
    if np.any(np.abs(covers - np.swapaxes(covers, -1, -2)) > SYMMETRIC * np.abs(covers).max()):
        return [*faults, f"coverage_halfwidths must be symmetric, not {_shown(covers.tolist())}"]
    squares = np.linalg.eigvalsh(covers)
    some = np.asarray(np.any(covers != 0.0, axis=(-2, -1)))
    thin = squares[..., 0] <= THIN * squares[..., 1]
    if np.any(some & thin):
        faults.append(
            "coverage_halfwidths must be positive definite matrices, or zero for no cover, "
            f"not {_shown(covers.tolist())}"
        )
    elif np.any(squares > 1.0):
        faults.append(
            "coverage_halfwidths must be ellipses of half-axes up to 1 (all that is visible), "
            f"not {_shown(covers.tolist())}"
        )
    elif np.any(some & (squares[..., 0] < LEAST**0.5)):
        faults.append(f"coverage_halfwidths must be ellipses of half-axes from {LEAST**0.25:.2g}")
    return faults


def _vector(
    name: str,
    value: Any,
    size: int | None,
    faults: list[str],
    broadcast: bool = False,
    trailing: tuple[int, ...] = (),
) -> Array:
    """Return numbers of shape ``(size, *trailing)``; ones, and a fault, if they are none."""
    fallback = np.ones((size or 0, *trailing))
    try:
        if np.iscomplexobj(value):
            raise TypeError("numpy would drop the imaginary parts with no more than a warning")
        vector = np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        faults.append(f"{name} must be numbers, not {_shown(value)}")
        return fallback
    if broadcast and vector.ndim == 0:
        vector = np.full(1 if size is None else size, float(vector))
    wrong = vector.shape[1:] != trailing or vector.ndim == 0
    if wrong or (size is not None and len(vector) != size):
        wanted = ", ".join(map(str, ("K" if size is None else size, *trailing)))
        wanted = f"({wanted})" if trailing else f"({wanted},)"
        wanted += " or a scalar" if broadcast else ""
        faults.append(f"{name} must be of shape {wanted}, not {vector.shape}")
        return fallback
    if not np.isfinite(vector).all():
        faults.append(f"{name} must be finite, not {vector.tolist()}")
        return np.ones(vector.shape)
    return vector


def _scalar(name: str, value: Any, faults: list[str]) -> float:
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        faults.append(f"{name} must be a number, not {_shown(value)}")
        return 1.0
    if not math.isfinite(number):
        faults.append(f"{name} must be finite, not {value!r}")
        return 1.0
    return number


def _warm(
    name: str, value: object, shape: tuple[int, int], faults: list[str]
) -> ComplexArray | None:
    try:
        warm = np.array(value, dtype=complex)
    except (TypeError, ValueError, OverflowError):
        faults.append(f"{name} must be numbers of shape {shape}, not {_shown(value)}")
        return None
    if warm.shape != shape or not np.isfinite(warm).all():
        faults.append(f"{name} must be finite and of shape {shape}, not {_shown(value)}")
        return None
    warm.flags.writeable = False
    return warm


def _shown(value: object) -> str:
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # a whole number of more digits than Python writes out
        return "a number too large"
    return text if len(text) <= MOST_SHOWN else text[: MOST_SHOWN - 3] + "..."
