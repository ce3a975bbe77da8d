"""Scenarios on the ground: what is accepted, and one clear message for what is not."""

from __future__ import annotations

import pytest

from echobeam.scenario import ScenarioError, load_scenario

FAULTS = [
    ({"array.n_tx": 30}, "array.n_tx: 30 is not rows times columns, 8 x 8 = 64; leave it out"),
    ({"array.rows": 0}, "array.rows: 0 is not accepted; expected greater than or equal to 1"),
    ({"array": {"kind": "planar", "columns": 4}}, "array.rows: missing"),
    ({"array.n_rx": 12}, 'array.n_rx: not a key with array.kind = "planar"'),
    ({"array.facing": "up"}, "array.facing: 'up' is not accepted; expected 'down', 'ahead'"),
    ({"array.facing": [0, 0, 0]}, r"array.facing: \[0.0, 0.0, 0.0\] is no direction"),
    ({"array.polarisations": 3}, "array.polarisations: 3 is not accepted; expected 1 or 2"),
    ({"geometry": "space"}, "geometry: 'space' is not accepted; expected 'road' or 'ground'"),
    ({"uav.height": 80}, 'uav.height: not a key with geometry = "ground"; expected uav.position'),
    ({"uav": {}}, "uav: neither position nor waypoints"),
    ({"uav.waypoints": [[0, 0, 0, 9]]}, "uav: both position and waypoints"),
    ({"uav.position": [0, 0, -5]}, "uav.position: the UAV is -5 m high; expected it above"),
    ({"uav.velocity": [0, 0, -1001]}, "uav.velocity: the UAV is -0.1 m high at the end of the run"),
    ({"uav": {"waypoints": [[0, 0, 0, 9], [2, 0, 0, 0]]}}, "uav.waypoints.1: the UAV is 0 m high"),
    (
        {"uav": {"waypoints": [[0, 0, 0, 9], [0, 1, 0, 9]]}},
        "uav.waypoints: goes back in time, from 0 s to 0 s",
    ),
    ({"objects.0": {"velocity": [1, 2]}}, "objects.0: neither position nor path"),
    (
        {"objects.0": {"position": [1, 2], "path": [[0, 1, 2]]}},
        "objects.0: both position and path; expected one of the two",
    ),
    (
        {"objects.0": {"path": [[0, 1, 2], [3, 1, 2], [2, 5, 6]]}},
        "objects.0.path: goes back in time, from 3 s to 2 s",
    ),
    ({"objects.0": {"path": []}}, "objects.0.path: no points"),
    (
        {"objects.0": {"path": [[0, 1, 2]], "velocity": [1, 2]}},
        "objects.0.velocity: not together with a path",
    ),
    ({"objects.0.velocity": 5}, "objects.0.velocity: 5 is not accepted; expected two numbers"),
    ({"objects.0.velocity": [1, 2, 3]}, r"objects.0.velocity: \[1, 2, 3\] has 3 components"),
    ({"objects.0.angle": 1.0}, 'objects.0.angle: not a key with geometry = "ground"'),
    ({"filter.angle_std": 0.1}, 'filter.angle_std: not a key with geometry = "ground"'),
    (
        {"radar.model": "signal", "array.polarisations": 2},
        'array.polarisations: 2 is not accepted with radar.model = "signal"; expected 1',
    ),
    (
        {"radar.model": "signal", "radar.ground_clutter": 1.0},
        "radar.ground_clutter: 1 is not accepted",
    ),
]


@pytest.mark.parametrize(("changes", "message"), FAULTS)
def test_a_fault_is_one_clear_message(changes, message):
    with pytest.raises(ScenarioError, match=message) as caught:
        load_scenario("ground", changes)
    assert "\n" not in str(caught.value)
    assert "array: array" not in str(caught.value)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"uav.position": [0, 0, 9]}, 'uav.position: not a key with geometry = "road"'),
        ({"objects.0.position": [0, 9]}, 'objects.0.position: not a key with geometry = "road"'),
        ({"objects.0.velocity": [1, 2]}, "objects.0.velocity: .* expected one number"),
        ({"objects.0": {"velocity": 3}}, "objects.0.angle: missing"),
        ({"array": {"kind": "planar", "rows": 2, "columns": 2}}, "array.kind: .* needs geometry"),
        ({"array.facing": "ahead"}, 'array.facing: not a key with array.kind = "linear"'),
    ],
)
def test_a_road_has_no_keys_of_the_ground(changes, message):
    with pytest.raises(ScenarioError, match=message):
        load_scenario("paper-multi", changes)


@pytest.mark.parametrize(
    ("name", "changes", "message"),
    [
        ("ground-traffic", {"trace.road": [0, 0, 1, 0]}, "trace.road: not a key with geometry"),
        ("ground-traffic", {"trace.origin": 3}, "trace.origin: 3 .* expected two lengths, x and y"),
        (
            "ground-traffic",
            {"trace.origin": [1, 2, 3]},
            r"trace.origin: \[1, 2, 3\] has 3 components",
        ),
        ("traffic", {"trace.origin": [1, 2]}, r"trace.origin: \[1.0, 2.0\] .* expected one length"),
    ],
)
def test_a_trace_has_a_road_or_a_plane(name, changes, message):
    with pytest.raises(ScenarioError, match=message) as caught:
        load_scenario(name, changes)
    assert "\n" not in str(caught.value)


def test_sizes_follow_rows_and_columns():
    scenario = load_scenario("ground", {"array.rows": 4, "array.polarisations": 2})
    array = scenario.array
    assert (array.n_tx, array.receivers, array.weights) == (32, 32, 64)
    assert "n_tx" not in scenario.to_toml()
    own = scenario.replace({"array.receive_rows": 2, "array.receive_columns": 3})
    assert (own.array.n_tx, own.array.receivers) == (32, 6)
    assert scenario.array.model_copy(update={"spacing": 0.4}).n_tx == 32
