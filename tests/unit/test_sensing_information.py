"""Bound of several echoes together: against differences of the signal, and against closed forms."""

from __future__ import annotations

import numpy as np

from echobeam.physics import transmission
from echobeam.physics.array import LinearArray
from echobeam.physics.bounds import measurement_variance
from echobeam.physics.waveform import Waveform, factor, orthogonalised, symbols_of
from echobeam.sensing.chain import receiver_of
from echobeam.sensing.information import stated_variance
from echobeam.sensing.target import Point, rebuilt

ARRAYS = (LinearArray(6), LinearArray(5))
WAVE = Waveform(10e6, 2e-5, 8, 4)
NOISE = 0.7


def receiver(seed=1, omni=True, wave=WAVE, arrays=ARRAYS, trials=2):
    rng = np.random.default_rng(seed)
    if omni:
        sent = transmission.omni(np.zeros((1, 0), dtype=bool), 2.0, arrays[0].n)
    else:
        sent = transmission.directional(arrays[0].steering(np.deg2rad(50.0))[None, None] / 3)
    precoder = np.repeat(factor(sent)[0], trials, axis=0)
    shape = (trials, precoder.shape[-1], wave.subcarriers, wave.symbols, 2)
    streams = symbols_of(wave, rng.standard_normal(shape))
    streams = orthogonalised(streams) if omni else streams
    return sent, receiver_of(arrays, wave, streams, precoder, NOISE)


def point(u, delay, doppler, amplitude):
    ones = np.ones(2)
    return Point(u * ones, delay * ones, doppler * ones, amplitude * ones, ones)


def test_the_bound_of_two_echoes_is_that_of_the_differentiated_signal():
    """Fisher matrix of the sampled signal by central differences, inverted as a whole."""
    _, known = receiver()
    theta = np.array([0.5, 3e-7, 900.0, 0.3, -0.2, 0.62, 3.4e-7, 2500.0, 0.1, 0.4])
    step = np.tile([1e-6, 1e-13, 1e-3, 1e-6, 1e-6], 2)

    def signal(v):
        both = (point(*v[i : i + 3], v[i + 3] + 1j * v[i + 4]) for i in (0, 5))
        return sum(rebuilt(one, known) for one in both).reshape(2, -1)

    d = np.stack(
        [(signal(theta + h) - signal(theta - h)) / (2 * h.sum()) for h in np.diag(step)], axis=-1
    )
    scale = np.tile([1.0, 1e-7, 1e4, 1.0, 1.0], 2)
    d = d * scale
    information = 2 / NOISE * np.real(np.conj(np.swapaxes(d, -1, -2)) @ d)
    expected = np.diagonal(np.linalg.inv(information), axis1=1, axis2=2) * scale**2
    points = [point(*theta[i : i + 3], theta[i + 3] + 1j * theta[i + 4]) for i in (0, 5)]
    found = stated_variance(points, [np.ones(2, dtype=bool)] * 2, known)
    slope = np.array([1 - 0.5**2, 1 - 0.62**2])
    np.testing.assert_allclose(found[:, :, 0] * slope, expected[:, [0, 5]], rtol=1e-6)
    np.testing.assert_allclose(found[:, :, 1], expected[:, [1, 6]], rtol=1e-6)
    np.testing.assert_allclose(found[:, :, 2], expected[:, [2, 7]], rtol=1e-6)


def alone_and_expected(omni, wave):
    sent, known = receiver(omni=omni, wave=wave)
    angle = np.deg2rad(52.0)
    one = point(np.sin(angle), 3e-7, 900.0, 3.0 - 2.0j)
    energy = np.sum(np.abs(rebuilt(one, known)) ** 2, axis=(1, 2))
    found = stated_variance([one], [np.ones(2, dtype=bool)], known)[:, 0]
    expected = measurement_variance(
        sent, np.array([[angle]]), (energy / NOISE / ARRAYS[1].n)[:, None], *ARRAYS, crb="exact",
        bandwidth=wave.effective_bandwidth, pulse_length=wave.effective_duration,
    )[:, 0]  # fmt: skip
    return found, expected


def test_one_echo_of_constant_modulus_alone_has_the_exact_bound_of_its_snr():
    np.testing.assert_allclose(*alone_and_expected(False, WAVE), rtol=1e-9)


def test_one_echo_of_orthogonal_streams_has_the_bound_of_their_covariance():
    """What lights the target varies over the grid: 1,024 elements, standard deviation about 4 %."""
    np.testing.assert_allclose(*alone_and_expected(True, Waveform(10e6, 2e-5, 64, 16)), rtol=0.16)


def test_echoes_lose_accuracy_as_they_merge_and_none_is_told_from_its_twin():
    _, known = receiver()
    valid = [np.ones(2, dtype=bool)] * 2
    alone = stated_variance([point(0.5, 3e-7, 900.0, 1e3)], valid[:1], known)[:, 0]
    ratios = []
    for apart in (3.0, 0.3, 0.03):
        pair = [point(0.5, 3e-7, 900.0, 1e3), point(0.5, 3e-7 + apart * 1e-7, 900.0, 1e3)]
        ratios.append((stated_variance(pair, valid, known)[:, 0, 1] / alone[:, 1]).max())
    assert 1.0 <= ratios[0] < ratios[1] < ratios[2]
    assert ratios[2] > 100
    weak = [point(0.5, 3e-7, 900.0, 1.0), point(0.5, 3.03e-7, 900.0, 1.0)]
    assert np.isinf(stated_variance(weak, valid, known)).all()  # above a fifth of a cell
    twins = [point(0.5, 3e-7, 900.0, 1e3)] * 2
    assert np.isinf(stated_variance(twins, valid, known)[..., 1]).all()


def test_an_echo_that_is_none_is_infinite_and_disturbs_no_other():
    _, known = receiver()
    one, twin = point(0.5, 3e-7, 900.0, 1.0), point(0.5, 3e-7, 900.0, 1.0)
    yes, no = np.ones(2, dtype=bool), np.zeros(2, dtype=bool)
    found = stated_variance([one, twin], [yes, no], known)
    assert np.isinf(found[:, 1]).all()
    np.testing.assert_allclose(found[:, :1], stated_variance([one], [yes], known), rtol=1e-9)


def test_one_receive_antenna_and_one_transmit_antenna_see_no_angle():
    arrays = (LinearArray(1), LinearArray(1))
    _, known = receiver(omni=False, arrays=arrays)
    found = stated_variance([point(0.5, 3e-7, 900.0, 1.0)], [np.ones(2, dtype=bool)], known)
    assert np.isinf(found[..., 0]).all()
    assert np.isfinite(found[..., 1:]).all()
