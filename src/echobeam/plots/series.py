"""Numbers per slot behind the curves: sum rates, and errors with their bound."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from echobeam.simulation.statistics import (
    Statistics,
    error_sums,
    join,
    of_scheme,
    posterior_errors,
    rmse,
    sum_rate,
)
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


def sum_rates(result: xr.Dataset) -> Array:
    """Return the rate summed over the objects, ``(scheme, trial, slot)`` bit/s/Hz."""
    rate = result["rate"].transpose("scheme", "trial", "slot", "object").values
    present = result["present"].transpose("trial", "slot", "object").values.astype(bool)
    return sum_rate(rate, present)


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
    sums: list[Statistics] = []
    for first in range(0, result.sizes["trial"], CHUNK):
        part = result[["truth", "estimated"]].isel(trial=slice(first, first + CHUNK))
        truth = part["truth"].transpose("trial", "slot", "object", "state").values
        estimated = part["estimated"].transpose("scheme", "trial", "slot", "object", "state").values
        sums.append(error_sums(posterior_errors(estimated, truth)))
    whole = join(sums)
    rows = [rmse(of_scheme(whole, index), component) for index in range(result.sizes["scheme"])]
    return Errors(np.stack(rows), whole["errors"])


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


def _root_ratio(total: Array, count: Array) -> Array:
    """Return sqrt(total / count), NaN where nothing was counted."""
    some = count > 0
    return np.sqrt(np.where(some, total, np.nan) / np.where(some, count, 1.0))
