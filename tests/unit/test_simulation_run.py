import numpy as np
import pytest

import echobeam as eb
from echobeam.scenario import ScenarioError
from echobeam.simulation.blocks import cut
from echobeam.simulation.randomness import Stream, standard_normals
from echobeam.testing.conformance import small_scenario

SCHEMES = ["water-filling", "omni", "pilot-needle"]


def test_draws_depend_on_seed_trial_and_stream_alone():
    shape = (5, 2, 3)
    together = standard_normals(7, range(10), Stream.MEASUREMENT, shape)
    np.testing.assert_array_equal(
        together[4:6], standard_normals(7, [4, 5], Stream.MEASUREMENT, shape)
    )
    np.testing.assert_array_equal(
        together[3, :2], standard_normals(7, [3], Stream.MEASUREMENT, (2, 2, 3))[0]
    )
    others = [
        standard_normals(8, range(10), Stream.MEASUREMENT, shape),
        standard_normals(7, range(10), Stream.PROCESS, shape),
        standard_normals(7, range(10, 20), Stream.MEASUREMENT, shape),
    ]
    for other in others:
        assert not np.isin(other, together).any()


def test_draws_are_standard_normal():
    """Mean and variance of 60000 draws within 4.5 sigma (false alarm below 1e-5)."""
    z = standard_normals(0, range(1000), Stream.MEASUREMENT, (10, 2, 3)).ravel()
    assert abs(z.mean()) < 4.5 / np.sqrt(z.size)
    assert abs(z.var() - 1) < 4.5 * np.sqrt(2 / z.size)


@pytest.mark.parametrize("trials", [1, 2, 127, 128, 129, 200, 1000])
def test_blocks_cover_every_trial_once(trials):
    blocks = cut(small_scenario(2), trials)
    assert [trial for block in blocks for trial in block] == list(range(trials))
    sizes = [len(block) for block in blocks]
    assert max(sizes) - min(sizes) <= 1


def test_same_seed_same_run_and_another_seed_another():
    one, same = (eb.simulate(small_scenario(2), SCHEMES, trials=3, seed=5) for _ in range(2))
    other = eb.simulate(small_scenario(2), SCHEMES, trials=3, seed=6)
    for name in one.data_vars:
        np.testing.assert_array_equal(one[name].values, same[name].values)
    assert not np.array_equal(one["measured"].values, other["measured"].values, equal_nan=True)


def test_schemes_meet_the_same_truth_and_luck():
    """A scheme's numbers do not depend on which others run; first measurements are common."""
    alone = eb.simulate(small_scenario(2), ["omni"], trials=4, seed=2)
    among = eb.simulate(small_scenario(2), SCHEMES, trials=4, seed=2)
    for name in ("rate", "measured", "estimated"):
        np.testing.assert_array_equal(alone[name].values[0], among[name].sel(scheme="omni").values)
    first = among["measured"].isel(slot=0)
    np.testing.assert_array_equal(
        first.sel(scheme="omni").values, first.sel(scheme="water-filling").values
    )


def test_slot_by_slot_is_the_same_run():
    result = eb.simulate(small_scenario(2), ["water-filling"], trials=2, seed=4)
    for trial in range(2):
        records = list(eb.slots(small_scenario(2), "water-filling", seed=4, trial=trial))
        found = result.sel(scheme="water-filling").isel(trial=trial)
        assert [record.phase for record in records] == found["phase"].values.tolist()
        for name in ("rate", "estimated", "measured"):
            stacked = np.stack([getattr(record, name) for record in records])
            np.testing.assert_allclose(stacked, found[name].values, rtol=1e-10)


def test_process_noise_moves_the_truth_with_the_filters_variance():
    """Steps of the truth around its own evolution have covariance Q_s (5 sigma of a chi-square)."""
    scenario = small_scenario(1).model_copy(
        update={"truth": small_scenario(1).truth.model_copy(update={"process_noise": True})}
    )
    quiet = eb.simulate(small_scenario(1), ["omni"], trials=1)["truth"].values
    noisy = eb.simulate(scenario, ["omni"], trials=500)["truth"].values
    step = (noisy[:, 1] - quiet[:, 1])[:, 0]
    std = [scenario.filter.angle_std, scenario.filter.distance_std, scenario.filter.velocity_std]
    ratio = step.var(axis=0) / np.square(std)
    assert (np.abs(ratio - 1) < 5 * np.sqrt(2 / 500)).all()


def test_no_objects_is_sensing_only():
    result = eb.simulate(small_scenario(0), SCHEMES, trials=2)
    assert result.sizes["object"] == 0
    assert result["rate"].shape == (3, 2, 8, 0)


def test_an_object_right_under_the_uav_runs():
    scenario = small_scenario(1)
    under = scenario.objects[0].model_copy(update={"angle": np.pi / 2, "velocity": 0.0})
    result = eb.simulate(
        scenario.model_copy(update={"objects": (under,)}), SCHEMES, trials=20, seed=1
    )
    assert np.isfinite(result["rate"].values).all()
    assert (result["measured_var"].sel(measurement="angle").values <= np.inf).all()


@pytest.mark.parametrize("trials", [0, -1, 2.5, True, "many"])
def test_a_number_of_trials_that_is_none_is_refused(trials):
    with pytest.raises(ScenarioError, match="whole number from 1"):
        eb.simulate(small_scenario(1), ["omni"], trials=trials)


@pytest.mark.parametrize("seed", [-1, 2**63, 0.5])
def test_a_seed_that_is_none_is_refused(seed):
    with pytest.raises(ScenarioError, match="seed"):
        eb.simulate(small_scenario(1), ["omni"], trials=1, seed=seed)


def test_every_variable_says_what_it_is():
    result = eb.simulate(small_scenario(1), ["omni"], trials=1)
    for variable in result.data_vars.values():
        assert variable.attrs["units"]
        assert variable.attrs["long_name"]
    assert set(result.attrs) == {"scenario", "seed", "echobeam_version", "created"}
