"""The law of the measurement variance against Eqs. (14), (16), (20)-(23) written out by hand."""

from __future__ import annotations

import math
import pickle
from dataclasses import replace

import numpy as np
import pytest

from echobeam.physics.array import LinearArray
from echobeam.physics.transmission import directional, omni, pilot
from echobeam.physics.variance_law import VarianceLaw

LAW = VarianceLaw(
    transmitter=LinearArray(12, 0.4),
    receiver=LinearArray(7, 0.4),
    rcs=120 - 50j,
    gain=10.0,
    noise=0.6,
    bandwidth=80e6,
    pulse_length=1e-5,
    crb="paper",
)
STATE = np.array([[math.radians(60.0), 90.0, 3.0], [math.radians(130.0), 140.0, -20.0]])
NOWHERE = np.full(3, np.nan)


def random_beams(seed, *shape):
    rng = np.random.default_rng(seed)
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


def echo_by_hand(beams):
    """SNR of Eq. (16) at the two states."""
    answer = []
    for theta, d, _ in STATE:
        a = np.exp(2j * np.pi * 0.4 * np.arange(12) * math.sin(theta))
        beta = abs(120 - 50j) / d**2
        answer.append(10.0 * beta**2 * np.sum(np.abs(beams.conj() @ a) ** 2) / 0.6)
    return np.array(answer)


def test_printed_law_is_the_papers_formulas_in_the_given_units():
    beams = random_beams(1, 2, 12)
    snr = echo_by_hand(beams)
    np.testing.assert_allclose(LAW.snr(directional(beams), STATE), snr, rtol=1e-12)
    slope = 2 * np.pi * 0.4 * np.cos(STATE[:, 0])
    aperture = slope**2 * (12**2 - 1) / 12
    expected = [1 / (84 * snr * aperture), 1 / (84 * snr * 80e6**2), 1 / (84 * snr * 1e-5**2)]
    variance = LAW.variance(directional(beams), STATE)
    np.testing.assert_allclose(variance, np.transpose(expected), rtol=1e-12)


def test_exact_law_of_one_beam_has_the_aperture_of_the_receiver_alone():
    beams = random_beams(2, 1, 12)
    snr = echo_by_hand(beams)
    slope = 2 * np.pi * 0.4 * np.cos(STATE[:, 0])
    aperture = slope**2 * (7**2 - 1) / 12
    delay, doppler = ((2 * np.pi * width) ** 2 / 12 for width in (80e6, 1e-5))
    expected = [1 / (14 * snr * aperture), 1 / (14 * snr * delay), 1 / (14 * snr * doppler)]
    variance = replace(LAW, crb="exact").variance(directional(beams), STATE)
    np.testing.assert_allclose(variance, np.transpose(expected), rtol=1e-9)


@pytest.mark.parametrize("crb", ["paper", "exact"])
def test_pilot_measures_as_well_as_data(crb):
    law, served = replace(LAW, crb=crb), np.ones(2, dtype=bool)
    data, silent = (law.variance(send(served, 1.0, 12), STATE) for send in (omni, pilot))
    np.testing.assert_allclose(silent, data, rtol=1e-12)


@pytest.mark.parametrize("crb", ["paper", "exact"])
@pytest.mark.parametrize("streams", [0, 2])
def test_states_that_are_nowhere_are_measured_with_infinite_variance(crb, streams):
    law = replace(LAW, crb=crb)
    sent = omni(np.ones(streams, dtype=bool), 1.0, 12)
    alone = law.variance(sent, STATE)
    assert np.isfinite(alone).all()
    mixed = law.variance(sent, np.stack([NOWHERE, *STATE, NOWHERE]))
    np.testing.assert_array_equal(mixed[[0, 3]], np.inf)
    np.testing.assert_array_equal(mixed[1:3], alone)


@pytest.mark.parametrize("crb", ["paper", "exact"])
def test_law_is_infinite_without_an_echo_and_where_the_array_is_blind(crb):
    law = replace(LAW, crb=crb)
    silent = directional(np.zeros((1, 12), dtype=complex))
    np.testing.assert_array_equal(law.variance(silent, STATE), np.inf)
    below = np.array([[np.pi / 2, 100.0, 0.0]])
    variance = law.variance(omni(np.ones(1, dtype=bool), 1.0, 12), below)[0]
    assert variance[0] == np.inf
    assert np.isfinite(variance[1:]).all()


def test_given_snr_takes_the_place_of_the_laws_own():
    sent = directional(random_beams(3, 2, 12))
    own = LAW.variance(sent, STATE)
    np.testing.assert_array_equal(LAW.variance(sent, STATE, LAW.snr(sent, STATE)), own)
    quarter = LAW.variance(sent, STATE, LAW.snr(sent, STATE) / 4)
    np.testing.assert_allclose(quarter, 4 * own, rtol=1e-14)


def test_velocity_has_no_influence_and_distance_the_fourth_power():
    sent = omni(np.ones(2, dtype=bool), 1.0, 12)
    moving = LAW.variance(sent, STATE * [1.0, 1.0, -7.0])
    np.testing.assert_array_equal(moving, LAW.variance(sent, STATE))
    twice = LAW.variance(sent, STATE * [1.0, 2.0, 1.0])
    np.testing.assert_allclose(twice, 16 * LAW.variance(sent, STATE), rtol=1e-13)


@pytest.mark.parametrize("crb", ["paper", "exact"])
def test_trials_are_independent_of_their_batch(crb):
    law, sent = replace(LAW, crb=crb), directional(random_beams(4, 5, 2, 12))
    states = STATE + np.arange(5)[:, None, None] * np.array([0.1, 3.0, 1.0])
    whole = law.variance(sent, states)
    for trial in range(5):
        alone = law.variance(directional(sent.beams[trial]), states[trial])
        np.testing.assert_array_equal(alone, whole[trial])


def test_law_is_a_value_that_can_be_hashed_and_pickled():
    copy = pickle.loads(pickle.dumps(LAW))
    assert copy == LAW
    assert hash(copy) == hash(LAW)
    assert replace(LAW, crb="exact") != LAW
