"""Link budgets on the ground against closed forms, and against the road's."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from click.testing import CliRunner

import echobeam as eb
from echobeam.cli.main import cli
from echobeam.scenario.built_in import BUILT_IN
from echobeam.units import SPEED_OF_LIGHT

GROUND = [name for name in BUILT_IN if eb.load_scenario(name).geometry == "ground"]


def test_numbers_of_the_built_in_scenario_are_those_of_the_closed_forms():
    """8 x 8 elements 100 m above: the printed bound, (20) with N_t N_r, in both cosines."""
    one = eb.describe("ground").objects[0]
    distance = math.sqrt(40.0**2 + 30.0**2 + 100.0**2)
    assert one.distance == pytest.approx(distance, rel=1e-12)
    assert one.cosines == pytest.approx((40.0 / distance, 30.0 / distance), rel=1e-12)
    closing = -(40.0 * 20.0 + 30.0 * 5.0) / distance
    assert one.doppler == pytest.approx(2.0 * 30e9 / SPEED_OF_LIGHT * closing, rel=1e-9)
    assert one.snr == pytest.approx(1000.0 / distance**2, rel=1e-12)
    assert one.beam_rate == pytest.approx(math.log2(1.0 + 64.0 * one.snr), rel=1e-12)
    echo = one.beam_echo
    assert echo.snr == pytest.approx(64.0 * 10.0 * 1000.0 * 32.0 / distance**4, rel=1e-12)
    assert echo.array_snr == pytest.approx(64.0 * echo.snr, rel=1e-12)
    least = 12.0 / (echo.snr * 64.0 * 64.0 * math.pi**2 * 63.0)
    assert echo.cosine_std == pytest.approx((math.sqrt(least),) * 2, rel=1e-9)
    assert one.omni_echo.snr == pytest.approx(echo.snr / 64.0, rel=1e-12)


def test_the_place_is_as_accurate_as_the_information_of_cosines_and_delay():
    """The Jacobian by differences of the measurement itself, and the inverse of J^T R^-1 J."""
    scenario = eb.load_scenario(
        "ground", {"array.facing": [1, 0, -1], "uav.position": [-80, 5, 90]}
    )
    step = 1e-3
    for number, one in enumerate(eb.describe(scenario).objects):
        rows = []
        for axis in range(2):
            seen = []
            for side in (1, -1):
                place = list(one.position)
                place[axis] += side * step
                key = f"objects.{number}.position"
                other = eb.describe(scenario.replace({key: place})).objects[number]
                seen.append((*other.cosines, other.delay))
            rows.append((np.array(seen[0]) - seen[1]) / (2.0 * step))
        J = np.array(rows).T
        echo = one.omni_echo
        R = np.diag(np.square([*echo.cosine_std, echo.delay_std]))
        cov = np.linalg.inv(J.T @ np.linalg.inv(R) @ J)
        assert echo.position_std == pytest.approx(np.sqrt(np.diag(cov)), rel=1e-4)


def test_a_linear_array_and_objects_on_a_line_have_the_roads_numbers():
    """`tests/reference/test_ground_geometry.py` has the same of whole runs."""
    road = eb.load_scenario("paper-single", {"radar.crb": "exact", "array.axis": "horizontal"})
    x = 100.0 / math.tan(math.radians(60.0))
    ground = eb.load_scenario(
        "ground",
        {
            "array": {"kind": "linear", "n_tx": 30, "axis": "horizontal"},
            "objects": [{"position": [x, 0], "velocity": [road.objects[0].velocity, 0]}],
            "uav.velocity": [0, 0, -15],
            "radio.power": 1, "radar.rcs": [120, 120], "radar.crb": "exact",
            "coverage.ripple": 3,
        },
    )  # fmt: skip
    (one,), (other,) = eb.describe(road).objects, eb.describe(ground).objects
    for name in ("distance", "delay", "doppler", "snr", "omni_sinr", "beam_snr", "beam_rate"):
        assert getattr(other, name) == pytest.approx(getattr(one, name), rel=1e-9), name
    for name in ("raw_snr", "snr", "array_snr", "delay_std", "doppler_std", "detection"):
        for sent in ("omni_echo", "beam_echo"):
            own, theirs = (getattr(getattr(each, sent), name) for each in (other, one))
            assert own == pytest.approx(theirs, rel=1e-9), name
    # u = cos(theta): its deviation is that of the angle times the slope
    slope = math.sin(one.angle)
    assert max(other.beam_echo.cosine_std[:1]) == pytest.approx(
        slope * one.beam_echo.angle_std, rel=1e-9
    ) or other.beam_echo.cosine_std[1] == pytest.approx(slope * one.beam_echo.angle_std, rel=1e-9)


@pytest.mark.parametrize("name", GROUND)
def test_every_scenario_on_the_ground_is_described(name):
    done = CliRunner().invoke(cli, ["describe", name])
    assert done.exit_code == 0, done.output
    for words in ("8 x 8 elements send", "downlink in slot", "closing speed", "taken"):
        assert words in done.output
    found = json.loads(CliRunner().invoke(cli, ["describe", name, "--json"]).output)
    assert {len(one["cosines"]) for one in found["objects"]} == {2}
    assert all("\n" not in one["statement"] for one in found["assumptions"])


@pytest.mark.parametrize(
    ("changes", "name"),
    [
        ({"objects.0.position": ["0 m", "0 m"], "array.facing": "ahead"}, "in front"),
        ({"coverage.resolution": 0.3}, "lattice"),
        ({"objects.1.position": [41, 30]}, "beams of their own"),
        ({"array.spacing": 0.9}, "grating"),
        ({"radar.rcs": [0.01, 0.0]}, "place known"),
        ({"frame.slot": "2 s", "radar.pulse_length": "1 ms"}, "angle migration"),
        ({"radar.bandwidth": "5 GHz"}, "narrow band"),
    ],
)
def test_what_does_not_hold_is_warned_of(changes, name):
    assert any(
        name in one.name for one in eb.describe(eb.load_scenario("ground", changes)).warnings
    )
    assert not any(name in one.name for one in eb.describe("ground").warnings)


def test_a_flight_polarisations_and_patterns_are_told():
    points = [[0, 0, 0, 90], [2, 30, 0, 100]]
    told = {
        "array.polarisations=2": "both polarisations",
        "array.element=3gpp": "elements of 8 dBi",
        "array.facing=[1,0,-1]": "facing to (1, 0, -1)",
        "uav.velocity=[3,0,0]": "flies at (3, 0, 0) m/s from (0, 0, 100) m",
        f"uav={{waypoints={points}}}": "past 2 waypoints, from (0, 0, 90) m",
        "radar.target=3gpp-vehicle": "cross-section dBsm",
    }
    for setting, words in told.items():
        done = CliRunner().invoke(cli, ["describe", "ground", "--set", setting])
        assert words in " ".join(done.output.split()), setting
