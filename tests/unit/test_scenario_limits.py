"""Limits of a scenario's numbers: refused in one message, and runs at their edge stay numbers."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

import echobeam as eb
from echobeam.faults import InputError
from echobeam.physics.plane import facing
from echobeam.scenario import ScenarioError, load_scenario
from echobeam.scenario.limits import (
    LEAST,
    MOST,
    MOST_COVER_POINTS,
    MOST_FALSE,
    MOST_HEIGHT_STD,
    MOST_PULSE,
    MOST_SPACING,
    cover_points,
)
from echobeam.schemes.configure import configure, detection_of

LIGHT = "expected less than the speed of light"

FAULTS = [
    ("ground", {"uav.position": [0, 0, 1e300]}, "uav.position.2: 1e.300 .* at most 1e.09 m"),
    ("ground", {"objects.0.velocity": [1e300, 0]}, f"objects.0.velocity: 1e.300 .* {LIGHT}"),
    ("paper-multi", {"objects.0.velocity": "3e8 m/s"}, f"objects.0.velocity: '3e8 m/s' .* {LIGHT}"),
    ("paper-multi", {"uav.speed": "-1.1e9 km/h"}, f"uav.speed: .* {LIGHT}"),
    (
        "ground",
        {"objects.0.velocity": [2.9e8, 2.9e8]},
        f"objects.0.velocity: 4.10122e.08 .*{LIGHT}",
    ),
    ("ground", {"uav.velocity": [1e308, 0, 0]}, f"uav.velocity.0: 1e.308 .* {LIGHT}"),
    ("ground", {"uav.velocity": [2.9e8, 2.9e8, 0]}, f"uav.velocity: 4.10122e.08 .* {LIGHT}"),
    ("paper-multi", {"objects.0.acceleration": 1e307}, "objects.0.acceleration: .* at most 1e.09"),
    (
        "paper-multi",
        {"objects.0.acceleration": 1e9, "frame.slot": 1},
        f"objects.0.acceleration: 1e.10 m/s in the end .* {LIGHT}",
    ),
    (
        "ground",
        {"uav": {"waypoints": [[0, 0, 0, 100], [1e-6, 500, 0, 100]]}},
        f"uav.waypoints: 500 m in 1e-06 s; {LIGHT}",
    ),
    (
        "ground",
        {"objects.0": {"path": [[0, 0, 0], [1e-8, 3, 4]]}},
        f"path: 5 m in 1e-08 s; {LIGHT}",
    ),
    ("ground", {"uav": {"waypoints": [[1e-320, 0, 0, 9]]}}, "0.0: 1e-320 .* at least 1e-30 s"),
    ("ground", {"array.spacing": 1e300}, "array.spacing: 1e.300 .* at most 100 "),
    ("ground", {"filter.velocity_prior": 1e300}, f"filter.velocity_prior: 1e.300 .* {LIGHT}"),
    ("ground", {"filter.velocity_std": 1e200}, f"filter.velocity_std: 1e.200 .* {LIGHT}"),
    ("ground", {"coverage.width": 1e300}, "coverage.width: 1e.300 .* at most 1e.30 "),
    ("paper-multi", {"coverage.ripple": "1e300 N_t"}, "coverage.ripple: .* at most 1e.30 "),
    ("paper-multi", {"coverage.min_rate": 1e3}, "coverage.min_rate: .* at most 300 bit/s/Hz"),
    ("paper-multi", {"uav.altimeter_std": 1e6}, "uav.altimeter_std: .* at most 10000 m"),
    ("paper-multi", {"radar.pulse_length": 1e9}, "radar.pulse_length: .* at most 10000 s"),
    ("paper-multi", {"radio.noise": 1e-200}, "radio.noise: 1e-200 .* at least 1e-30 "),
    ("paper-multi", {"uav.height": 10**400}, "uav.height: a number too large"),
    ("paper-multi", {"objects.0.angle": 1e-20}, "objects.0.angle: 1e-20 rad .* 1e.22 m away"),
    (
        "ground",
        {"coverage.resolution": 1e-300},
        "coverage.resolution: 1e-300 .* at least 1e-30 rad",
    ),
    ("ground", {"coverage.resolution": 1e-9}, r"resolution: 1e-09 rad .* 2.68e\+17 grid points"),
    (
        "paper-multi",
        {"coverage.resolution": 1e-9},
        r"resolution: 1e-09 rad .* 1.57e\+09 grid points",
    ),
    ("ground", {"array.polarisations": True}, "array.polarisations: True .* expected 1 or 2"),
    ("ground", {"array.rows": True}, "array.rows: True .* expected a whole number"),
    (
        "ground",
        {"objects.0.position": [0, 0, 0]},
        r"position: \[0, 0, 0\] .* \[x, y\], two lengths",
    ),
    ("ground", {"objects.0.position": [0]}, r"position: \[0\] .* expected \[x, y\], two lengths"),
    ("ground", {"uav.position": [0, 9]}, r"uav.position: \[0, 9\] .* \[x, y, z\], three lengths"),
    ("ground", {"objects.0": {"path": [[0, 1]]}}, r"path.0: \[0, 1\] .* a time and two lengths"),
    ("traffic", {"trace.road": [1, 2, 3]}, r"trace.road: \[1, 2, 3\] .* four lengths"),
    ("paper-multi", {"radar.rcs": 3}, r"radar.rcs: 3 .* expected \[real, imaginary\], two numbers"),
]


@pytest.mark.parametrize(("name", "changes", "message"), FAULTS)
def test_a_number_beyond_all_proportion_is_one_clear_message(name, changes, message):
    with pytest.raises(ScenarioError, match=message) as caught:
        load_scenario(name, changes)
    assert "\n" not in str(caught.value)


def test_numbers_of_more_digits_than_python_reads_are_refused(tmp_path):
    digits = "1" * 5000
    with pytest.raises(ScenarioError, match=r"uav.height: .* is not finite"):
        load_scenario("paper-multi", [f"uav.height={digits}"])
    path = tmp_path / "long.toml"
    path.write_text(f"name = 'long'\n[uav]\nheight = {digits}\n")
    with pytest.raises(ScenarioError, match=r"long.toml: not a TOML file"):
        load_scenario(path)


def test_the_grid_of_the_widest_cover_is_counted():
    """sin(pi/6) / 0.25 steps either way in two axes; pi/6 over pi/60 either way in one."""
    assert cover_points(np.pi / 6, 0.25, planar=True) == pytest.approx(5 * 5)
    assert cover_points(np.pi / 6, np.pi / 60, planar=False) == pytest.approx(21)
    narrow = {"coverage.max_halfwidth": 1e-6, "coverage.resolution": 1e-8}
    assert load_scenario("ground", narrow).coverage.resolution == 1e-8


@pytest.mark.parametrize("name", ["ground", "paper-multi"])
def test_a_schemes_own_grid_is_counted_too(name):
    with pytest.raises(InputError, match=r"scheme temporal:resolution=1e-9: .* grid points"):
        configure(load_scenario(name), "temporal:resolution=1e-9")
    assert MOST_COVER_POINTS >= 1e6  # of the road: a millionth of a radian


@pytest.mark.parametrize(
    "changes", [{"radar.pulse_length": 1e2}, {"radio.carrier": 1e18}, {"radar.pulse_length": 1e4}]
)
def test_more_false_detections_than_trackers_take_are_refused(changes):
    """Cells N x 2 (2 f_c / c) v_max T x N_r times a millionth each, over a thousand."""
    scenario = load_scenario("crossing", changes)
    with pytest.raises(ScenarioError, match=r"radar.false_alarm: .* false detections in a slot"):
        detection_of(scenario)
    assert detection_of(load_scenario("crossing")).mean_false < MOST_FALSE


@pytest.mark.parametrize("length", [1e-320, 1e-200, 1.0, 1e200])
def test_a_direction_may_have_any_length(length):
    root = np.sqrt(0.5)
    direction = (length, length, 0.0)
    np.testing.assert_allclose(facing(direction).normal, (root, root, 0.0), rtol=1e-3)
    ahead = {"array.facing": [length, 0.0, -length], "frame.frames": 1}
    one, other = (
        eb.simulate(eb.load_scenario("ground", changes), ["genie"], trials=1, progress=False)
        for changes in (ahead, {**ahead, "array.facing": [2.0, 0.0, -2.0]})
    )
    assert float(one.rate.mean()) > 0.0
    np.testing.assert_allclose(one.rate, other.rate, rtol=1e-2 if length < 1e-300 else 1e-9)


EDGES = [
    ("ground", {"uav.position": [0, 0, MOST["length"]]}),
    ("ground", {"objects.0.velocity": [2.9e8, 0]}),
    ("ground", {"array.spacing": MOST_SPACING}),
    ("ground", {"filter.velocity_prior": 2.9e8, "filter.velocity_std": 2.9e8}),
    ("ground", {"coverage.width": MOST["number"]}),
    ("paper-multi", {"uav.altimeter_std": MOST_HEIGHT_STD}),
    ("paper-multi", {"radar.pulse_length": MOST_PULSE, "truth.altitude_errors": True}),
    ("paper-multi", {"frame.slot": LEAST}),
    ("paper-multi", {"radar.rcs": [MOST["number"], 0]}),
    ("paper-multi", {"objects.0.angle": 1.1 * 100.0 / MOST["length"]}),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "changes"), EDGES)
def test_runs_at_the_limits_have_no_infinities(name, changes):
    short = {"frame.frames": 1, "frame.slots_per_frame": 3, **changes}
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        result = eb.simulate(load_scenario(name, short), ["temporal"], trials=1, progress=False)
        eb.summary(result)
    assert np.isfinite(result.rate).all()
    assert (result.rate >= 0.0).all()
