"""The tracker `ground` in runs: consistency in every slot, ground that is elsewhere, its report."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.stats import norm

import echobeam as eb
from echobeam.estimation.consistency import chi_square_band, nees
from echobeam.faults import InputError
from echobeam.physics import transmission
from echobeam.scenario import load_scenario
from echobeam.schemes.configure import configure
from echobeam.schemes.ground import GroundTracker, _recall_velocity
from echobeam.schemes.ground_report import reported
from echobeam.simulation.loop import run_slots
from echobeam.simulation.scene import scene_of
from echobeam.simulation.world import begin
from echobeam.tracking.ground import polar_of
from echobeam.tracking.road_shape import POINTS, REACH, gaussian_shape
from echobeam.values import GaussianState, UavState

GROUND = "water-filling:tracker=ground"
HARD = [(60, 100, 1.0), (45, 110, 1.0), (75, 140, 1.0), (45, 140, 0.3)]
"""Angle and height of the object at first, and P_T."""
DRAWN = {"truth.altitude_errors": True}


def records(scheme, place, trials=200, seed=1, **changes):
    return followed(scheme, place, trials, seed, **changes)[0]


@dataclass(frozen=True)
class Following:
    """A tracker whose posteriors are noted down."""

    tracker: GroundTracker
    noted: list

    parameters = GroundTracker.parameters

    def start(self, view):
        return self.tracker.start(view)

    def predict(self, belief, view):
        return self.tracker.predict(belief, view)

    def update(self, prior, detections, view):
        self.noted.append(self.tracker.update(prior, detections, view))
        return self.noted[-1]


def followed(scheme, place, trials=200, seed=1, **changes):
    """Records of all slots, and the tracker's own beliefs."""
    angle, height, power = place
    start = {"objects.0.angle": f"{angle} deg", "uav.height": f"{height} m", "radio.power": power}
    scenario = load_scenario("paper-single", start | changes)
    made, noted = configure(scenario, scheme), []
    if isinstance(made.scheme.tracker, GroundTracker):
        tracker = Following(made.scheme.tracker, noted)
        made = replace(made, scheme=replace(made.scheme, tracker=tracker))
    return list(run_slots(begin(scene_of(scenario), seed, range(trials)), made)), noted


def rates(made):
    return np.mean([record.rate.sum(axis=-1) for record in made], axis=0)


def errors(made, only=slice(None)):
    """Normalised squared errors ``(slots, T)``."""
    return np.array(
        [
            nees(
                (record.estimated - record.truth)[:, 0, only],
                record.estimated_cov[:, 0, only, only],
                (0,),
            )
            for record in made
        ]
    )


@pytest.mark.slow
@pytest.mark.parametrize("place", HARD)
def test_report_and_state_are_consistent_in_every_slot(place):
    """Heights drawn from the stated law: inside their 99.9 % bands, the altitude error included."""
    made, beliefs = followed(GROUND, place, trials=500, **DRAWN)
    low, high = chi_square_band(3, 500, 0.999)
    true = [
        np.stack([one.position[:, 0, 0], one.truth[:, 0, 2], -one.position[:, 0, 2]], axis=-1)
        for one in made
    ]
    own = [
        nees(belief.state.mean[:, 0] - state, belief.state.cov[:, 0], ())
        for belief, state in zip(beliefs, true, strict=True)
    ]
    for found in (errors(made), own):
        mean = np.mean(found, axis=1)
        assert (mean > low).all()
        assert (mean < high).all()


@pytest.mark.slow
@pytest.mark.parametrize("place", HARD)
def test_on_flat_ground_it_is_not_overconfident_and_loses_nobody(place):
    """The altimeter is exact then, better than the filter thinks; no lower end is asked for."""
    made = records(GROUND, place)
    assert (errors(made).mean(axis=1) < chi_square_band(3, 200, 0.999)[1]).all()
    assert all(np.isfinite(record.estimated).all() for record in made)


@pytest.mark.slow
@pytest.mark.parametrize("place", HARD)
def test_it_serves_better_than_the_filter_without_ground(place):
    ground, without = (rates(records(scheme, place)) for scheme in (GROUND, "water-filling"))
    assert ground.mean() > 1.05 * without.mean()
    assert np.quantile(ground, 0.05) > np.quantile(without, 0.05)


@pytest.mark.slow
@pytest.mark.parametrize("place", HARD)
@pytest.mark.parametrize("height", [5.0, -5.0])
def test_ground_five_metres_elsewhere_costs_rate_and_no_track(place, height):
    """Seven stated deviations, and unmodelled: still no worse than without the ground.

    The position is no further off than the exact distance and the wrong height would put it, or
    than the point below the UAV: near 90 degrees the array measures no angle to contradict.
    """
    raised = {"truth.terrain": height}
    made = records(GROUND, place, **raised)
    unaided = np.quantile(rates(records("water-filling", place, **raised)), 0.05)
    assert np.quantile(rates(made), 0.05) > unaided
    last = made[-1]
    found, truth = (
        state[:, 0, 1] * np.cos(state[:, 0, 0]) for state in (last.estimated, last.truth)
    )
    square = last.truth[:, 0, 1] ** 2 - last.uav_position[2] ** 2
    misled = np.abs(np.sqrt(np.maximum(square, 0.0)) - truth)
    bound = np.maximum(misled, np.abs(truth)) if place[0] > 70 else misled
    assert np.isfinite(found).all()
    assert np.median(np.abs(found - truth)) < np.median(bound)
    stubborn = records(f"{GROUND},adaptive=false", place, **raised)
    assert errors(made)[-1].mean() < errors(stubborn)[-1].mean()


@pytest.mark.slow
@pytest.mark.parametrize(
    "scheme",
    [f"{GROUND},motion=imm", "pilot:tracker=ground"],  # either motion, and frames of either kind
)
def test_it_keeps_the_rules_of_a_scheme(scheme):
    eb.testing.check_scheme(scheme)


@pytest.mark.parametrize(
    "changes",
    [
        {"radar.variance": "known"},
        {"radar.crb": "exact"},
        {"radar.fluctuation": "swerling1"},
        {"array.axis": "horizontal"},
        {"uav.altimeter_std": 0, "uav.terrain_std": 0},
        {"radio.power": 1e5},
    ],
)
@pytest.mark.slow
def test_it_is_not_overconfident_with_other_equipment(changes):
    made = records(GROUND, (60, 100, 1.0), trials=100, **changes)
    found = errors(made, slice(0, 3, 2))  # angle and velocity: the height may be known exactly
    assert (np.nanmean(found, axis=1) < chi_square_band(2, 100, 0.999)[1]).all()
    assert np.isfinite(made[-1].estimated).all()


@pytest.mark.slow
def test_many_points_tell_no_more():
    few, many = (
        np.mean(rates(records(f"{GROUND},points={points}", (60, 100, 1.0), trials=100)))
        for points in (32, 200)
    )
    assert few == pytest.approx(many, rel=2e-3)


@pytest.mark.slow
def test_two_objects_on_both_sides_are_tracked():
    scenario = load_scenario("paper-multi")
    made = list(run_slots(begin(scene_of(scenario), 3, range(100)), configure(scenario, GROUND)))
    off = np.abs(made[-1].estimated - made[-1].truth)
    assert (np.median(off[..., 0], axis=0) < np.radians(0.5)).all()


def belief(mean, root):
    root = np.array(root)
    return GaussianState(np.array([[mean]]), (root @ root.T)[None, None], np.array([[True]]))


def test_the_report_has_the_moments_of_draws():
    """Position, velocity and height through the geometry, 400,000 times."""
    uav = UavState(np.array([3.0, 0.0, 90.0]), np.zeros(3))
    state = belief([45.0, 12.0, 0.4], [[4.0, 0.0, 0.0], [3.0, 9.0, 0.0], [0.3, 0.0, 0.7]])
    draws = np.random.default_rng(9).multivariate_normal(state.mean[0, 0], state.cov[0, 0], 400_000)
    seen = polar_of(draws, uav)
    found = reported(state, uav, np.zeros((1, 1), dtype=np.int64))
    scale = seen.std(axis=0)
    np.testing.assert_allclose((found.mean[0, 0] - seen.mean(axis=0)) / scale, 0.0, atol=6e-3)
    relative = (found.cov[0, 0] - np.cov(seen.T)) / np.outer(scale, scale)
    np.testing.assert_allclose(relative, 0.0, atol=1e-2)


@pytest.mark.parametrize("one_side", [False, True])
def test_the_report_of_two_sides_has_the_moments_of_draws(one_side):
    """A normal over 40 m and one at its mirror image, with shares of 0.8 and 0.2."""
    uav = UavState(np.array([3.0, 0.0, 90.0]), np.zeros(3))
    rng = np.random.default_rng(3)
    x = np.where(rng.random(400_000) < 0.8, 40.0, -40.0) + 4.0 * rng.standard_normal(400_000)
    draws = np.stack([3.0 + x, *([[20.0], [0.7]] * rng.standard_normal((2, 400_000)))], axis=-1)
    state = belief(draws.mean(axis=0), np.diag(draws.std(axis=0)))
    shape = gaussian_shape((1, 1))
    std = draws[:, 0].std()
    u = np.linspace(-REACH, REACH, POINTS)
    at = draws[:, 0].mean() + std * u - 3.0
    density = 0.8 * norm.pdf(at, 40.0, 4.0) + 0.2 * norm.pdf(at, -40.0, 4.0)
    shape.log_ratio[0, 0] = np.log(density * std / norm.pdf(u))
    found = reported(state, uav, np.zeros((1, 1), dtype=np.int64), shape, one_side=one_side)
    if one_side:
        draws[:, 0] = 3.0 + np.abs(x)
    seen = polar_of(draws, uav)
    scale = seen.std(axis=0)
    np.testing.assert_allclose((found.mean[0, 0] - seen.mean(axis=0)) / scale, 0.0, atol=2e-2)
    relative = (found.cov[0, 0] - np.cov(seen.T)) / np.outer(scale, scale)
    np.testing.assert_allclose(relative, 0.0, atol=3e-2)


def test_a_place_above_the_uav_is_no_report():
    uav = UavState(np.array([0.0, 0.0, 2.0]), np.zeros(3))
    state = belief([4.0, 0.0, -3.0], np.diag([0.1, 1.0, 0.1]))
    assert not reported(state, uav, np.zeros((1, 1), dtype=np.int64)).known.any()


@pytest.mark.parametrize("along", [False, True])
def test_the_echo_of_many_directions_is_that_of_each(along):
    """Of beams, an omnidirectional slot and both together."""
    law = scene_of(load_scenario("paper-single")).law
    rng = np.random.default_rng(4)
    beams = rng.standard_normal((2, 3, 30)) + 1j * rng.standard_normal((2, 3, 30))
    state = np.stack(
        [rng.uniform(0.1, 3.0, (2, 50)), rng.uniform(80, 200, (2, 50)), np.zeros((2, 50))], axis=-1
    )
    state[0, 0] = np.nan
    omni = transmission.omni(np.ones((2, 3), dtype=bool), 2.0, 30)
    narrow = transmission.directional(beams)
    for sent in (omni, narrow, replace(narrow, probing=omni.antenna_power.sum(axis=-2))):
        snr = law.snr(sent, state, along=along)
        single = [law.snr(sent, state[:, [k]]) for k in range(50)]
        np.testing.assert_allclose(snr, np.concatenate(single, axis=1), rtol=1e-9)


BRAKING = {
    "objects.0.velocity": "20 m/s",
    "objects.0.acceleration": "-6 m/s^2",
    "frame.frames": 3,
}


@pytest.mark.slow
@pytest.mark.parametrize("motion", ["ca", "imm"])
def test_a_braking_object_is_followed_better_with_an_acceleration(motion):
    """At high power: half the error of the velocity after 300 ms, and not overconfident.

    Constant velocity with a small noise is: the object loses 0.06 m/s in a slot.
    """
    place, low = (60, 100, 1e4), f"{GROUND},velocity_std=0.005"

    def velocity(made):
        return np.sqrt(np.mean((made[-1].estimated - made[-1].truth)[:, 0, 2] ** 2))

    plain, made = (
        records(scheme, place, **BRAKING, **DRAWN)
        for scheme in (GROUND, f"{GROUND},motion={motion}")
    )
    assert velocity(made) < 0.5 * velocity(plain)
    upper = chi_square_band(3, 200, 0.999)[1]
    assert errors(made)[-1].mean() < upper
    assert errors(records(low, place, **BRAKING, **DRAWN))[-1].mean() > upper


@pytest.mark.slow
def test_models_of_motion_do_not_matter_where_they_cannot_be_told_apart():
    """At P_T = 1 a frame of 100 ms does not show an acceleration: rates within 1e-3."""
    place = (60, 100, 1.0)
    rate = [
        rates(records(f"{GROUND},motion={motion}", place)).mean() for motion in ("cv", "ca", "imm")
    ]
    assert rate[1:] == pytest.approx([rate[0]] * 2, rel=1e-3)


def test_a_track_that_begins_anew_recalls_its_velocity():
    """Its velocity, with five times the deviation, times the density of the new state: products."""
    rng = np.random.default_rng(6)
    mean, root = rng.standard_normal((2, 3)), rng.standard_normal((2, 3, 3))
    cov = root @ np.swapaxes(root, -1, -2)
    past_mean, past_cov = np.full((2, 3), np.nan), np.full((2, 3, 3), np.nan)
    past_mean[0], past_cov[0] = [0.0, 4.0, 0.0], np.diag([1.0, 0.09, 1.0])
    told = np.zeros((3, 3))
    told[1, 1] = 1.0 / (25.0 * 0.09)
    information = np.linalg.inv(cov[0]) + told
    expected = np.linalg.solve(information, np.linalg.solve(cov[0], mean[0]) + told @ past_mean[0])
    found_mean, found_cov = mean.copy(), cov.copy()
    _recall_velocity(found_mean, found_cov, past_mean, past_cov)
    np.testing.assert_allclose(found_mean[0], expected, rtol=1e-9)
    np.testing.assert_allclose(found_cov[0], np.linalg.inv(information), rtol=1e-9)
    np.testing.assert_array_equal(found_mean[1], mean[1])  # a new one, without a past
    np.testing.assert_array_equal(found_cov[1], cov[1])


@pytest.mark.slow
@pytest.mark.parametrize("place", HARD[:3])
def test_the_innovation_test_pays_on_wrong_ground_and_costs_nothing_on_right_ground(place):
    found = {}
    for height in (0.0, 5.0, -5.0):
        for adaptive in ("true", "false"):
            scheme = f"{GROUND},adaptive={adaptive}"
            found[height, adaptive] = rates(records(scheme, place, **{"truth.terrain": height}))
    assert found[0.0, "true"].mean() > 0.998 * found[0.0, "false"].mean()
    for height in (5.0, -5.0):
        assert found[height, "true"].mean() > 1.03 * found[height, "false"].mean()
        low = [np.quantile(found[height, adaptive], 0.05) for adaptive in ("true", "false")]
        assert low[0] > 0.98 * low[1]


def test_an_unknown_motion_is_refused():
    with pytest.raises(InputError, match="motion: 'jerk' is not accepted; expected one of cv, ca"):
        GroundTracker(motion="jerk")


@pytest.mark.parametrize("name", ["points", "first_points", "iterations"])
def test_too_few_are_refused(name):
    with pytest.raises(InputError, match=f"{name}: 0 is not accepted"):
        GroundTracker(**{name: 0})


def test_the_height_is_known_as_well_as_both_its_parts():
    scenario = load_scenario("paper-single", {"uav.altimeter_std": "3 m", "uav.terrain_std": "4 m"})
    assert scenario.uav.altitude_std == 5.0
    assert configure(scenario, GROUND).system.altitude_std == 5.0
