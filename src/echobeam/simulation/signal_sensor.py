"""Radar of a run whose receiver processes the echo signal: nature's part and the receiver's.

Nature makes the signal of all objects, of the ground and of the UAV's own transmitter, and adds
noise. The receiver finds echoes in it and states their variances. In a labelled run somebody says
whose an echo is: the truth gives the label, which object within a resolution cell it is, and the
side of the UAV that a vertical array cannot see, and nothing else. An echo that is missed or far
off is no measurement.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from echobeam.physics.array import LinearArray
from echobeam.physics.background import POINTS
from echobeam.physics.coordinates import direction_of, distance_of
from echobeam.physics.echo import reflection_coefficient
from echobeam.physics.echo_signal import Scatterers, echo_signal, noise_of
from echobeam.physics.measurement import measure
from echobeam.physics.planar import AntennaArray
from echobeam.physics.waveform import factor, orthogonalised, symbols_of
from echobeam.scenario.tables import RadarTable
from echobeam.sensing.chain import Echo, Processing, find_echoes, receiver_of
from echobeam.sensing.directions import beam_sizes, mirrored
from echobeam.sensing.threads import one_thread
from echobeam.simulation.background import background
from echobeam.simulation.grid import element_noise, waveform_of
from echobeam.simulation.randomness import Use, trial_normals
from echobeam.simulation.world import World
from echobeam.values import Array, BoolArray, ComplexArray, Transmission

SAMPLES_AT_ONCE = 1 << 20
"""Samples of all antennas in memory together, for as many trials as they are enough; 16 MB for each
of some ten arrays."""

SPARE = 2
"""Echoes that are looked for beyond the objects where the ground or the transmitter echoes too."""

MOST_ECHOES = 8
"""Echoes that are looked for where nobody says how many objects there are."""

PATCHES, PATCH = 150, 2.0
"""Patches of ground along the road below the UAV, and their length, m."""

GATE = 1.5
"""Resolution cells of delay, Doppler and direction within which an echo is an object's."""

UNRESOLVED = 0.6
"""Resolution cells below which two objects have no echoes of their own."""


def trials_at_once(radar: RadarTable, antennas: int) -> int:
    """Return for how many trials the signals are in memory together."""
    return max(1, SAMPLES_AT_ONCE // (antennas * radar.subcarriers * radar.symbols))


def measure_signal(
    world: World, sent: Transmission, amplitude: ComplexArray, processed: BoolArray
) -> tuple[Array, Array]:
    """Return the measurements and the variances that the receiver states, ``(T, K, A + 2)`` each.

    NaN and infinite where an object was not processed or its echo was missed.

    Parameters
    ----------
    world
        Nature.
    sent
        ``(T, C, N)`` inside.
    amplitude
        ``(T or 1, K)``: fluctuation of the echoes.
    processed
        ``(T, K)``: objects whose echoes are measured.
    """
    shape = (*processed.shape, len(world.scene.geometry.measurement))
    value, variance = np.full(shape, np.nan), np.full(shape, np.inf)
    if not processed.any():
        return value, variance
    count = int(world.present.sum()) + _further_echoes(world.scene.scenario.radar)
    for some, found, truth in _in_parts(world, sent, amplitude, count):
        value[some], variance[some] = _labelled(world, found, truth, processed[some])
    return value, variance


def detect_in_signal(
    world: World, sent: Transmission, amplitude: ComplexArray, receives: BoolArray
) -> tuple[Echo, Array, Array]:
    """Return all echoes found, ``(T, D)``, and for the record those of the objects.

    How many are looked for does not depend on how many objects there are.

    Parameters
    ----------
    world, sent, amplitude
        As in `measure_signal`.
    receives
        ``(T,)``: whether the radar receives.

    Returns
    -------
    found, value, variance
        The echoes; each object's, NaN and infinite where it has none, ``(T, K, A + 2)``.
    """
    trials, size = len(world.trials), len(world.scene.geometry.measurement)
    shape = (trials, world.identity.size, size)
    value, variance = np.full(shape, np.nan), np.full(shape, np.inf)
    if not receives.any():
        none, nothing = np.zeros((trials, 0)), np.zeros((trials, 0), dtype=np.bool_)
        angle = none if size == 3 else np.zeros((trials, 0, size - 2))
        return Echo(angle, none, none, none, nothing, np.zeros((trials, 0, size))), value, variance
    parts: list[Echo] = []
    for some, found, truth in _in_parts(world, sent, amplitude, MOST_ECHOES):
        parts.append(found)
        processed = world.present & receives[some, None]
        value[some], variance[some] = _labelled(world, found, truth, processed)
    return Echo(*(np.concatenate(one) for one in zip(*parts, strict=True))), value, variance


def _in_parts(
    world: World, sent: Transmission, amplitude: ComplexArray, count: int
) -> Iterator[tuple[slice, Echo, Array]]:
    """Yield some trials at a time: which, the echoes found, the objects' ideal measurements."""
    trials, objects = len(world.trials), world.identity.size
    law, seen = world.scene.law, world.ideal()
    ideal = np.broadcast_to(seen, (trials, objects, seen.shape[-1]))
    far = distance_of(world.place, law.transmitter.axes)
    distance = np.broadcast_to(far, (trials, objects))
    if law.target is not None:
        amplitude = amplitude * np.sqrt(np.nan_to_num(law.target.relative(world.place)))
    spread = np.broadcast_to(amplitude, (trials, objects))
    step = trials_at_once(world.scene.scenario.radar, max(law.receiver.n, law.transmitter.n))
    for first in range(0, trials, step):
        some = slice(first, first + step)
        with one_thread():
            part = _part(sent, some)
            beta = reflection_coefficient(law.rcs, distance[some]) * spread[some]
            found = _of_some(world, part, ideal[some], np.nan_to_num(beta), some, count)
        yield some, found, ideal[some]


def _has_clutter(radar: RadarTable) -> bool:
    return radar.ground_clutter > 0.0 or radar.self_interference > 0.0


def _further_echoes(radar: RadarTable) -> int:
    """Return how many echoes are looked for beyond those of the objects."""
    return SPARE * _has_clutter(radar) + POINTS * (radar.background != "none")


def _part(sent: Transmission, trials: slice) -> Transmission:
    return Transmission(sent.beams[trials], sent.antenna_power[trials], sent.probing[trials])


def _of_some(
    world: World,
    sent: Transmission,
    ideal: Array,
    amplitude: ComplexArray,
    some: slice,
    count: int,
) -> Echo:
    """Return the echoes found in some trials, of objects with these ideal measurements."""
    radar, radio = world.scene.scenario.radar, world.scene.scenario.radio
    law, wave = world.scene.law, waveform_of(radar)
    arrays, trials = (law.transmitter, law.receiver), world.trials[some]
    precoder, orthogonal = factor(sent)
    shape = (precoder.shape[-1], wave.subcarriers, wave.symbols, 2)
    draws = (world.seed, trials, world.slot)
    streams = symbols_of(wave, trial_normals(*draws, Use.DATA, shape))
    if orthogonal:
        streams = orthogonalised(streams)
    delay, doppler = ideal[..., -2], ideal[..., -1]
    beta = amplitude * np.exp(-2j * np.pi * radio.carrier * np.nan_to_num(delay))
    parts = [Scatterers(direction_of(ideal, law.receiver.axes), delay, doppler, beta)]
    parts += _surroundings(world, trials)
    scatterers = Scatterers(*(np.concatenate(one, axis=1) for one in zip(*parts, strict=True)))
    signal = echo_signal(scatterers, streams, precoder, wave, arrays)
    noise = element_noise(radar)
    size = (law.receiver.n, wave.subcarriers, wave.symbols, 2)
    signal = signal + noise_of(trial_normals(*draws, Use.NOISE, size), noise)
    known = receiver_of(arrays, wave, streams, precoder, noise)
    processing = Processing(radar.filter, radar.cfar, radar.false_alarm, radar.angle)
    return find_echoes(signal, known, count, processing)


def _surroundings(world: World, trials: range) -> list[Scatterers]:
    """Return all that echoes besides the objects, as far as it is asked for."""
    radar = world.scene.scenario.radar
    found = _clutter(world, trials) if _has_clutter(radar) else []
    return found if radar.background == "none" else [*found, background(world, trials)]


def _clutter(world: World, trials: range) -> list[Scatterers]:
    """Return the patches of ground and the UAV's own transmitter as scatterers."""
    radar, scenario = world.scene.scenario.radar, world.scene.scenario
    normals = trial_normals(world.seed, trials, world.slot, Use.SURROUNDINGS, (PATCHES + 1, 2))
    drawn = (normals[..., 0] + 1j * normals[..., 1]) / np.sqrt(2.0)
    height = float(world.uav.position[2])
    along = PATCH * (np.arange(PATCHES) - 0.5 * (PATCHES - 1))
    angle = np.broadcast_to(np.arctan2(height, along), (len(trials), PATCHES))
    distance = np.broadcast_to(np.hypot(height, along), (len(trials), PATCHES))
    seen = measure(
        angle, distance, np.zeros(1), world.uav.speed, world.uav.heading, scenario.radio.carrier
    )
    ground = drawn[:, :PATCHES] * np.sqrt(radar.ground_clutter * PATCH) / distance**2
    own = drawn[:, PATCHES:] * np.sqrt(
        radar.self_interference * element_noise(radar) / scenario.radio.power
    )
    still = np.zeros((len(trials), 1))
    return [
        Scatterers(seen[..., 0], seen[..., 1], seen[..., 2], ground),
        Scatterers(np.full((len(trials), 1), 0.5 * np.pi), still, still, own),
    ]


def _labelled(world: World, found: Echo, truth: Array, processed: BoolArray) -> tuple[Array, Array]:
    """Return each object's echo and its stated variance: nearest pairs first, within a cell."""
    wave, receiver = waveform_of(world.scene.scenario.radar), world.scene.law.receiver
    size, units = beam_sizes(receiver), [wave.bandwidth, wave.duration]
    u = _cosines(receiver, direction_of(truth, receiver.axes))
    seen = _cosines(receiver, found.angle)
    off = np.stack(
        [
            (found.delay[:, None] - truth[..., None, -2]) * wave.bandwidth,
            (found.doppler[:, None] - truth[..., None, -1]) * wave.duration,
            *np.moveaxis((seen[:, None] - u[:, :, None]) * size, -1, 0),
        ]
    )
    inside = (np.abs(off) <= GATE).all(axis=0) & processed[..., None] & found.valid[:, None]
    cost = np.where(inside, np.sum(off**2, axis=0), np.inf)  # (T, K, D)
    value = np.full(truth.shape, np.nan)
    variance = np.full(truth.shape, np.inf)
    rows = np.arange(len(cost))
    for _ in range(min(cost.shape[1:])):
        flat = cost.reshape(len(cost), -1)
        k, d = np.unravel_index(np.argmin(flat, axis=-1), cost.shape[1:])
        taken = np.isfinite(flat.min(axis=-1))
        angle = found.angle[rows, d]
        if isinstance(receiver, LinearArray):
            angle = mirrored(receiver, angle, truth[rows, k, 0])[:, None]
        others = np.stack([found.delay[rows, d], found.doppler[rows, d]], axis=-1)
        measured = np.concatenate([angle, others], axis=-1)
        value[rows[taken], k[taken]] = measured[taken]
        variance[rows[taken], k[taken]] = found.variance[rows[taken], d[taken]]
        cost[rows, k, :] = np.inf
        cost[rows, :, d] = np.inf
    places = np.concatenate([u * size, truth[..., -2:] * units], axis=-1)
    merged = _merged(places, np.isnan(value[..., 0]))
    value = np.where(np.isfinite(variance) & ~merged[..., None], value, np.nan)
    return value, np.where(np.isfinite(value), variance, np.inf)


def _cosines(receiver: AntennaArray, direction: Array) -> Array:
    """Return directions as the array sees them, ``(..., A)``."""
    if isinstance(receiver, LinearArray):
        return receiver.frequency(direction)[..., None]
    return direction


def _merged(places: Array, unseen: BoolArray) -> BoolArray:
    """Return which objects ``(T, K)`` share their echo with another one.

    They are in one cell, and the other has no echo of its own, or they are nearly at one place.
    Somebody who says whose an echo is says so: it measures neither.

    Parameters
    ----------
    places
        ``(T, K, A + 2)``: direction, delay and Doppler in resolution cells.
    unseen
        ``(T, K)``: objects without an echo.
    """
    apart = np.abs(places[..., :, None, :] - places[..., None, :, :]).max(axis=-1)
    apart = np.where(np.eye(apart.shape[-1], dtype=np.bool_), np.inf, apart)
    alone = unseen[..., None, :]
    merged: BoolArray = np.any((apart < UNRESOLVED) | ((apart < 1.0) & alone), axis=-1)
    return merged
