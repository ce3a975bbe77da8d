"""Height of the true ground: its law, common luck, and what it leaves alone."""

import numpy as np
import pytest
from scipy.stats import chi2

import echobeam as eb
from echobeam.scenario import ScenarioError, load_scenario
from echobeam.simulation.scene import scene_of
from echobeam.simulation.world import begin

TRIALS = 2000
ERRORS = {"truth.altitude_errors": True, "uav.altimeter_std": "3 m", "uav.terrain_std": "4 m"}


def heights(changes, seed=1, trials=TRIALS, slots=1, name="paper-multi"):
    """Heights ``(slots, T, K)`` of the objects in the first slots."""
    world = begin(scene_of(load_scenario(name, changes)), seed, range(trials))
    made = []
    for _ in range(slots):
        made.append(world.ground.position[..., 2])
        world = world.advance()
    return np.array(made)


def test_errors_have_the_law_of_their_deviations():
    """Sums of squares over sigma^2 in 99.9 % of chi-square: of sums and differences of objects.

    The altimeter's error is common to both objects and the terrain's is not, so (z1 + z2) / 2 has
    the variance sigma_a^2 + sigma_t^2 / 2 and (z1 - z2) / 2 that of sigma_t^2 / 2; they are
    independent.
    """
    z = heights(ERRORS)[0]
    common, apart = (z[:, 0] + z[:, 1]) / 2.0, (z[:, 0] - z[:, 1]) / 2.0
    low, high = chi2.ppf([0.0005, 0.9995], TRIALS)
    for values, variance in ((common, 9.0 + 8.0), (apart, 8.0)):
        assert low < np.sum(values**2) / variance < high
    assert abs(np.corrcoef(common, apart)[0, 1]) < 3.3 / np.sqrt(TRIALS)


def test_a_height_stays_and_has_draws_of_its_own():
    z = heights(ERRORS, trials=20, slots=5)
    np.testing.assert_array_equal(z, np.broadcast_to(z[0], z.shape))
    np.testing.assert_array_equal(z[0, :7], heights(ERRORS, trials=7)[0])  # more trials only add
    more = {**ERRORS, "objects": [{"angle": a} for a in (1.3, 2.4, 0.8)]}
    scenario = load_scenario("paper-multi").model_copy(update={"objects": more.pop("objects")})
    third = begin(scene_of(scenario.replace(more)), 1, range(20)).ground.position[..., 2]
    np.testing.assert_array_equal(third[:, :2], z[0])  # and so do more objects
    assert not np.array_equal(z[0], heights(ERRORS, seed=2, trials=20)[0])


def test_terrain_raises_all_objects_and_leaves_the_road_as_it_is():
    flat = begin(scene_of(load_scenario("paper-multi")), 1, range(3))
    raised = begin(scene_of(load_scenario("paper-multi", {"truth.terrain": "5 m"})), 1, range(3))
    np.testing.assert_array_equal(raised.ground.position[..., 2], 5.0)
    np.testing.assert_array_equal(raised.ground.position[..., :2], flat.ground.position[..., :2])
    angle, distance, _ = np.moveaxis(raised.state, -1, 0)
    np.testing.assert_allclose(distance * np.sin(angle), 95.0, rtol=1e-12)
    np.testing.assert_allclose(distance * np.cos(angle), flat.ground.position[..., 0], rtol=1e-12)
    both = heights(ERRORS | {"truth.terrain": "5 m"}, trials=9) - heights(ERRORS, trials=9)
    np.testing.assert_allclose(both, 5.0, rtol=1e-12)


@pytest.mark.parametrize("name", ["paper-single", "traffic"])
def test_all_schemes_meet_the_same_ground(name):
    changes = {"truth.altitude_errors": True, "truth.terrain": "-2 m", "frame.frames": 1}
    scenario = load_scenario(name, changes)
    result = eb.simulate(scenario, schemes=["water-filling", "pilot"], trials=3)
    alone = eb.simulate(scenario, schemes=["pilot"], trials=3)
    for name in ("truth", "position"):
        np.testing.assert_array_equal(result[name], alone[name])
    assert "scheme" not in result["position"].dims
    z = result["position"].sel(axis="z").values
    np.testing.assert_array_equal(np.isnan(z), ~result["present"].values)
    assert np.isfinite(z).any()
    # what the UAV knows of its own place does not change
    flat = scenario.replace({"truth.altitude_errors": False, "truth.terrain": 0.0})
    known = eb.simulate(flat, schemes=["pilot"], trials=1)["uav_position"]
    np.testing.assert_array_equal(result["uav_position"], known)


def test_a_scene_without_random_numbers_keeps_its_terrain():
    scenario = load_scenario("paper-single", ERRORS | {"truth.terrain": "5 m"})
    np.testing.assert_array_equal(
        begin(scene_of(scenario.calm), 1, range(4)).ground.position[..., 2], 5.0
    )


def test_ground_above_the_uav_is_refused():
    with pytest.raises(ScenarioError, match=r"truth\.terrain: 100 m .* below uav\.height, 100 m"):
        load_scenario("paper-single", {"truth.terrain": "100 m"})
