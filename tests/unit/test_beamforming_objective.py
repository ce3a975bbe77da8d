from __future__ import annotations

import numpy as np

from echobeam.beamforming.objective import beam_gains, rates, rates_from_gains, sinr
from echobeam.beamforming.problem import BeamProblem
from echobeam.physics.array import LinearArray
from echobeam.physics.link import channel_loss


def test_rates_follow_the_channel_of_eq_3_written_out() -> None:
    rng = np.random.default_rng(3)
    angles, distances = np.array([0.6, 1.4, 2.5]), np.array([90.0, 110.0, 140.0])
    beams = rng.normal(size=(3, 7)) + 1j * rng.normal(size=(3, 7))
    problem = BeamProblem(angles, distances, np.zeros(3), 1, 0, 50, 0.3, 7, alpha0=2.5)
    expected = []
    for k in range(3):
        steering = np.exp(1j * np.pi * np.arange(7) * np.sin(angles[k]))
        h = 2.5 / distances[k] * np.exp(1j * 0.7 * distances[k]) * steering
        power = [abs(np.vdot(h, beam)) ** 2 for beam in beams]
        expected.append(np.log2(1 + power[k] / (sum(power) - power[k] + 0.3)))
    np.testing.assert_allclose(rates(problem, beams), expected, rtol=1e-12)


def test_gains_of_a_batch_are_those_of_its_members() -> None:
    rng = np.random.default_rng(4)
    beams = rng.normal(size=(5, 2, 6)) + 1j * rng.normal(size=(5, 2, 6))
    angles = rng.uniform(0.3, 2.8, size=(5, 2))
    gains = beam_gains(beams, angles, LinearArray(beams.shape[-1], axis="horizontal"))
    for t in range(5):
        np.testing.assert_allclose(
            gains[t],
            beam_gains(beams[t], angles[t], LinearArray(beams[t].shape[-1], axis="horizontal")),
        )


def test_small_rates_keep_their_relative_accuracy() -> None:
    # log2(1 + x) evaluated as printed loses half of the digits at x = 1e-8.
    gains, loss = np.array([[1e-8]]), np.array([1.0])
    np.testing.assert_allclose(rates_from_gains(gains, loss), 1e-8 / np.log(2), rtol=1e-8)
    assert rates_from_gains(gains, loss)[0] < 1e-8 / np.log(2)


def test_sinr_counts_all_other_beams_and_the_noise() -> None:
    gains = np.array([[6.0, 1.0, 0.5], [2.0, 9.0, 0.0], [1.0, 1.0, 4.0]])
    np.testing.assert_allclose(sinr(gains, np.array([0.5, 1.0, 2.0])), [3.0, 3.0, 1.0])


def test_loss_is_the_noise_over_the_channel_gain() -> None:
    np.testing.assert_allclose(channel_loss(np.array([100.0]), 2.0, 4.0), [1250.0])
