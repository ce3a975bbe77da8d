"""Link budgets by hand, from the equations and decibels, and against the simulator's own slots."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

import echobeam as eb
from echobeam.scenario.limits import LEAST, MOST, MOST_PULSE, MOST_SPACING
from echobeam.simulation.assumptions import MOST_SLOTS
from echobeam.simulation.description import describe

C = 299_792_458.0


def db(ratio):
    return 10 * math.log10(ratio)


def test_paper_single_by_hand():
    # 60 degrees, 100 m high: d^2 = 40000 / 3 m^2, d^4 = 1.7778e8 m^4, |eps|^2 = 28800
    (one,) = describe("paper-single").objects
    assert one.distance**2 == pytest.approx(40000 / 3)
    assert one.snr == one.omni_sinr == pytest.approx(7.5e-5)
    assert db(one.snr) == pytest.approx(-41.25, abs=0.005)
    assert db(one.beam_snr) == pytest.approx(-41.25 + 14.77, abs=0.005)  # 30 antennas
    assert one.beam_rate == pytest.approx(math.log2(1 + 2.25e-3))
    omni, beam = one.omni_echo, one.beam_echo
    assert omni.raw_snr == pytest.approx(28800 * 9 / 16e8)  # 1.62e-4
    assert db(omni.snr) == pytest.approx(-27.9, abs=0.01)
    assert db(omni.array_snr) == pytest.approx(-13.13, abs=0.01)
    assert db(omni.counted_snr) == pytest.approx(1.64, abs=0.01)
    assert beam.snr / omni.snr == pytest.approx(30)
    # (20): 1 / (SNR N_t N_r kappa^2) = 1 / (1.458 (8e7)^2)
    assert omni.delay_std == pytest.approx(1 / (math.sqrt(1.458) * 8e7))
    assert omni.distance_std == pytest.approx(1.552, abs=1e-3)
    # (21): 1 / (1.458 (1e-5)^2) Hz^2, lambda / 2 = 5 mm: 414 m/s, twice that along the road
    assert omni.doppler_std == pytest.approx(1e5 / math.sqrt(1.458))
    assert omni.speed_std == pytest.approx(1e5 / math.sqrt(1.458) * C / 60e9)
    assert omni.velocity_std == pytest.approx(2 * omni.speed_std)
    # (22), (23): xi^2 = pi^2 cos^2(60) (900 - 1) / 12 = 184.85
    assert omni.angle_std == pytest.approx(1 / math.sqrt(1.458 * math.pi**2 * 899 / 48))
    assert math.degrees(omni.angle_std) == pytest.approx(3.49, abs=0.005)
    assert one.delay == pytest.approx(2 * one.distance / C)
    # (18): the UAV sinks at 15 m/s, v^u cos(60 - 90) = 12.99; the object does 30 cos(60) = 15
    assert one.doppler == pytest.approx(2 * 30e9 / C * (15 * math.cos(math.radians(30)) - 15))


def test_at_a_hundred_metres_the_echo_of_an_omni_slot_is_25_dB_below_and_4_dB_above_the_noise():
    """At one antenna, and as (20) counts the whole array, N_t N_r: 29.5 dB, N_t being in twice."""
    (one,) = describe(eb.load_scenario("paper-single", {"objects.0.angle": "89.99 deg"})).objects
    assert one.distance == pytest.approx(100, rel=1e-6)
    assert round(db(one.omni_echo.snr)) == -25
    assert round(db(one.omni_echo.counted_snr)) == 4
    assert db(one.omni_echo.array_snr) == pytest.approx(-10.63, abs=0.01)  # N_r alone


def test_two_objects_share_an_omni_slot_and_interfere():
    near, far = describe("paper-multi").objects
    for one in (near, far):  # (7): half the power for each, half is interference
        assert one.omni_sinr == pytest.approx(0.5 / (0.5 + one.distance**2))
    assert (near.name, far.name) == ("object 1", "object 2")


def test_the_exact_bound_counts_the_receive_array_alone():
    scenario = eb.load_scenario("paper-single", {"radar.crb": "exact", "array.n_rx": 8})
    (one,) = describe(scenario).objects
    omni = one.omni_echo
    assert omni.counted_snr == omni.array_snr == pytest.approx(8 * 1.62e-3)
    band = (2 * math.pi * 8e7) ** 2 / 12  # mean square of a flat spectrum
    assert omni.delay_std == pytest.approx(1 / math.sqrt(2 * 8 * 1.62e-3 * band))


def test_watts_and_square_metres_by_the_radar_equation_in_decibels():
    scale = describe("paper-single").scale
    noise = -174 + db(80e6) + 7  # dBm/Hz, Hz, noise figure
    assert db(1e3 * scale.noise_power) == pytest.approx(noise, abs=0.05)
    loss = 32.45 + 20 * math.log10(30) + 20 * math.log10(1)  # free space, GHz and m
    assert db(1e3 * scale.transmit_power) == pytest.approx(noise + loss, abs=0.1)
    assert scale.transmit_power * scale.watt == pytest.approx(scale.power)
    # radar equation in dB, isotropic antennas: P + 20 lg(lambda) + rcs - 33 - 40 lg(d) - noise
    power, wavelength, d = db(1e3 * scale.transmit_power), C / 30e9, 115.47
    echo = (
        power + 20 * math.log10(wavelength) + db(scale.cross_section) - 30 * math.log10(4 * math.pi)
        - 40 * math.log10(d) - noise
    )  # fmt: skip
    (one,) = describe("paper-single").objects
    assert echo == pytest.approx(db(one.omni_echo.raw_snr), abs=0.1)
    # 80 MHz over 10 ms are 8e5 samples against G_m = 10
    assert scale.cross_section / scale.full_cross_section == pytest.approx(8e4)


@pytest.mark.parametrize(
    "changes",
    [
        {"radio.power": 50, "radio.noise": 2, "radio.alpha0": 3, "radar.noise": 0.5},
        {"radio.carrier": "28 GHz", "radar.bandwidth": "100 MHz", "frame.slot": "5 ms"},
    ],
)
def test_the_scale_gives_the_scenarios_ratios_back(changes):
    """Received power over k T B F, computed in watts, is what the model has in its own unit."""
    description = describe(eb.load_scenario("paper-single", changes))
    (one,), scale = description.objects, description.scale
    wavelength = description.scenario.radio.wavelength
    received = scale.transmit_power * (wavelength / (4 * math.pi * one.distance)) ** 2
    assert received / scale.noise_power == pytest.approx(one.snr)
    echo = (
        scale.transmit_power * wavelength**2 * scale.cross_section
        / ((4 * math.pi) ** 3 * one.distance**4)
    )  # fmt: skip
    assert echo / scale.noise_power == pytest.approx(one.omni_echo.raw_snr)


STILL = {
    "uav.speed": 0, "objects.0.velocity": 0, "objects.0.acceleration": 0,
    "frame.slots_per_frame": 2,
}  # fmt: skip


@pytest.mark.parametrize("crb", ["paper", "exact"])
def test_the_simulator_has_these_numbers_in_its_slots(crb):
    """Nothing moves, so that slot 2 is slot 1; the genie has matched beams with all power."""
    scenario = eb.load_scenario("paper-single", {**STILL, "radar.crb": crb, "array.n_rx": 12})
    (one,) = describe(scenario).objects
    result = eb.simulate(scenario, ["genie", "omni"], trials=2, seed=0)
    genie, omni = (result.sel(scheme=name, object=result.object[0]) for name in ("genie", "omni"))
    for slot in (1, 2):
        at = {"slot": slot}
        np.testing.assert_allclose(genie["sinr"].sel(at), one.beam_snr, rtol=1e-9)
        np.testing.assert_allclose(genie["rate"].sel(at), one.beam_rate, rtol=1e-9)
        np.testing.assert_allclose(genie["radar_snr"].sel(at), one.beam_echo.snr, rtol=1e-9)
        np.testing.assert_allclose(omni["sinr"].sel(at), one.omni_sinr, rtol=1e-12)
        np.testing.assert_allclose(omni["radar_snr"].sel(at), one.omni_echo.snr, rtol=1e-12)
        stds = [one.omni_echo.angle_std, one.omni_echo.delay_std, one.omni_echo.doppler_std]
        found = np.sqrt(omni["true_var"].sel(at))
        np.testing.assert_allclose(found, np.tile(stds, (2, 1)), rtol=1e-12)


def test_a_beam_that_is_well_pointed_measures_as_described():
    scenario = eb.load_scenario("paper-single", {**STILL, "radio.power": 1e8})
    (one,) = describe(scenario).objects
    result = eb.simulate(scenario, ["water-filling"], trials=1, seed=0)
    at = result.sel(scheme="water-filling", slot=2, object=result.object[0])
    stds = [one.beam_echo.angle_std, one.beam_echo.delay_std, one.beam_echo.doppler_std]
    np.testing.assert_allclose(np.sqrt(at["true_var"].values[0]), stds, rtol=1e-4)


def warned(changes, source="paper-single"):
    return {one.name for one in describe(eb.load_scenario(source, changes)).warnings}


USUAL = {"measurements reach their bound", "velocity known from the first slot"}
STRONG = {"radio.power": 1e4, "filter.velocity_prior": "20 m/s"}
LOW = {
    **STRONG, "uav.height": "30 m", "uav.speed": 0, "objects.0.velocity": 0,
    "radar.bandwidth": "40 MHz", "coverage.resolution": 1e-6,
}  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "names"),
    [
        ({}, USUAL),
        ({"radio.power": 700, "coverage.resolution": "0.01 deg"},
         {"velocity known from the first slot"}),  # -13.1 + 28.5 = 15.3 dB
        ({**STRONG, "coverage.resolution": "0.01 deg"}, set()),
        # 2 (255 / 2 lambda)^2 / lambda = 325 m at 30 GHz, and 4.25 ns are a third of 12.5 ns
        ({"array.n_tx": 256, "coverage.resolution": "1 mrad", **STRONG},
         {"far field", "narrow band", "cover above the grid's resolution"}),
        ({"array.n_tx": 96, **LOW}, {"far field"}),  # 45.1 m, the object at 34.6
        ({"array.n_rx": 96, **LOW}, {"far field"}),
        ({"array.n_rx": 80, **LOW}, set()),  # 31.2 m
        ({"radar.bandwidth": "1 GHz"}, USUAL | {"narrow band"}),
        # 15 m/s against a range cell of 1.87 m: from 125 ms on, times cos(60)
        ({"frame.slot": "1 s", "frame.slots_per_frame": 1, "uav.speed": 0},
         USUAL | {"no range migration", "no angle migration"}),
        ({"frame.slot": "1 us"}, USUAL | {"pulse within the slot"}),
        ({"radar.gain": 801}, USUAL | {"gain of the matched filter"}),
        ({"radar.pulse_length": "1 ms", "objects.0.velocity": 60},
         {"measurements reach their bound", "steady phase within a pulse"}),
        ({"radar.bandwidth": "1 kHz", "radar.gain": 0.001},
         USUAL | {"unambiguous Doppler", "cover below the widest"}),  # 529 Hz against 500
        ({"array.spacing": 0.6}, USUAL | {"no grating lobes"}),  # 1 / (1 + sin 60) = 0.536
        ({"coverage.max_halfwidth": "10 deg"}, USUAL | {"cover below the widest"}),  # 10.5
        ({"objects.0.angle": "90 deg"},
         USUAL | {"array sensitive to the angle", "cover below the widest"}),
        ({"array.n_tx": 1, "array.n_rx": 1},
         USUAL | {"array sensitive to the angle", "cover below the widest"}),
        ({"radar.rcs": [0, 0]},
         USUAL | {"array sensitive to the angle", "cover below the widest"}),
    ],
)  # fmt: skip
def test_an_assumption_that_does_not_hold_is_a_warning(changes, names):
    assert warned(changes) == names


def test_objects_that_share_a_beam_are_warned_of():
    # sines differ by 0.024, a beam is 0.886 / 15 = 0.059 wide
    assert "objects in beams of their own" in warned({"objects.1.angle": "70 deg"}, "paper-multi")
    # behind is as ahead for an upright array, and not for one along the road
    mirrored = {"objects.1.angle": "105 deg"}
    assert "objects in beams of their own" in warned(mirrored, "paper-multi")
    beside = {**mirrored, "array.axis": "horizontal"}
    assert "objects in beams of their own" not in warned(beside, "paper-multi")


def test_the_nearest_distance_is_that_of_the_whole_run():
    # sinks by 0.15 m a slot from 100 m: 2.5 m lower in the last of 200 slots at 1.25 m/s
    scenario = eb.load_scenario("paper-single", {
        "frame.frames": 20, "uav.speed": "1.25 m/s", "objects.0.angle": "90 deg",
        "objects.0.velocity": 0, "objects.0.acceleration": 0,
    })  # fmt: skip
    (found,) = [one for one in describe(scenario).assumptions if one.name == "far field"]
    assert found.value == pytest.approx(100 - 199 * 0.0125)


@pytest.mark.slow
def test_an_empty_scene_and_an_endless_run_are_described():
    empty = describe(eb.load_scenario("paper-single", {"objects": []}))
    assert empty.objects == ()
    assert empty.scale.power == 1
    endless = {
        "frame.frames": 1_000_000, "frame.slots_per_frame": 1_000_000, "objects.0.acceleration": 0,
    }  # fmt: skip
    assert describe(eb.load_scenario("paper-single", endless)).slot == 1
    assert MOST_SLOTS <= 10_000


@pytest.mark.parametrize(
    "changes",
    [
        {"radio.power": MOST["number"], "radio.alpha0": MOST["number"]},
        {"radio.power": LEAST, "radio.alpha0": LEAST},
        {"radar.rcs": [MOST["number"], 0]},
        {"array.spacing": MOST_SPACING},
        {"array.spacing": LEAST},
        {"radio.carrier": LEAST},
        {"radio.carrier": MOST["frequency"]},
        {"radar.pulse_length": MOST_PULSE, "radar.crb": "exact"},
        {"radar.bandwidth": MOST["frequency"]},
        {"radio.noise": MOST["number"], "radar.noise": LEAST},
        {"frame.slot": MOST["time"], "objects.0.acceleration": 0},
        {"objects.0.angle": 101.0 / MOST["length"]},
    ],
)
def test_numbers_out_of_all_proportion_are_no_crash(changes):
    from echobeam.cli.describe import _json, _text

    description = describe(eb.load_scenario("paper-single", changes))
    assert _text(description)
    assert json.loads(_json(description))["scenario"] == "paper-single"


def test_a_description_is_short_in_a_console():
    assert repr(describe("paper-multi")) == (
        "<Description of paper-multi: 2 object(s), warnings measurements reach their bound, "
        "velocity known from the first slot>"
    )
