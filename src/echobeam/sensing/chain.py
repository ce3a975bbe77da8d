"""Chain of the receiver: echoes found one after the other, strongest first, and refined together.

The map over delay, Doppler and angle holds in every cell the likelihood ratio of a point target
against noise. Its maximum is compared with the cells around (`cfar`), refined (`refine`) and
subtracted; the next maximum is the next echo. Then each echo is refined once more with the others
subtracted, so that close ones do not bend each other.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np

from echobeam.physics.array import LinearArray
from echobeam.physics.planar import AntennaArray
from echobeam.physics.waveform import Waveform
from echobeam.sensing.capon import capon_direction, covariance
from echobeam.sensing.cfar import Cfar, noise_level, threshold_factor, training_cells
from echobeam.sensing.compression import Filter, cell_places, delay_doppler_map, weights
from echobeam.sensing.directions import angle_of, beam_sizes, search_grid, steering
from echobeam.sensing.information import stated_variance
from echobeam.sensing.refine import refine
from echobeam.sensing.target import Point, Receiver, at, rebuilt, replica
from echobeam.sensing.together import refine_together
from echobeam.values import Array, BoolArray, ComplexArray, IntArray

PADDING = (2, 2)
"""Cells of the map per resolution cell of delay and Doppler: Newton's steps do the rest."""

TRAINING, GUARD = 12, 2
"""Training and guard cells on either side along the delay."""

_CELLS = 1 << 22
"""Cells of the map in memory at once."""

_CLOSE = 3.0
"""Resolution cells of delay, Doppler and direction within which echoes are refined jointly."""

_SNAPSHOTS = 2
"""Snapshots of Capon's covariance for each antenna."""


@dataclass(frozen=True, slots=True)
class Processing:
    """Choices of the receiver.

    Attributes
    ----------
    filter
        Weights of the resource elements in the map.
    cfar, false_alarm
        Level of the noise, and the probability that a cell of noise exceeds the threshold.
    angle
        Estimator of the angle: the likelihood, or Capon's spectrum on the receive array.
    """

    filter: Filter = "matched"
    cfar: Cfar = "cell-averaging"
    false_alarm: float = 1e-6
    angle: Literal["glrt", "capon"] = "glrt"


class Echo(NamedTuple):
    """Echoes found, ``(T, D)`` each, strongest first as they were found.

    Attributes
    ----------
    angle, delay, doppler
        rad, s, Hz; of a vertical array the angle below 90 degrees. Of a planar array the direction
        cosines ``(T, D, 2)`` take the angle's place.
    snr
        Likelihood ratio less one: SNR after all integration, over all antennas.
    valid
        Whether the echo passed the threshold.
    variance
        ``(T, D, A + 2)`` rad^2, s^2, Hz^2: the Cramer-Rao bound of all echoes together, at the
        estimates.
    """

    angle: Array
    delay: Array
    doppler: Array
    snr: Array
    valid: BoolArray
    variance: Array


def receiver_of(
    arrays: tuple[AntennaArray, AntennaArray],
    waveform: Waveform,
    streams: ComplexArray,
    precoder: ComplexArray,
    noise: float,
) -> Receiver:
    """Return what a receiver knows of a slot.

    Parameters
    ----------
    arrays
        Transmitter and receiver.
    waveform
        The grid.
    streams
        ``(T, L, N, M)``.
    precoder
        ``(T, N_t, L)``.
    noise
        Variance in one resource element of one antenna.
    """
    flat = streams.reshape(*streams.shape[:-2], -1)
    gram = flat @ np.conj(np.swapaxes(flat, -1, -2))
    return Receiver(*arrays, waveform, flat, precoder, gram, noise)


def find_echoes(signal: ComplexArray, known: Receiver, count: int, processing: Processing) -> Echo:
    """Return the strongest echoes of a slot.

    Parameters
    ----------
    signal
        ``(T, N_r, N, M)``.
    known
        The receiver.
    count
        D, echoes that are looked for.
    processing
        Choices.
    """
    flat = signal.reshape(*signal.shape[:-2], -1)
    points: list[Point] = []
    valid: list[BoolArray] = []
    rest = flat
    for _ in range(count):
        start, passed = _strongest(rest, known, processing)
        point = refine(rest, start, known)
        points.append(point)
        valid.append(passed)
        rest = rest - _where(passed, rebuilt(point, known))
    if count > 1:
        points = _each_alone(flat, points, valid, known)
        points = _close_together(flat, points, valid, known)
    if processing.angle == "capon":
        points = [
            _by_capon(_without_others(flat, points, valid, known, place), point, known)
            for place, point in enumerate(points)
        ]
    stacked = [np.stack(one, axis=1) for one in zip(*points, strict=True)]
    u, delay, doppler, _, statistic = stacked
    return Echo(
        _reported(known.receiver, u),
        delay,
        doppler,
        np.maximum(statistic - 1.0, 0.0),
        np.stack(valid, axis=-1),
        stated_variance(points, valid, known),
    )


def angle_by_capon(signal: ComplexArray, found: Echo, known: Receiver) -> Array:
    """Return the angles ``(T, D)`` of echoes that were found, by Capon's spectrum.

    Of a planar array the direction cosines, ``(T, D, 2)``.

    Parameters
    ----------
    signal
        ``(T, N_r, N, M)``.
    found
        The echoes, which give delay, Doppler and the direction of the search.
    known
        The receiver.
    """
    flat = signal.reshape(*signal.shape[:-2], -1)
    nothing, silent = np.zeros(len(flat)), np.zeros(len(flat), dtype=np.complex128)
    angles = []
    for place in range(found.delay.shape[-1]):
        u = found.angle[:, place]
        if isinstance(known.receiver, LinearArray):
            u = known.receiver.frequency(u)
        start = Point(u, found.delay[:, place], found.doppler[:, place], silent, nothing)
        angles.append(_reported(known.receiver, _by_capon(flat, start, known).u))
    return np.stack(angles, axis=1)


def _reported(array: AntennaArray, u: Array) -> Array:
    """Return the directions as they are measured: angles, or the cosines of a planar array."""
    return angle_of(array, u) if isinstance(array, LinearArray) else u


def _each_alone(
    signal: ComplexArray, points: list[Point], valid: list[BoolArray], known: Receiver
) -> list[Point]:
    """Return the points refined once more, each with the others subtracted."""
    refined = list(points)
    for place, point in enumerate(points):
        alone = _without_others(signal, refined, valid, known, place)
        refined[place] = refine(alone, point, known, rounds=4)
    return refined


def _without_others(
    signal: ComplexArray,
    points: list[Point],
    valid: list[BoolArray],
    known: Receiver,
    place: int,
) -> ComplexArray:
    """Return the signal less all echoes but one."""
    rest = signal
    for other, (point, passed) in enumerate(zip(points, valid, strict=True)):
        if other != place:
            rest = rest - _where(passed, rebuilt(point, known))
    return rest


def _close_together(
    signal: ComplexArray, points: list[Point], valid: list[BoolArray], known: Receiver
) -> list[Point]:
    """Return the points, in trials with echoes close to each other at their joint maximum."""
    wave, array = known.waveform, known.receiver
    if isinstance(array, LinearArray):
        along = [np.stack([p.u * array.n * array.spacing for p in points], axis=-1)]
    else:
        along = list(np.stack([(p.u * beam_sizes(array)).T for p in points], axis=-1))
    cells = np.stack(
        [
            *along,
            np.stack([p.delay * wave.bandwidth for p in points], axis=-1),
            np.stack([p.doppler * wave.duration for p in points], axis=-1),
        ]
    )
    passed = np.stack(valid, axis=-1)
    near = (np.abs(cells[..., :, None] - cells[..., None, :]) < _CLOSE).all(axis=0)
    near &= passed[:, :, None] & passed[:, None, :] & ~np.eye(len(points), dtype=np.bool_)
    trials = np.flatnonzero(near.any(axis=(-2, -1)))
    if not trials.size:
        return points
    joint = refine_together(
        signal[trials],
        [point.of(trials) for point in points],
        [one[trials] for one in valid],
        _some(known, trials),
    )
    return [point.replaced(trials, other) for point, other in zip(points, joint, strict=True)]


def _where(passed: BoolArray, signal: ComplexArray) -> ComplexArray:
    return np.where(passed[:, None, None], signal, 0.0)


def _strongest(
    signal: ComplexArray, known: Receiver, processing: Processing
) -> tuple[Point, BoolArray]:
    """Return the cell with the largest statistic, and whether it passes the threshold."""
    grid = search_grid(known.transmitter, known.receiver)
    wave = known.waveform
    per_trial = len(grid) * wave.elements * PADDING[0] * PADDING[1]
    block = max(1, _CELLS // per_trial)
    parts = [
        _search(signal[i : i + block], _some(known, slice(i, i + block)), grid, processing)
        for i in range(0, len(signal), block)
    ]
    u, delay, doppler, passed = (np.concatenate(one) for one in zip(*parts, strict=True))
    return at(signal, u, delay, doppler, known), passed.astype(bool)


def _some(known: Receiver, trials: slice | IntArray) -> Receiver:
    streams, precoder, gram = known.streams[trials], known.precoder[trials], known.gram[trials]
    return known._replace(streams=streams, precoder=precoder, gram=gram)


def _search(
    signal: ComplexArray, known: Receiver, grid: Array, processing: Processing
) -> tuple[Array, Array, Array, BoolArray]:
    """Return direction, delay and Doppler of each trial's largest cell, and if it passes."""
    wave, trials = known.waveform, len(signal)
    shape = (trials, len(grid), wave.subcarriers, wave.symbols)
    beamformed = np.conj(steering(known.receiver, grid)) @ signal
    mixture = np.conj(steering(known.transmitter, grid)) @ known.precoder
    lit = (mixture @ known.streams).reshape(shape)
    level = _noise_over_echo(signal, lit, known)
    weight = weights(lit, processing.filter, level)
    noise = known.noise * known.receiver.n
    cells = delay_doppler_map(beamformed.reshape(shape) * weight, weight, noise, PADDING)
    flat = cells.reshape(trials, -1)
    g, n, m = np.unravel_index(np.argmax(flat, axis=-1), cells.shape[1:])
    row = cells[np.arange(trials), g, :, m]  # along the delay
    around = training_cells(row, n, TRAINING, GUARD, PADDING[0])
    factor = threshold_factor(2 * TRAINING, processing.false_alarm, processing.cfar)
    passed = row[np.arange(trials), n] > factor * noise_level(around, processing.cfar)
    delays, shifts = cell_places(wave, PADDING)
    return grid[g], delays[n], shifts[m], passed


def _noise_over_echo(signal: ComplexArray, lit: ComplexArray, known: Receiver) -> Array:
    """Return the noise over the received power per unit of what was sent, for LMMSE."""
    received = np.mean(np.abs(signal) ** 2, axis=(-2, -1))
    echo = np.maximum(received - known.noise, 1e-3 * known.noise)
    sent = np.mean(np.abs(lit) ** 2, axis=(-2, -1))
    level: Array = known.noise * sent / echo[:, None]
    return level


def _by_capon(signal: ComplexArray, point: Point, known: Receiver) -> Point:
    """Return the point with the direction of Capon's spectrum."""
    wave = known.waveform
    phases = wave.phases(point.delay, point.doppler).reshape(len(signal), -1)
    turned = signal * np.conj(phases)[:, None, :]
    parts = min(_SNAPSHOTS * known.receiver.n, wave.elements)
    compressed = turned * np.conj(replica(point.u, known))[:, None, :]
    pieces = np.array_split(np.arange(wave.elements), parts)
    snapshots = np.stack([compressed[..., piece].sum(axis=-1) for piece in pieces], axis=-1)
    correlated = turned @ np.conj(np.swapaxes(known.streams, -1, -2))
    inverse = np.linalg.inv(covariance(snapshots)).astype(np.complex128)
    u = capon_direction(correlated, inverse, point.u, known)
    return at(signal, u, point.delay, point.doppler, known)
