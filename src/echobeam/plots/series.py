"""Numbers per slot behind the curves: sum rates, and errors with their bound."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from echobeam.estimation.gaussian import wrap
from echobeam.values import Array, BoolArray

if TYPE_CHECKING:
    import xarray as xr

CHUNK = 512


class Errors(NamedTuple):
    """Errors of the estimates, pooled over trials and the objects that were there.

    ``rmse`` is ``(scheme, slot)``; ``trials`` is ``(scheme, slot, object)``, the number that went
    into it.
    """

    rmse: Array
    trials: Array


def sum_rate(result: xr.Dataset) -> Array:
    """Return the rate summed over the objects, ``(scheme, trial, slot)``, bit/s/Hz.

    An object without a rate (not in the scene) adds nothing.
    """
    rate = result["rate"].transpose("scheme", "trial", "slot", "object").values
    return np.asarray(np.nansum(rate, axis=-1), dtype=float)


def has_rate(result: xr.Dataset) -> BoolArray:
    """Return for each scheme whether it has any rate at all, ``(scheme,)``."""
    return np.asarray(result["rate"].notnull().any(("trial", "slot", "object")).values, dtype=bool)


def estimation_errors(result: xr.Dataset, component: str) -> Errors:
    """Return the root mean square error of one component of the estimated state.

    Parameters
    ----------
    result
        A result.
    component
        ``"angle"`` (rad, differences wrapped), ``"distance"`` (m) or ``"velocity"`` (m/s).
    """
    shape = tuple(result.sizes[name] for name in ("scheme", "slot", "object"))
    square, trials = np.zeros(shape), np.zeros(shape)
    for first in range(0, result.sizes["trial"], CHUNK):
        part = result[["truth", "present", "estimated"]].isel(trial=slice(first, first + CHUNK))
        error = _errors(part.sel(state=component), component)
        square += np.nansum(error**2, axis=1)
        trials += np.isfinite(error).sum(axis=1)
    return Errors(_root_ratio(square.sum(axis=-1), trials.sum(axis=-1)), trials)


def pooled_bound(result: xr.Dataset, component: str, trials: Array) -> Array | None:
    """Return the bound on `estimation_errors`, ``(scheme, slot)``; None if the result has none.

    The bound is one on filters. A scheme that never predicts but holds an old estimate is a
    biased estimator, which the bound does not bind: its row is NaN.

    Parameters
    ----------
    result
        A result, with the optional variable ``bound`` (scheme, slot, object, state): the
        posterior Cramer-Rao bound as standard deviations.
    component
        As in `estimation_errors`.
    trials
        ``(scheme, slot, object)``: the number of trials behind the errors, which weigh the objects.
    """
    if "bound" not in result.variables:
        return None
    bound = result["bound"].sel(state=component).transpose("scheme", "slot", "object").values
    predicts = result["predicted"].sel(state=component).notnull().any(("trial", "slot", "object"))
    bound = np.where(predicts.values[:, None, None], bound, np.nan)
    weight = np.where(np.isfinite(bound), trials, 0.0)
    square = np.where(np.isfinite(bound), bound, 0.0) ** 2
    return _root_ratio((weight * square).sum(axis=-1), weight.sum(axis=-1))


def _errors(part: xr.Dataset, component: str) -> Array:
    """Return ``(scheme, trial, slot, object)``: errors; NaN for objects that are not there."""
    truth = part["truth"].transpose("trial", "slot", "object").values
    present = part["present"].transpose("trial", "slot", "object").values.astype(bool)
    estimated = part["estimated"].transpose("scheme", "trial", "slot", "object").values
    error = estimated - np.where(present, truth, np.nan)
    return wrap(error) if component == "angle" else error


def _root_ratio(total: Array, count: Array) -> Array:
    """Return sqrt(total / count), NaN where nothing was counted."""
    some = count > 0
    return np.sqrt(np.where(some, total, np.nan) / np.where(some, count, 1.0))
