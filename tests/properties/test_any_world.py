"""Any combination of world, equipment and scheme runs, and its rates are those of what was sent."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import echobeam as eb

PLACES = ([40.0, 30.0], [-50.0, -10.0], [0.0, 0.0], [300.0, -200.0])
TARGETS = ("constant", "swerling1", "3gpp-vehicle", "3gpp-human", "3gpp-agv", "3gpp-large-uav")
SCHEMES = ("temporal", "pilot", "pilot-predict", "water-filling", "genie", "omni", "posterior")


@st.composite
def worlds(draw):
    """Return a built-in scenario and changes that make it another, small one."""
    geometry = draw(st.sampled_from(("paper-multi", "ground")))
    changes = {
        "frame.slots_per_frame": 3,
        "frame.frames": 2,
        "radio.power": draw(st.sampled_from((1e-6, 1.0, 1e4))),
        "radar.target": draw(st.sampled_from(TARGETS)),
        "radar.crb": draw(st.sampled_from(("paper", "exact"))),
        "radar.variance": draw(st.sampled_from(("predicted", "known"))),
        "radar.detections": draw(st.sampled_from(("labelled", "unlabelled"))),
        "truth.altitude_errors": draw(st.booleans()),
        "truth.process_noise": draw(st.booleans()),
    }
    if geometry == "ground":
        places = draw(st.lists(st.sampled_from(PLACES), max_size=3))
        changes |= {
            "array.rows": 3,
            "array.columns": 4,
            "array.polarisations": draw(st.sampled_from((1, 2))),
            "array.element": draw(st.sampled_from(("isotropic", "3gpp"))),
            "array.facing": draw(st.sampled_from(("down", "ahead", [1.0, 0.0, -1.0]))),
            "uav.velocity": draw(st.sampled_from(([0.0] * 3, [10.0, -5.0, 1.0]))),
            "objects": [{"position": place, "velocity": [10.0, -3.0]} for place in places],
        }
    return eb.load_scenario(geometry, changes)


@pytest.mark.slow
@settings(max_examples=200, deadline=None, derandomize=True)
@given(worlds(), st.sampled_from(SCHEMES))
def test_it_runs_and_the_rates_are_those_of_the_beams(scenario, scheme):
    """SINR as Eqs. (7) to (10), of each beam's power at the true place, where beams are sent."""
    result = eb.simulate(scenario, [scheme], trials=2, seed=5).isel(scheme=0)
    rate, sinr = result["rate"].values, result["sinr"].values
    assert np.isfinite(rate).all()
    assert (rate >= 0.0).all()
    if "shared" in result and result["shared"].values.any():
        return  # one beam serves several in turns
    beam = result["beam"].values
    beam = beam[..., 0] + 1j * beam[..., 1]
    sent = np.isfinite(beam).all(axis=(-2, -1)) & (result["mode"].values == eb.Mode.DIRECTIONAL)
    for trial, slot in np.argwhere(sent).tolist():
        gain = gains(result, scenario, trial, slot, beam[trial, slot])
        own = np.diagonal(gain)
        expected = own / (gain.sum(axis=1) - own + 1.0)
        there = result["present"].values[trial, slot]
        np.testing.assert_allclose(sinr[trial, slot][there], expected[there], rtol=1e-8)


def gains(result, scenario, trial, slot, beam):
    """Return power over noise ``(K, K)`` of every beam at every object, element by element."""
    uav = result["uav_position"].values[slot]
    offset = result["position"].values[trial, slot] - uav
    distance = np.linalg.norm(offset, axis=-1)
    array = scenario.array
    if scenario.geometry == "road":
        phase = np.pi * np.arange(array.n_tx) * (-offset[:, 2:] / distance[:, None])
        steering, element = np.exp(1j * phase), np.ones(len(distance))
    else:
        steering, element = planar(array, offset / distance[:, None])
    weights = beam.reshape(len(beam), array.polarisations, steering.shape[1])
    field = np.einsum("kn,lpn->klp", steering.conj(), weights)
    path = scenario.radio.alpha0**2 / distance**2 / scenario.radio.noise
    return np.sum(np.abs(field) ** 2, axis=-1) * (element * path)[:, None]


def planar(array, sight):
    """Return steering vectors ``(K, N)`` and gains of an element ``(K,)`` of TR 38.901."""
    normal = np.array({"down": (0, 0, -1), "ahead": (1, 0, 0)}.get(array.facing, (1, 0, -1)), float)
    normal /= np.linalg.norm(normal)
    e_v = np.array([0.0, 1.0, 0.0])  # of all three
    e_u = np.cross(normal, e_v)
    u, v, front = sight @ e_u, sight @ e_v, sight @ normal
    row, column = np.meshgrid(np.arange(array.rows), np.arange(array.columns), indexing="ij")
    steering = np.exp(1j * np.pi * (np.multiply.outer(u, row) + np.multiply.outer(v, column)))
    gain = np.where(front > 0.0, 1.0, 0.0)
    if array.element == "3gpp":
        elevation, azimuth = np.degrees(np.arcsin(u)), np.degrees(np.arctan2(v, front))
        lost = [np.minimum(12.0 * (angle / 65.0) ** 2, 30.0) for angle in (elevation, azimuth)]
        gain = gain * 10.0 ** (0.1 * (8.0 - np.minimum(sum(lost), 30.0)))
    return steering.reshape(len(u), array.rows * array.columns), gain
