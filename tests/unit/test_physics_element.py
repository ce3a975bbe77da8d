"""Pattern of an element, and how it acts on link and echo."""

from __future__ import annotations

import numpy as np
import pytest

import echobeam as eb
from echobeam.physics.element import element_gain


def decibels(u, v, w):
    return 10.0 * np.log10(element_gain(np.array(u), np.array(v), np.array(w)))


def test_the_pattern_has_the_standards_numbers():
    """8 dBi at the normal, 3 dB less at half of 65 degrees, 22 dB below it at the least."""
    assert decibels(0.0, 0.0, 1.0) == pytest.approx(8.0)
    half = np.radians(32.5)
    assert decibels(np.sin(half), 0.0, np.cos(half)) == pytest.approx(5.0)
    assert decibels(0.0, -np.sin(half), np.cos(half)) == pytest.approx(5.0)
    assert decibels(0.0, 1.0, 0.0) == pytest.approx(8.0 - 12.0 * (90.0 / 65.0) ** 2)
    steep = np.radians(85.0)
    assert decibels(np.sin(steep), np.cos(steep) * np.sin(steep), 1e-3) == pytest.approx(-22.0)


def test_it_acts_once_on_the_link_and_twice_on_the_echo():
    scenario = eb.load_scenario("ground", {"frame.slots_per_frame": 1})
    plain, own = (
        eb.simulate(one, ["omni", "genie"], trials=1)
        for one in (scenario, scenario.replace({"array.element": "3gpp"}))
    )
    offset = plain["position"].values[0, 0] - plain["uav_position"].values[0]
    u, v, w = (offset / np.linalg.norm(offset, axis=-1, keepdims=True)).T
    gain = element_gain(u, v, -w)
    echo = (own["radar_snr"] / plain["radar_snr"]).sel(scheme="omni").values[0, 0]
    np.testing.assert_allclose(echo, gain**2, rtol=1e-12)
    power, noise = scenario.radio.power, np.sum(offset**2, axis=-1)
    share = power / len(offset)
    expected = share / (power - share + noise / gain)
    np.testing.assert_allclose(own["sinr"].sel(scheme="omni").values[0, 0], expected)


def test_the_uav_knows_its_elements():
    """The variance given is the law at the prediction, elements included."""
    scenario = eb.load_scenario("ground", {"array.element": "3gpp", "frame.slots_per_frame": 3})
    result = eb.simulate(scenario, ["water-filling"], trials=2)
    given, true = result["measured_var"].values, result["true_var"].values
    assert (np.abs(np.log(given / true))[np.isfinite(given)] < 2.0).all()
