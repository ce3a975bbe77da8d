"""One trial of one scheme as beam patterns need it: beams, angles, what they have to cover."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from echobeam.physics.array import steering_vector
from echobeam.values import Array, Axis, BoolArray, ComplexArray

if TYPE_CHECKING:
    import xarray as xr


class BeamRun(NamedTuple):
    """Beams and angles of one trial.

    ``slot`` and ``phase`` are ``(slot,)``; ``present``, the angles ``truth``, ``predicted`` and
    ``estimated`` (rad) and the measured angle's ``angle_var`` (rad^2) are ``(slot, object)``;
    ``beams`` is ``(slot, object, antenna)``, sqrt(power).
    """

    slot: npt.NDArray[np.int64]
    phase: npt.NDArray[np.str_]
    present: BoolArray
    truth: Array
    predicted: Array
    estimated: Array
    angle_var: Array
    beams: ComplexArray


def read_beams(result: xr.Dataset, scheme: str, trial: int) -> BeamRun:
    """Return the beams of one trial (counted from 0) of one scheme."""
    names = ["truth", "present", "predicted", "estimated", "measured_var", "beam", "phase"]
    one = result[names].isel(trial=trial).sel(scheme=scheme)
    one = one.transpose("slot", "object", "antenna", "part", ...)
    beam = one["beam"]
    return BeamRun(
        slot=one["slot"].values,
        phase=one["phase"].values.astype(str),
        present=one["present"].values.astype(bool),
        truth=one["truth"].sel(state="angle").values,
        predicted=one["predicted"].sel(state="angle").values,
        estimated=one["estimated"].sel(state="angle").values,
        angle_var=one["measured_var"].sel(measurement="angle").values,
        beams=beam.sel(part="re").values + 1j * beam.sel(part="im").values,
    )


def beam_gain(beams: ComplexArray, angles: Array, spacing: float, axis: Axis) -> Array:
    """Return the power that beams send towards angles, |a(theta)^H w|^2 with a of Eq. (4).

    Parameters
    ----------
    beams
        ``(..., N)``, sqrt(power).
    angles
        ``(G,)`` rad.
    spacing
        Of the antennas, in wavelengths.
    axis
        As in `steering_vector`.

    Returns
    -------
    Array
        ``(..., G)``, power.
    """
    a = steering_vector(angles, beams.shape[-1], spacing, axis)
    return np.asarray(np.abs(np.einsum("gn,...n->...g", a.conj(), beams)) ** 2)


def has_beam(run: BeamRun) -> BoolArray:
    """Return ``(slot, object)``: whether a beam was sent for the object."""
    # NaN > 0 is false: no beams in omnidirectional and pilot slots.
    return np.asarray((np.abs(run.beams) > 0.0).any(axis=-1))


def believed_angles(run: BeamRun, index: int) -> Array:
    """Return where the objects were believed to be when a slot's beams were made, ``(K,)`` rad.

    That is the prediction, or the last estimate of a scheme that makes none (pilot); NaN where
    there is neither.
    """
    predicted: Array = run.predicted[index]
    if index == 0:
        return predicted
    return np.where(np.isfinite(predicted), predicted, run.estimated[index - 1])


def coverage_halfwidths(run: BeamRun, index: int, width: float, most: float) -> Array:
    """Return what a slot's beams have to cover on either side, Eq. (38f).

    That is ``width`` standard deviations of the last angle measurement before the slot.

    Parameters
    ----------
    run
        A trial.
    index
        The slot, counted from 0.
    width
        l of (38f).
    most
        rad: no coverage is wider.

    Returns
    -------
    Array
        ``(K,)`` rad; NaN where the object was not measured before.
    """
    last = np.full(run.truth.shape[1], np.nan)
    for n in range(index):
        measured = np.isfinite(run.angle_var[n])
        last = np.where(measured, np.sqrt(np.where(measured, run.angle_var[n], 0.0)), last)
        last[~run.present[n]] = np.nan
    return np.minimum(width * last, most)
