"""Echoes of the standard's targets in runs: strength by hand, headings, what schemes are given."""

from __future__ import annotations

import numpy as np
import pytest

import echobeam as eb
from echobeam.physics.aspect import OnGround
from echobeam.physics.plane import GROUND_GEOMETRY
from echobeam.physics.targets import TARGETS
from echobeam.scenario.checking import ScenarioError
from echobeam.simulation.headings import headings
from echobeam.simulation.movers import Ground, standing_headings
from echobeam.simulation.scene import scene_of
from echobeam.simulation.world import begin
from echobeam.traces import TraceMotion
from echobeam.values import NOBODY, UavState

MEAN, STD = 11.25, 3.41
"""The vehicle's 10 lg(sigma_M), dBsm, and its deviation, dB."""

FRONT = (71.75, 29.13, 15.52, 8.45)
BACK = (79.65, 36.73, 14.56, 7.50)
ROOF = (0.0, 18.13, 21.26, 14.19)
"""theta_center, theta_3dB, G_max, sigma_max of the vehicle's rows, TR 38.901 table 7.9.2.1-4."""


def by_hand(angle, velocity):
    """Return sigma_D of a vehicle on the road: from ahead, from behind or from above."""
    zenith = np.abs(90.0 - np.degrees(angle))
    towards = (np.cos(angle) > 0.0) == (velocity < 0.0)  # it approaches the UAV: its front
    rows = [
        peak - np.minimum(12.0 * ((zenith - centre) / width) ** 2, depth)
        for centre, width, peak, depth in (FRONT, BACK, ROOF)
    ]
    level = np.where(zenith < 30.0, rows[2], np.where(towards, rows[0], rows[1]))
    return 10.0 ** (0.1 * (level - MEAN))


def run(name, target, schemes=("omni",), trials=50, **changes):
    scenario = eb.load_scenario(name).replace({"radar.target": target, **changes})
    return eb.simulate(scenario, list(schemes), trials=trials, seed=4, progress=False)


def strengths(result):
    """Return the echo's SNR over that of the mean cross-section, in omnidirectional slots."""
    distance = result["truth"].sel(state="distance").values
    mean = 10.0 * 120.0**2 * 2.0 / distance**4  # Eq. (14) with the paper's numbers
    return result["radar_snr"].values / mean


def test_the_echo_is_that_of_aspect_and_law():
    """Strengths over sigma_D are log-normal: mu and s of their decibels, 4.5 standard errors."""
    result = run("paper-multi", "3gpp-vehicle", trials=400)
    angle, _, velocity = np.moveaxis(result["truth"].values, -1, 0)
    drawn = 10.0 * np.log10(strengths(result)[0] / by_hand(angle, velocity))
    count = drawn.size
    mu = -np.log(10.0) / 20.0 * STD**2
    assert abs(drawn.mean() - mu) < 4.5 * STD / np.sqrt(count)
    assert abs(drawn.std() - STD) < 4.5 * STD / np.sqrt(2 * count)
    assert drawn.max() <= mu + 3.0 * STD + 1e-9
    flat = drawn.reshape(400, -1)
    assert np.unique(np.round(flat, 9)).size > 0.99 * count  # anew for each object and slot
    correlation = np.corrcoef(flat.T) - np.eye(flat.shape[1])
    assert np.abs(correlation).max() < 4.5 / np.sqrt(400)


@pytest.mark.parametrize("target", ["3gpp-vehicle", "3gpp-human", "swerling1"])
def test_all_schemes_meet_the_same_luck_however_the_work_is_split(target):
    schemes = ("omni", "omni:velocity_prior=20")
    whole = run("paper-multi", target, schemes, trials=6)
    np.testing.assert_array_equal(*strengths(whole))
    few = run("paper-multi", target, schemes, trials=3)
    np.testing.assert_array_equal(whole["radar_snr"][:, :3], few["radar_snr"])


def test_targets_without_an_aspect_are_alike_from_all_sides():
    small, human = (run("paper-multi", f"3gpp-{name}") for name in ("small-uav", "human"))
    decibels = [10.0 * np.log10(strengths(one)) for one in (small, human)]
    # the same draw g: 10 lg sigma_S = mu + s g
    draws = [
        (one + np.log(10.0) / 20.0 * std**2) / std
        for one, std in zip(decibels, (3.74, 3.94), strict=True)
    ]
    np.testing.assert_allclose(draws[0], draws[1], atol=1e-9)


@pytest.mark.slow
def test_swerling_one_is_a_target_as_well_and_the_default_is_constant():
    one = run("paper-multi", "swerling1", ("temporal",), trials=4)
    other = run("paper-multi", "constant", ("temporal",), trials=4,
                **{"radar.fluctuation": "swerling1"})  # fmt: skip
    for name in ("radar_snr", "measured", "rate", "measured_var"):
        np.testing.assert_array_equal(one[name], other[name])
    np.testing.assert_allclose(strengths(run("paper-multi", "constant")), 1.0, rtol=1e-12)


def test_a_scheme_is_given_the_variance_at_the_aspect_that_it_predicts():
    """Eq. (20) solved for the SNR: sigma_D at the prediction, not at the truth, times the strength.

    The strength that nature drew follows from the echo and the true aspect.
    """
    result = run("paper-multi", "3gpp-vehicle", trials=200)
    angle, _, velocity = np.moveaxis(result["truth"].values, -1, 0)
    drawn = strengths(result)[0] / by_hand(angle, velocity)
    predicted = result["predicted"].values[0]
    stated = result["measured_var"].sel(measurement="delay").values[0]
    known = np.isfinite(predicted[..., 0])
    theta, distance, speed = np.moveaxis(predicted, -1, 0)
    snr = 1.0 / (30 * 30 * 80e6**2 * stated)
    aspect = snr * distance**4 / (10.0 * 120.0**2 * 2.0) / drawn
    np.testing.assert_allclose(aspect[known], by_hand(theta, speed)[known], rtol=1e-9)
    wrong = np.broadcast_to((speed < 0) != (velocity < 0), known.shape)[known]
    assert 0.05 < wrong.mean() < 0.6  # the first Doppler leaves the heading open


@pytest.mark.slow
def test_the_receiver_of_signals_states_the_variance_of_the_echo():
    """At high SNR the stated deviations follow the cross-section, with the same noise."""
    strong = {"radio.power": 3e9, "frame.slots_per_frame": 3}
    vehicle, constant = (
        run("paper-signal", target, trials=6, **strong) for target in ("3gpp-vehicle", "constant")
    )
    gain = strengths(vehicle) / strengths(constant)
    stated = [one["measured_var"].sel(measurement="delay").values for one in (constant, vehicle)]
    assert np.isfinite(stated).all()
    np.testing.assert_allclose(stated[0] / stated[1], gain, rtol=0.03)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scenario", "target"), [("arrivals", "3gpp-vehicle"), ("traffic", "3gpp-agv")]
)
def test_unlabelled_and_traced_runs_reach_the_end(scenario, target):
    """No echo is NaN where somebody is."""
    result = run(scenario, target, ("temporal",), trials=2)
    there = result["present"].values
    assert np.isfinite(result["radar_snr"].values[0][there]).all()


def test_an_object_at_rest_is_refused_where_it_needs_a_heading():
    scenario = eb.load_scenario("paper-multi").replace({"objects.1.velocity": 0.0})
    for target in ("3gpp-vehicle", "3gpp-large-uav", "3gpp-agv"):
        with pytest.raises(ScenarioError, match=r"objects\.1\.velocity.*heading.*3gpp-human"):
            scenario.replace({"radar.target": target})
    for target in ("3gpp-human", "3gpp-small-uav", "swerling1", "constant"):
        scenario.replace({"radar.target": target})


def test_contradictions_and_unknown_targets_are_refused():
    scenario = eb.load_scenario("paper-multi")
    with pytest.raises(ScenarioError, match=r"radar\.target: 'car'.*3gpp-vehicle"):
        scenario.replace({"radar.target": "car"})
    with pytest.raises(ScenarioError, match=r"radar\.fluctuation: 'swerling1' contradicts"):
        scenario.replace({"radar.target": "3gpp-human", "radar.fluctuation": "swerling1"})


def ground_of(velocity, identity):
    velocity = np.array(velocity, dtype=float)[None]
    return Ground(np.zeros_like(velocity), velocity, np.array(identity))


class Standing:
    """A mover of objects that stand in one direction each."""

    def __init__(self, *directions):
        self.directions = np.array(directions, dtype=float)

    def standing(self, slot):
        return self.directions


def test_an_object_at_rest_has_its_last_heading_and_at_first_that_of_its_mover():
    first = ground_of([[-3, 0, 0], [0, 0, 0], [np.nan] * 3], [4, 7, NOBODY])
    mover = Standing([0, 9, 0], [0, 0, 9], [9, 9, 9])
    one = headings(first, first.identity, None, mover, 0)
    np.testing.assert_array_equal(one[0], [[-3, 0, 0], [0, 0, 9], [np.nan] * 3])
    moved = ground_of([[0, 0, 0], [0, 0, 0], [0, 0, 0]], [NOBODY, 9, 4])
    two = headings(moved, first.identity, one, mover, 1)
    np.testing.assert_array_equal(two[0, 1:], [[0, 0, 9], [-3, 0, 0]])
    on = ground_of([[0, 2, 0]], [4])
    assert headings(on, moved.identity, two, Standing([1, 0, 0]), 2) is on.velocity


def described(path, **changes):
    scenario = eb.load_scenario(
        "ground", {"objects": [{"path": path}], "radar.target": "3gpp-vehicle", **changes}
    )
    return eb.describe(scenario).objects[0].cross_section


@pytest.mark.parametrize("way", [(0.0, 10.0), (0.0, -10.0), (-3.0, 5.0)])
def test_an_object_that_waits_has_the_heading_of_its_first_motion(way):
    """The same echo as that of one that drives off at once, and no other than its own heading's."""
    place = np.array([10.0, 200.0])
    end = (place + way).tolist()
    waits = [[0, *place.tolist()], [0.02, *place.tolist()], [1, *end]]
    found = described(waits)
    assert found == pytest.approx(described([[0, *place.tolist()], [1, *end]]), rel=1e-12)
    state = np.array([[*place, *way]])
    at = GROUND_GEOMETRY.place(state, UavState(np.array([0.0, 0.0, 100.0]), np.zeros(3)))
    assert found == pytest.approx(float(OnGround(TARGETS["3gpp-vehicle"]).relative(at)[0]))


def test_an_object_that_comes_late_to_its_path_stands_as_it_drives_next_or_has_driven():
    path = [[0, 0, 0], [1, 10, 0], [2, 10, 0], [3, 10, -5]]
    mover = scene_of(eb.load_scenario("ground", {"objects": [{"path": path}]})).mover
    for time, expected in ((0.5, [10, 0, 0]), (1.5, [0, -5, 0]), (3.5, [0, -5, 0])):
        slot = round(time / mover.slot_duration)
        np.testing.assert_array_equal(mover.standing(slot), [expected])


def test_a_vehicle_of_a_trace_stands_as_it_drove_or_as_the_whole_trace_says():
    """Columns change hands, a vehicle comes back, and one never moves; by hand."""
    n = np.nan
    identity = np.array([[0, 1], [0, 1], [0, 1], [2, 0], [2, 0], [-1, 2]])
    velocity = np.array([
        [[0, 0], [0, 0]], [[0, 3], [0, 0]], [[0, 0], [0, 0]],
        [[0, 0], [0, 0]], [[-1, 2], [4, 0]], [[n, n], [0, 0]],
    ])  # fmt: skip
    present = identity >= 0
    stands = np.array([[0.0, 9.0], [0.0, 0.0], [-9.0, 0.0]])
    motion = TraceMotion(identity, velocity, velocity, present, ("a", "b", "c"), stands)
    found = standing_headings(motion)
    drove, still, late = [0, 3, 0], [1, 0, 0], [-1, 2, 0]
    np.testing.assert_array_equal(found, [
        [[0, 9, 0], still], [drove, still], [drove, still],
        [[-9, 0, 0], drove], [late, [4, 0, 0]], [still, late],
    ])  # fmt: skip
    road = TraceMotion(
        identity, velocity[..., 1], velocity[..., 1], present, ("a", "b", "c"), stands[:, :1]
    )
    found = standing_headings(road)
    np.testing.assert_array_equal(found[[0, 3]], [[still, still], [[-9, 0, 0], [3, 0, 0]]])
    nobody = TraceMotion(
        identity[:, :0], velocity[:, :0], velocity[:, :0], present[:, :0], (), stands[:0]
    )
    assert standing_headings(nobody).shape == (6, 0, 3)


STANDS = """t,id,x,y
0,late,10,50
1,late,10,50
2,late,10,45
3,late,10,30
4,late,10,10
0,early,-10,-50
1,early,-7,-46
2,early,-4,-42
3,early,-4,-42
4,early,-4,-42
0,never,30,30
4,never,30,30
"""


@pytest.mark.parametrize(
    ("start", "places"), [(0.0, {"late": (0, -1)}), (3.2, {"early": (3, 4), "never": (1, 0)})]
)
def test_a_standing_vehicle_of_a_trace_has_a_heading_beyond_the_run(tmp_path, start, places):
    """It moves a second after the run, or has moved a second before."""
    (tmp_path / "stands.csv").write_text(STANDS)
    scenario = eb.load_scenario("ground-traffic", {
        "trace.file": str(tmp_path / "stands.csv"), "trace.origin": [0, 0], "trace.start": start,
        "frame.frames": 1, "frame.slots_per_frame": 2,
    })  # fmt: skip
    world = begin(scene_of(scenario), 0, range(1))
    for name, way in places.items():
        column = list(world.identity).index(world.scene.mover.names.index(name))
        heading = world.heading[0, column, :2]
        np.testing.assert_allclose(heading / np.hypot(*heading), np.array(way) / np.hypot(*way),
                                   atol=0.1)  # fmt: skip


def test_an_object_that_stops_keeps_its_heading():
    """It brakes to exactly zero after four slots and drives back: back, then front."""
    changes = {"objects.0.velocity": 1.0, "objects.0.acceleration": -25.0,
               "objects.0.angle": "25 deg"}  # fmt: skip
    result = run("paper-single", "3gpp-vehicle", trials=2, **changes)
    velocity = result["truth"].values[0, :, 0, 2]
    rest = np.flatnonzero(velocity == 0.0)
    assert rest.size == 1
    human = run("paper-single", "3gpp-human", trials=2, **changes)
    draws = (10.0 * np.log10(strengths(human)) + np.log(10.0) / 20.0 * 3.94**2) / 3.94
    own = 10.0 ** (0.1 * (STD * draws - np.log(10.0) / 20.0 * STD**2))
    found = strengths(result) / own
    angle = result["truth"].values[..., 0]
    heading = np.where(np.arange(velocity.size) <= rest[0], 1.0, -1.0)[:, None]
    np.testing.assert_allclose(found[0], by_hand(angle, heading), rtol=1e-9)


def test_a_description_has_the_cross_section_of_the_first_slot():
    scenario = eb.load_scenario("paper-height")
    constant, vehicle = (
        eb.describe(scenario, set={"radar.target": target}).objects[0]
        for target in ("constant", "3gpp-vehicle")
    )
    expected = float(by_hand(np.radians(45.0), 30.0))
    assert constant.cross_section == 1.0
    assert vehicle.cross_section == pytest.approx(expected)
    assert 10.0 * np.log10(expected) + MEAN == pytest.approx(7.06)  # dBsm: from behind, the floor
    for name in ("omni_echo", "beam_echo"):
        ratio = getattr(vehicle, name).snr / getattr(constant, name).snr
        assert ratio == pytest.approx(expected)


def test_the_downlink_and_the_motion_do_not_depend_on_the_target():
    """Slot 1 has the same rates; later beams follow from other measurements."""
    one, other = (run("paper-height", target, ("temporal",), trials=5)
                  for target in ("constant", "3gpp-vehicle"))  # fmt: skip
    np.testing.assert_array_equal(one["rate"][:, :, 0], other["rate"][:, :, 0])
    np.testing.assert_array_equal(one["truth"], other["truth"])
    assert not np.array_equal(one["rate"][:, :, 5], other["rate"][:, :, 5])


def test_on_the_ground_the_echo_has_the_aspect_of_position_and_heading():
    """Against the human's echo, of the same draws: sigma_D in coordinates turned by hand."""
    human, vehicle = (run("ground", target, ("omni",), trials=20)
                      for target in ("3gpp-human", "3gpp-vehicle"))  # fmt: skip
    constant = run("ground", "constant", ("omni",), trials=20)
    draws = [10.0 * np.log10(one["radar_snr"].values / constant["radar_snr"].values)[0]
             for one in (human, vehicle)]  # fmt: skip
    normal = (draws[0] + np.log(10.0) / 20.0 * 3.94**2) / 3.94
    found = draws[1] - (STD * normal - np.log(10.0) / 20.0 * STD**2) + MEAN
    state = vehicle["truth"].values
    apart = np.array([0.0, 0.0]) - state[..., :2]  # the UAV hovers over the origin
    turn = np.arctan2(state[..., 3], state[..., 2])
    azimuth = np.degrees(np.arctan2(apart[..., 1], apart[..., 0]) - turn) % 360.0
    zenith = np.degrees(np.arctan2(np.hypot(apart[..., 0], apart[..., 1]), 100.0))
    assert (zenith > 30.0).any()
    rows = {0.0: (40.54, *FRONT), 90.0: (26.90, 79.70, 44.42, 20.75, 13.68),
            180.0: (36.32, *BACK), 270.0: (26.90, 79.70, 44.42, 20.75, 13.68)}  # fmt: skip
    expected = np.full(zenith.shape, np.nan)
    for centre, (width, middle, spread, peak, depth) in rows.items():
        off = (azimuth - centre + 180.0) % 360.0 - 180.0
        loss = np.minimum(12.0 * (off / width) ** 2, depth)
        loss = loss + np.minimum(12.0 * ((zenith - middle) / spread) ** 2, depth)
        side = (off >= -45.0) & (off < 45.0)
        expected = np.where(side, peak - np.minimum(loss, depth), expected)
    roof = ROOF[2] - np.minimum(12.0 * (zenith / ROOF[1]) ** 2, ROOF[3])
    expected = np.where(zenith < 30.0, roof, expected)
    np.testing.assert_allclose(found, expected, atol=1e-8)


def test_on_the_ground_an_object_at_rest_is_refused_as_well():
    scenario = eb.load_scenario("ground")
    stays = {"radar.target": "3gpp-vehicle", "objects": [{"path": [[0, 1, 2], [1, 1, 2]]}]}
    with pytest.raises(ScenarioError, match=r"objects\.0\.path: .*heading"):
        scenario.replace(stays)
    with pytest.raises(ScenarioError, match=r"objects\.0\.velocity.*heading"):
        scenario.replace({"radar.target": "3gpp-vehicle", "objects.0.velocity": [0.0, 0.0]})
