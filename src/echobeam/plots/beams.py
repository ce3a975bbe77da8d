"""Beams, angles and covers of one trial of one scheme, as beam patterns need them."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from echobeam.physics.array import LinearArray
from echobeam.simulation.statistics import cover_centre
from echobeam.values import Array, BoolArray, ComplexArray, ModeArray

if TYPE_CHECKING:
    import xarray as xr


class BeamRun(NamedTuple):
    """Beams and angles of one trial.

    ``slot`` and ``mode`` are ``(slot,)``; ``present``, the angles ``truth``, ``predicted`` and
    ``estimated`` (rad) and the half-width ``covered`` (rad) are ``(slot, object)``; ``beams`` is
    ``(slot, object, antenna)``, sqrt(power).
    """

    slot: npt.NDArray[np.int64]
    mode: ModeArray
    present: BoolArray
    truth: Array
    predicted: Array
    estimated: Array
    covered: Array
    beams: ComplexArray


def read_beams(result: xr.Dataset, scheme: str, trial: int) -> BeamRun:
    """Return the beams of one trial (counted from 0) of one scheme."""
    names = ["truth", "present", "predicted", "estimated", "covered", "beam", "mode"]
    one = result[names].isel(trial=trial).sel(scheme=scheme)
    one = one.transpose("slot", "object", "antenna", "part", ...)
    beam = one["beam"]
    return BeamRun(
        slot=one["slot"].values,
        mode=one["mode"].values,
        present=one["present"].values.astype(bool),
        truth=one["truth"].sel(state="angle").values,
        predicted=one["predicted"].sel(state="angle").values,
        estimated=one["estimated"].sel(state="angle").values,
        covered=one["covered"].values,
        beams=beam.sel(part="re").values + 1j * beam.sel(part="im").values,
    )


def beam_gain(beams: ComplexArray, angles: Array, array: LinearArray) -> Array:
    """Return the power that beams send towards angles, |a(theta)^H w|^2 with a of Eq. (4).

    Parameters
    ----------
    beams
        ``(..., N)``, sqrt(power).
    angles
        ``(G,)`` rad.
    array
        The transmit array.

    Returns
    -------
    Array
        ``(..., G)``, power.
    """
    a = array.steering(angles)
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
    believed: Array = cover_centre(run.predicted, run.estimated, "predicted")[index]
    return believed
