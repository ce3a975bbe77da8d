"""Checks of a beam problem's values: ranges, shapes, what a direction can mean."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from echobeam.physics.array import LinearArray
from echobeam.physics.link import channel_loss
from echobeam.physics.planar import AntennaArray, PlanarArray
from echobeam.values import Array, BoolArray, ComplexArray

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
"""Allowances for rounding: of u^2 + v^2 of a direction, of the symmetry of a cover's matrix, and of
the ratio of its eigenvalues."""

MOST_SHOWN = 80
"""Characters of a wrong value that a message repeats."""

MOST_LOSS = 1e24
"""Largest noise d^2 / (power alpha0^2), and its inverse the least one."""


def fitting_directions(array: AntennaArray, directions: Array, covers: Array) -> BoolArray:
    """Return where directions and covers are ones that a solver takes, ``(...)``."""
    if isinstance(array, PlanarArray):
        finite = np.asarray(np.isfinite(directions).all(axis=-1))
        finite = np.asarray(finite & np.isfinite(covers).all(axis=(-2, -1)))
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


def stated_loss(distances: Array, scalars: dict[str, float]) -> Array:
    """Return noise over path gain ``(K,)`` of values that may be out of their range."""
    with np.errstate(all="ignore"):  # values out of their range are named elsewhere
        return channel_loss(distances, scalars["noise"], scalars["alpha0"])


def checked_array(
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
        number = checked_scalar("n_tx", n_tx, faults)
        if isinstance(n_tx, bool | np.bool_):
            faults.append(f"n_tx must be a whole number from 1, not {n_tx}")
        elif number < 1 or number != int(number):
            faults.append(f"n_tx must be a whole number from 1, not {number:g}")
    distance = checked_scalar("spacing", spacing, faults)
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


def out_of_range(vectors: dict[str, list[float]], scalars: dict[str, float]) -> list[str]:
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


def out_of_plane(angles: list[float], halfwidths: list[float]) -> list[str]:
    """Return the faults of angles and half-widths of a linear array."""
    faults = []
    if not all(abs(x) <= MOST_ANGLE for x in angles):
        faults.append(f"angles must lie between -pi and pi rad (are they degrees?), not {angles}")
    if not all(0.0 <= x <= math.pi / 2 for x in halfwidths):
        faults.append(
            f"coverage_halfwidths must lie between 0 and pi/2 (the half plane), not {halfwidths}"
        )
    return faults


def off_the_sphere(directions: Array, covers: Array) -> list[str]:
    """Return the faults of directions and ellipses of a planar array."""
    faults = []
    if directions.size and not np.all(np.sum(directions**2, axis=-1) <= 1.0 + VISIBLE):
        faults.append(
            "angles must be direction cosines (u, v) with u^2 + v^2 <= 1, "
            f"not {shown(directions.tolist())}"
        )
    if not covers.size:
        return faults
    if np.any(np.abs(covers - np.swapaxes(covers, -1, -2)) > SYMMETRIC * np.abs(covers).max()):
        return [*faults, f"coverage_halfwidths must be symmetric, not {shown(covers.tolist())}"]
    squares = np.linalg.eigvalsh(covers)
    some = np.asarray(np.any(covers != 0.0, axis=(-2, -1)))
    thin = squares[..., 0] <= THIN * squares[..., 1]
    if np.any(some & thin):
        faults.append(
            "coverage_halfwidths must be positive definite matrices, or zero for no cover, "
            f"not {shown(covers.tolist())}"
        )
    elif np.any(squares > 1.0):
        faults.append(
            "coverage_halfwidths must be ellipses of half-axes up to 1 (all that is visible), "
            f"not {shown(covers.tolist())}"
        )
    elif np.any(some & (squares[..., 0] < LEAST**0.5)):
        faults.append(f"coverage_halfwidths must be ellipses of half-axes from {LEAST**0.25:.2g}")
    return faults


def checked_vector(
    name: str,
    value: Any,
    size: int | None,
    faults: list[str],
    trailing: tuple[int, ...] = (),
) -> Array:
    """Return numbers of shape ``(size, *trailing)``; others that fit, and a fault, if not.

    One of shape ``trailing`` counts for every object; without a size it is that of one object.
    """
    fallback = np.zeros((size or 0, *trailing)) if trailing else np.ones(size or 0)
    try:
        if np.iscomplexobj(value):
            raise TypeError("numpy would drop the imaginary parts with no more than a warning")
        vector = np.array(value, dtype=float)
    except (TypeError, ValueError, OverflowError):
        faults.append(f"{name} must be numbers, not {shown(value)}")
        return fallback
    if vector.shape == trailing:
        vector = np.array(np.broadcast_to(vector, (1 if size is None else size, *trailing)))
    wrong = vector.shape[1:] != trailing or vector.ndim == 0
    if wrong or (size is not None and len(vector) != size):
        wanted = ", ".join(map(str, ("K" if size is None else size, *trailing)))
        wanted = f"({wanted}) or {trailing}" if trailing else f"({wanted},) or a scalar"
        faults.append(f"{name} must be of shape {wanted}, not {vector.shape}")
        return fallback
    if not np.isfinite(vector).all():
        faults.append(f"{name} must be finite, not {vector.tolist()}")
        return np.zeros(vector.shape) if trailing else np.ones(vector.shape)
    return vector


def checked_scalar(name: str, value: Any, faults: list[str]) -> float:
    """Return a finite number; one, and a fault, if it is none."""
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        faults.append(f"{name} must be a number, not {shown(value)}")
        return 1.0
    if not math.isfinite(number):
        faults.append(f"{name} must be finite, not {value!r}")
        return 1.0
    return number


def checked_warm_start(
    name: str, value: object, shape: tuple[int, int], faults: list[str]
) -> ComplexArray | None:
    """Return finite beams of a shape; None, and a fault, if they are none."""
    try:
        warm = np.array(value, dtype=complex)
    except (TypeError, ValueError, OverflowError):
        faults.append(f"{name} must be numbers of shape {shape}, not {shown(value)}")
        return None
    if warm.shape != shape or not np.isfinite(warm).all():
        faults.append(f"{name} must be finite and of shape {shape}, not {shown(value)}")
        return None
    warm.flags.writeable = False
    return warm


def shown(value: object) -> str:
    """Return a wrong value as a message repeats it."""
    try:
        text = " ".join(repr(value).split())
    except ValueError:  # a whole number of more digits than Python writes out
        return "a number too large"
    return text if len(text) <= MOST_SHOWN else text[: MOST_SHOWN - 3] + "..."
