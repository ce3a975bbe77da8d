"""Physics and filter with plain numbers in place of arrays, flights and models.

Tests compare numbers; these calls put them into the objects that the package works with.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from echobeam.beamforming import subspace
from echobeam.physics import bounds, echo, link
from echobeam.physics.angles import exact_cosine, exact_sine
from echobeam.physics.array import LinearArray
from echobeam.physics.geometry import polar_state
from echobeam.physics.motion import Flight, move_along_road
from echobeam.physics.polar import POLAR
from echobeam.tracking import filter as ekf
from echobeam.tracking import initial
from echobeam.tracking.polar import PolarMeasurement, PolarMotion
from echobeam.values import GaussianState, Transmission, UavState


def flying(speed: float, heading: float, height: float = 100.0) -> UavState:
    """A UAV at some speed, and angle above the horizontal."""
    velocity = [speed * float(exact_cosine(heading)), 0.0, speed * float(exact_sine(heading))]
    return UavState(np.array([0.0, 0.0, height]), np.array(velocity))


class Echo(NamedTuple):
    """A measurement and its variance."""

    value: np.ndarray
    variance: np.ndarray


def predict(state: Any, uav: UavState, dt: float, std: Any, kind: Any = "paper") -> GaussianState:
    return ekf.predict(state, PolarMotion(dt, *std, kind), uav)


def update(prior: GaussianState, radar: Echo, uav: UavState, carrier: float) -> GaussianState:
    model = PolarMeasurement(carrier)
    return ekf.update(prior, radar.value, radar.variance, model, uav, POLAR).state


def initial_state(
    radar: Echo, uav: UavState, carrier: float, velocity_std: float | None = None
) -> GaussianState:
    return initial.initial_state(
        radar.value, radar.variance, PolarMeasurement(carrier), uav, velocity_std
    )


class Path(NamedTuple):
    """A flight as arrays over its slots."""

    height: np.ndarray
    x: np.ndarray
    speed: np.ndarray
    heading: np.ndarray


def uav_path(
    height: float, speed: float, heading: float, dt: float, n: int, floor: float = 1.0
) -> Path:
    slots = [Flight(height, speed, heading, dt, floor).at(slot) for slot in range(n)]
    return Path(
        np.array([uav.position[2] for uav in slots]),
        np.array([uav.position[0] for uav in slots]),
        np.array([uav.speed for uav in slots]),
        np.array([uav.heading for uav in slots]),
    )


def _moved(theta, d, v, acceleration, speed, heading, dt):  # type: ignore[no-untyped-def]
    uav = Flight(d * float(exact_sine(theta)), speed, heading, dt, 0.0).at(1)
    x, faster = move_along_road(d * float(exact_cosine(theta)), v, acceleration, dt)
    place = np.array([float(x), 0.0, 0.0])
    return tuple(polar_state(place, np.array([float(faster), 0.0, 0.0]), uav))


def move_object(theta, d, v, acceleration, speed, heading, dt):  # type: ignore[no-untyped-def]
    """An object's angle, distance and velocity one slot later, in ground coordinates between."""
    many = np.vectorize(_moved, otypes=[float, float, float])
    return many(theta, d, v, acceleration, speed, heading, dt)


def channel(theta, d, n, *, wavelength, alpha0=1.0, spacing=0.5, axis="vertical"):  # type: ignore[no-untyped-def]
    array = LinearArray(n, spacing, axis)
    return link.channel(theta, d, array, wavelength=wavelength, alpha0=alpha0)


def _array(sent: Transmission, spacing: float = 0.5, axis: Any = "vertical") -> LinearArray:
    return LinearArray(sent.beams.shape[-1], spacing, axis)


def sinr(sent, theta, d, *, noise, alpha0=1.0, spacing=0.5, axis="vertical"):  # type: ignore[no-untyped-def]
    own = np.eye(np.shape(theta)[-1], dtype=bool)
    loss = link.channel_loss(d, noise, alpha0)
    return link.sinr(sent, own, theta, loss, _array(sent, spacing, axis))


def stream_gains(sent, theta, spacing=0.5, axis="vertical"):  # type: ignore[no-untyped-def]
    return link.stream_gains(sent, theta, _array(sent, spacing, axis))


def illumination(sent, theta, spacing=0.5, axis="vertical"):  # type: ignore[no-untyped-def]
    return echo.illumination(sent, theta, _array(sent, spacing, axis))


def echo_snr(sent, theta, d, *, rcs, gain, noise, spacing=0.5, axis="vertical"):  # type: ignore[no-untyped-def]
    array = _array(sent, spacing, axis)
    return echo.echo_snr(sent, theta, d, array, rcs=rcs, gain=gain, noise=noise)


def measurement_variance(  # type: ignore[no-untyped-def]
    sent, theta, snr, *, crb, n_rx, bandwidth, pulse_length, spacing=0.5, axis="vertical"
):
    return bounds.measurement_variance(
        sent,
        theta,
        snr,
        _array(sent, spacing, axis),
        LinearArray(n_rx, spacing, axis),
        crb=crb,
        bandwidth=bandwidth,
        pulse_length=pulse_length,
    )


def square_aperture(theta, n, spacing=0.5, axis="vertical"):  # type: ignore[no-untyped-def]
    return bounds.square_aperture(theta, LinearArray(n, spacing, axis))


def transmit_aperture(sent, theta, spacing=0.5, axis="vertical"):  # type: ignore[no-untyped-def]
    return bounds.transmit_aperture(sent, theta, _array(sent, spacing, axis))


def real_steering(phases: npt.ArrayLike, n_tx: int) -> np.ndarray:
    """Real steering vectors of a linear array, by the phase step between its elements."""
    return subspace.real_steering(np.asarray(phases, dtype=float)[..., np.newaxis], (1, n_tx))
