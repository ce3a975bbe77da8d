"""Forecasts of a filter: predictions without measurements, and their errors."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from echobeam.estimation.gaussian import propagate, wrap
from echobeam.physics.geometry import offset, offset_cov
from echobeam.physics.polar import POLAR
from echobeam.scenario.model import Scenario
from echobeam.schemes.base import System
from echobeam.schemes.configure import system_for
from echobeam.schemes.models import motion_of
from echobeam.tracking.evolution import evolution_jacobian, evolve
from echobeam.values import NOBODY, Array, BoolArray, IntArray, UavState

if TYPE_CHECKING:
    import xarray as xr

MOST_SLOTS = 50
"""The longest horizon."""

SIGMAS = 3.0
"""Half-width of the promised band, in standard deviations."""

QUANTITIES = (*POLAR.names, "position")
"""Quantities that are forecast; the position is that in the vertical plane above the road."""

ON_GROUND = ("position", "velocity")
"""The same of objects on the ground in two dimensions."""

CHUNK = 128


class Forecast(NamedTuple):
    """Forecasts over one horizon: states ``(..., S)`` rad, m, m/s and covariances."""

    horizon: int
    mean: Array
    cov: Array


class Cone(NamedTuple):
    """A forecast of one object: slots counted from 0, position along the road and its std, m.

    All are ``(h + 1,)``; the first is the posterior of the slot in which it was made.
    """

    slots: IntArray
    centres: Array
    deviations: Array


def forecasts(
    mean: Array, cov: Array, origins: IntArray, most: int, uav_velocity: Array, system: System
) -> Iterator[Forecast]:
    """Yield the predictions from some slots' posteriors, one slot further ahead each time.

    The UAV's flight is known ahead, Eqs. (44)-(46) are repeated without any update.

    Parameters
    ----------
    mean, cov
        ``(..., m, K, 3)`` and ``(..., m, K, 3, 3)``: posteriors of m slots.
    origins
        ``(m,)``: these slots, counted from 0, ascending. Forecasts that would reach beyond the
        flight's last slot end: the results' axis of slots grows shorter.
    most
        The longest horizon, slots.
    uav_velocity
        ``(n, 3)`` m/s: the flight, slot by slot.
    system
        The system of the scheme, with the settings of its filter.
    """
    settings, duration = system.filter, system.slot_duration
    speed = np.hypot(uav_velocity[:, 0], uav_velocity[:, 2])
    heading = np.arctan2(uav_velocity[:, 2], uav_velocity[:, 0])
    process = np.diag([settings.angle_std, settings.distance_std, settings.velocity_std]) ** 2
    on_ground = motion_of(system) if system.geometry.axes > 1 else None
    for horizon in range(1, most + 1):
        left = int(np.sum(origins + horizon < len(speed)))
        mean, cov = mean[..., :left, :, :], cov[..., :left, :, :, :]
        if on_ground is not None:  # whose motion does not depend on the UAV's
            nowhere = UavState(np.zeros(3), np.zeros(3))
            cov = propagate(cov, on_ground.jacobian(mean, nowhere), on_ground.noise())
            mean = on_ground.step(mean, nowhere)
            yield Forecast(horizon, mean, cov)
            continue
        flown = origins[:left] + horizon - 1
        motion = speed[flown, None], heading[flown, None], duration, settings.evolution
        with np.errstate(all="ignore"):  # a lost track may pass through the UAV
            G = evolution_jacobian(mean, *motion)
            mean, cov = evolve(mean, *motion), propagate(cov, G, process)
        yield Forecast(horizon, mean, cov)


def make_cones(
    mean: Array,
    cov: Array,
    starts: Sequence[int],
    end: int,
    uav: tuple[Array, Array],
    system: System,
) -> list[Cone]:
    """Return the forecasts of one object from some slots, in one trial.

    Each ends where the next begins or the stay ends, and after 50 slots at most. Where nothing
    is known, or nothing is in doubt, there is none.

    Parameters
    ----------
    mean, cov
        ``(n, 3)`` and ``(n, 3, 3)``: posteriors of all slots.
    starts, end
        Slots counted from 0, ascending, and the one after the stay's last.
    uav
        Position and velocity of the UAV, ``(n, 3)`` m and m/s.
    system
        The system of the scheme, with the settings of its filter.
    """
    position, velocity = uav
    cones = []
    for start, stop in zip(starts, [*starts, end - 1][1:], strict=True):
        if not (np.diagonal(cov[start]) > 0).all():
            continue
        here = mean[None, start, None], cov[None, start, None]
        most = min(stop - start, MOST_SLOTS)
        ahead = list(forecasts(*here, np.array([start]), most, velocity, system))
        states = np.stack([mean[start], *(one.mean[0, 0] for one in ahead)])
        covs = np.stack([cov[start], *(one.cov[0, 0] for one in ahead)])
        slots = np.arange(start, start + len(states))
        centres = position[slots, 0] + offset(states)[:, 0]
        cones.append(Cone(slots, centres, np.sqrt(offset_cov(states, covs)[:, 0, 0])))
    return cones


def forecast_errors(
    result: xr.Dataset, scenario: Scenario, made_in: range | None = None
) -> xr.Dataset:
    """Return errors of forecasts from the posteriors of some slots, per scheme and horizon.

    A forecast counts where the object was known when it was made and the same object is there
    until it falls due. A scheme that predicts nothing makes none, nor does one without doubt (a
    genie).

    Parameters
    ----------
    result
        A result, or some of its trials and successive slots.
    scenario
        What was run.
    made_in
        Slots, counted as in the result; horizons then end where the last of them meets the
        result's end, so that every horizon has the same forecasts. All slots by default.

    Returns
    -------
    xarray.Dataset
        ``rmse`` and ``promised`` (scheme, horizon, quantity): root mean square of the errors and
        of the standard deviations that the filter promised; ``inside``: share of errors within
        the region that should hold 0.9973 of them (three standard deviations of a component);
        ``degrees``: of freedom of the mean square error if the promise is kept, those of one
        track's forecasts counted once because they hang together; ``count`` (scheme, horizon).
    """
    import xarray as xr

    slots = result["slot"].values
    uav_velocity = result["uav_velocity"].transpose("slot", "axis").values
    origins = np.asarray(slots[:-1] if made_in is None else made_in, dtype=np.int64) - 1
    reach = len(slots) - 1 if made_in is None else int(slots[-1]) - made_in[-1]
    most = min(MOST_SLOTS, reach)
    on_ground = scenario.geometry == "ground"
    quantities = ON_GROUND if on_ground else QUANTITIES
    shape = (result.sizes["scheme"], most, len(quantities))
    sums = {name: np.zeros(shape) for name in ("square", "variance", "inside", "fourth", "count")}
    for scheme, part in _predicting(result):
        truth = np.where(
            part["present"].values.astype(bool)[..., None], part["truth"].values, np.nan
        )
        cov = part["estimated_cov"].values
        doubtful = (np.diagonal(cov, axis1=-2, axis2=-1) > 0).all(axis=-1, keepdims=True)
        mean = np.where(doubtful, part["estimated"].values, np.nan)
        identity = np.where(part["present"].values.astype(bool), part["identity"].values, NOBODY)
        system = system_for(scenario, str(result["scheme"].values[scheme]))
        examined = _examine(
            (truth, mean, cov), identity, origins - int(slots[0]) + 1, most, uav_velocity, system
        )
        for horizon, found in examined:
            for name, value in found.items():
                sums[name][scheme, horizon - 1] += value
    count = np.where(sums["count"] > 0, sums["count"], np.nan)
    dims = ("scheme", "horizon", "quantity")
    fourth = np.where(sums["fourth"] > 0, sums["fourth"], np.nan)
    units = {"units": "m, m/s" if on_ground else "rad, m, m/s, m"}
    data = {
        "rmse": (dims, np.sqrt(sums["square"] / count), units),
        "promised": (dims, np.sqrt(sums["variance"] / count), units),
        "inside": (dims, sums["inside"] / count, {"units": "1"}),
        "degrees": (dims, sums["variance"] ** 2 / fourth, {"units": "1"}),
        "count": (dims[:2], sums["count"][..., 0], {"units": "1"}),
    }
    coords = {
        "scheme": result["scheme"].values,
        "horizon": np.arange(1, most + 1),
        "quantity": list(quantities),
    }
    return xr.Dataset(data, coords)


def _predicting(result: xr.Dataset) -> Iterator[tuple[int, xr.Dataset]]:
    """Yield number and trials of every scheme that predicts, some trials at a time."""
    order = ("trial", "slot", "object", "state", "state_b")
    for scheme in range(result.sizes["scheme"]):
        one = result[["truth", "present", "identity", "predicted", "estimated", "estimated_cov"]]
        one = one.isel(scheme=scheme)
        if not np.isfinite(one["predicted"].isel(trial=0).values).any():
            continue
        for first in range(0, result.sizes["trial"], CHUNK):
            part = one.isel(trial=slice(first, first + CHUNK))
            yield scheme, part.transpose(*order)


def _examine(
    states: tuple[Array, Array, Array],
    identity: IntArray,
    at: IntArray,
    most: int,
    uav_velocity: Array,
    system: System,
) -> Iterator[tuple[int, dict[str, Array]]]:
    """Yield, per horizon, sums ``(quantity,)`` over the forecasts of truth, mean and covariance."""
    truth, mean, cov = states
    changes = ~same_object(identity)
    gone = np.cumsum(np.concatenate([np.zeros_like(changes[:, :1]), changes], axis=1), axis=1)
    for one in forecasts(mean[:, at], cov[:, at], at, most, uav_velocity, system):
        began = at[: one.mean.shape[1]]
        due = began + one.horizon
        compare = _compare if system.geometry.axes == 1 else _compare_on_ground
        square, variance, inside = compare(one, truth[:, due])
        stayed = (gone[:, due] == gone[:, began])[..., None]
        sound = np.isfinite(square) & (variance > 0)
        counted = stayed & sound.all(axis=-1, keepdims=True)
        per_track = np.where(counted, variance, 0.0).sum(axis=1)
        yield (
            one.horizon,
            {
                "square": np.where(counted, square, 0.0).sum(axis=(0, 1, 2)),
                "variance": per_track.sum(axis=(0, 1)),
                "fourth": (per_track**2).sum(axis=(0, 1)),
                "inside": (counted & inside).sum(axis=(0, 1, 2)),
                "count": np.broadcast_to(counted, square.shape).sum(axis=(0, 1, 2)),
            },
        )


def _compare(forecast: Forecast, truth: Array) -> tuple[Array, Array, BoolArray]:
    """Return squared errors, promised variances, and which are inside, ``(..., quantity)``."""
    error = forecast.mean - truth
    error[..., 0] = wrap(error[..., 0])
    variance = np.diagonal(forecast.cov, axis1=-2, axis2=-1)
    off = offset(forecast.mean) - offset(truth)
    spread = offset_cov(forecast.mean, forecast.cov)
    length, wide, inside = _compare_vectors(off, spread)
    square = np.concatenate([error**2, length[..., None]], axis=-1)
    total = np.concatenate([variance, wide[..., None]], axis=-1)
    within = np.concatenate([error**2 <= SIGMAS**2 * variance, inside[..., None]], axis=-1)
    return square, total, within


def _compare_on_ground(forecast: Forecast, truth: Array) -> tuple[Array, Array, BoolArray]:
    """Return the same of the vectors of position and velocity, ``(..., quantity)``."""
    error = forecast.mean - truth
    parts = [
        _compare_vectors(error[..., pair], forecast.cov[..., pair, pair])
        for pair in (slice(0, 2), slice(2, 4))
    ]
    square, variance, within = (np.stack(each, axis=-1) for each in zip(*parts, strict=True))
    return square, variance, within.astype(np.bool_)


def _compare_vectors(off: Array, cov: Array) -> tuple[Array, Array, BoolArray]:
    """Return squared lengths, traces of covariances, and which are inside, of vectors ``(..., 2)``.

    Inside: (x, y) C^-1 (x, y)^T <= r^2, where r holds as much of a plane as 3 of a line.
    """
    x, y = off[..., 0], off[..., 1]
    xx, xy, yy = cov[..., 0, 0], cov[..., 0, 1], cov[..., 1, 1]
    inside: BoolArray = yy * x**2 - 2.0 * xy * x * y + xx * y**2 <= plane_sigmas() ** 2 * (
        xx * yy - xy**2
    )
    return x**2 + y**2, xx + yy, inside


def plane_sigmas(sigmas: float = SIGMAS) -> float:
    """Return the radius that holds as much of a Gaussian in the plane as +-``sigmas`` of a line."""
    from scipy.special import erfc

    return float(np.sqrt(-2.0 * np.log(erfc(sigmas / np.sqrt(2.0)))))


def same_object(identity: IntArray) -> BoolArray:
    """Return whether a column holds the same object in a slot and in the next.

    Parameters
    ----------
    identity
        ``(..., n, K)``; an empty column is no object.

    Returns
    -------
    BoolArray
        ``(..., n - 1, K)``.
    """
    same: BoolArray = (np.diff(identity, axis=-2) == 0) & (identity[..., 1:, :] != NOBODY)
    return same
