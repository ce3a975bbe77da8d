"""Direction cosines from the signal of a planar array, against the exact bound."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.physics import transmission
from echobeam.physics.echo_signal import Scatterers, echo_signal, noise_of
from echobeam.physics.planar import PlanarArray
from echobeam.physics.planar_bounds import cosine_information, marginal_variance
from echobeam.physics.waveform import Waveform, factor, orthogonalised, symbols_of
from echobeam.sensing.chain import Processing, find_echoes, receiver_of
from echobeam.sensing.directions import search_grid
from echobeam.sensing.information import stated_variance
from echobeam.sensing.refine import refine
from echobeam.sensing.target import Point, at, rebuilt

EIGHT = PlanarArray(8, 8), PlanarArray(8, 8)
WAVE = Waveform(10e6, 2e-5, 32, 8)
PLACE = np.array([0.31, -0.22])
DELAY, DOPPLER = 1.03e-6, 2100.0


def received(db, omni, trials, seed=3, arrays=EIGHT, others=()):
    """Signals of one object at a total SNR, what the receiver knows, and the exact bound."""
    rng = np.random.default_rng(seed)
    if omni:
        sent = transmission.omni(np.zeros((1, 0), dtype=bool), 1.0, arrays[0].n)
    else:  # one stream in a beam that is off by a tenth of its width
        beam = arrays[0].steering(PLACE + np.array([0.01, -0.008])) / np.sqrt(arrays[0].n)
        sent = transmission.directional(beam[None, None])
    precoder = np.repeat(factor(sent)[0], trials, axis=0)
    shape = (trials, precoder.shape[-1], WAVE.subcarriers, WAVE.symbols, 2)
    streams = symbols_of(WAVE, rng.standard_normal(shape))
    streams = orthogonalised(streams) if omni else streams
    places = np.array([PLACE, *(place for place, _, _ in others)])
    scatterers = Scatterers(
        np.broadcast_to(places, (trials, *places.shape)),
        np.broadcast_to([DELAY, *(delay for _, delay, _ in others)], (trials, len(places))),
        np.broadcast_to([DOPPLER, *(shift for _, _, shift in others)], (trials, len(places))),
        np.exp(2j * np.pi * rng.random((trials, len(places)))),
    )
    clean = echo_signal(scatterers, streams, precoder, WAVE, arrays)
    first = Scatterers(*(one[:, :1] for one in scatterers))
    energy = np.sum(np.abs(echo_signal(first, streams, precoder, WAVE, arrays)) ** 2)
    noise = energy / trials / 10.0 ** (db / 10.0)
    signal = clean + noise_of(rng.standard_normal((*clean.shape, 2)), noise)
    known = receiver_of(arrays, WAVE, streams, precoder, noise)
    # 2 SNR N_r (Xi_r + Xi_t), and SNR N_r is the total one
    information = cosine_information(sent, places[None], *arrays)
    bound = marginal_variance(np.full((1, len(places)), 2.0 * 10.0 ** (db / 10.0)), information)[0]
    return signal, known, bound


def check_on_bound(error, bound):
    """RMSE over the bound's root between 1 and 1.05, three standard errors wide on either side."""
    ratio = np.sqrt(np.mean(error**2) / np.mean(bound))
    slack = 3.0 / np.sqrt(2.0 * error.size)
    assert 1.0 - slack < ratio < 1.05 + slack


@pytest.mark.slow
@pytest.mark.parametrize("omni", [False, True])
@pytest.mark.parametrize("angle", ["glrt", "capon"])
def test_the_chain_is_on_the_exact_bound(omni, angle):
    """Delay and Doppler unknown, too: from 18 dB of total SNR up, no outliers."""
    processing = Processing(angle=angle, false_alarm=1e-3)
    signal, known, bound = received(18.0, omni, 120)
    found = find_echoes(signal, known, 1, processing)
    assert found.valid.all()
    check_on_bound(found.angle[:, 0] - PLACE, bound[0])


@pytest.mark.parametrize("omni", [False, True])
@pytest.mark.slow
def test_directions_alone_are_on_the_bound_from_15_db(omni):
    """With delay and Doppler known the search is over directions only, as for a linear array."""
    trials = 80
    signal, known, bound = received(15.0, omni, trials)
    flat = signal.reshape(trials, signal.shape[1], -1)
    delay, doppler = np.full(trials, DELAY), np.full(trials, DOPPLER)
    grid = search_grid(*EIGHT)
    statistic = np.stack(
        [at(flat, np.tile(u, (trials, 1)), delay, doppler, known).statistic for u in grid]
    )
    start = at(flat, grid[np.argmax(statistic, axis=0)], delay, doppler, known)
    check_on_bound(refine(flat, start, known).u - PLACE, bound[0])


@pytest.mark.parametrize("shape", [(3, 4), (1, 5)])
def test_the_stated_variance_is_that_of_the_differentiated_signal(shape):
    """Two echoes: Fisher matrix of the sampled signal by central differences, inverted whole."""
    arrays = PlanarArray(*shape), PlanarArray(4, 3)
    _, known, _ = received(10.0, True, 1, arrays=arrays)
    theta = np.array([0.3, -0.2, 1.0e-6, 900.0, 0.3, -0.2, 0.42, 0.1, 1.2e-6, 2500.0, 0.1, 0.4])
    step = np.tile([1e-6, 1e-6, 1e-13, 1e-3, 1e-6, 1e-6], 2)
    ones = np.ones(1)

    def point(v):
        return Point(v[None, :2], v[2] * ones, v[3] * ones, (v[4] + 1j * v[5]) * ones, ones)

    def signal(v):
        return sum(rebuilt(point(v[i : i + 6]), known) for i in (0, 6)).ravel()

    d = np.stack(
        [(signal(theta + h) - signal(theta - h)) / (2 * h.sum()) for h in np.diag(step)], axis=-1
    )
    scale = np.tile([1.0, 1.0, 1e-7, 1e4, 1.0, 1.0], 2)
    information = 2.0 / known.noise * np.real(np.conj(d * scale).T @ (d * scale))
    expected = (np.diagonal(np.linalg.inv(information)) * scale**2).reshape(2, 6)[:, :4]
    points = [point(theta[i : i + 6]) for i in (0, 6)]
    found = stated_variance(points, [np.ones(1, dtype=bool)] * 2, known)[0]
    stated = np.isfinite(found).all(axis=-1)
    np.testing.assert_allclose(found[stated], expected[stated], rtol=1e-5)
    cells = expected * np.square([2.0, 1.5, WAVE.bandwidth, WAVE.duration])
    np.testing.assert_array_equal(stated, (cells <= 0.04).all(axis=-1))


@pytest.mark.slow
def test_two_echoes_are_told_apart_and_close_ones_refined_together():
    far = (np.array([-0.4, 0.3]), 2.2e-6, -3000.0)
    near = (PLACE + np.array([0.3, 0.0]), DELAY + 0.4 / WAVE.bandwidth, DOPPLER)
    for other in (far, near):
        signal, known, _ = received(30.0, True, 6, others=[other])
        found = find_echoes(signal, known, 2, Processing(false_alarm=1e-3))
        assert found.valid.all()
        order = np.argsort(np.abs(found.angle - PLACE).sum(axis=-1), axis=1)
        for column, place in enumerate((PLACE, other[0])):
            u = np.take_along_axis(found.angle, order[..., None], axis=1)[:, column]
            variance = np.take_along_axis(found.variance, order[..., None], axis=1)[:, column, :2]
            assert (np.abs(u - place) < 5.0 * np.sqrt(variance)).all()


def test_the_search_covers_the_visible_disc():
    grid = search_grid(*EIGHT)
    assert (np.hypot(*grid.T) <= 1.0 + 1e-12).all()
    rng = np.random.default_rng(5)
    points = rng.uniform(-1.0, 1.0, (500, 2))
    points = points[np.hypot(*points.T) <= 1.0]
    nearest = np.abs(points[:, None] - grid).max(axis=-1).min(axis=-1)
    assert nearest.max() < 0.5 * 2.0 / 8 + 0.02  # within half of a beam's half-width


def test_a_step_stays_where_there_is_something_to_see():
    """A start beyond the horizon ends at its edge."""
    signal, known, _ = received(20.0, True, 4)
    flat = signal.reshape(4, signal.shape[1], -1)
    start = at(flat, np.tile([0.8, 0.6], (4, 1)), np.full(4, DELAY), np.full(4, DOPPLER), known)
    found = refine(flat, start, known)
    assert (np.hypot(*found.u.T) <= 1.0 + 1e-12).all()
