import numpy as np
import pytest
from scipy import stats

import echobeam as eb
from echobeam.scenario import ScenarioError
from echobeam.simulation.blocks import cut
from echobeam.simulation.randomness import SchemeNormals, Use, object_normals, scheme_key
from echobeam.testing.conformance import small_scenario

SCHEMES = ["water-filling", "omni", "pilot-needle"]


KEY = {"seed": 7, "slot": 3, "use": Use.MEASUREMENT}


def drawn(trials, objects=(0, 1), **changes):
    return object_normals(**{**KEY, **changes}, trials=trials, objects=np.array(objects), count=3)


def normals(seed, trials, slot, shape):
    return SchemeNormals(scheme_key(seed), trials, slot, Use.SCHEME)(shape)


def test_draws_depend_on_seed_trial_slot_use_and_object_alone():
    together = drawn(range(10))
    np.testing.assert_array_equal(together[4:6], drawn(range(4, 6)))
    np.testing.assert_array_equal(together[:, 1:], drawn(range(10), objects=(1,)))
    np.testing.assert_array_equal(together[:, ::-1], drawn(range(10), objects=(1, 0)))
    others = [
        drawn(range(10), seed=8),
        drawn(range(10), slot=4),
        drawn(range(10), use=Use.PROCESS),
        drawn(range(10), objects=(2, 3)),
        drawn(range(10, 20)),
        normals(7, range(10), 3, (2, 3)),
    ]
    for other in others:
        assert not np.isin(other, together).any()


def test_an_empty_column_draws_nothing():
    empty = drawn(range(4), objects=(-1, 5))
    np.testing.assert_array_equal(empty[:, 0], 0.0)
    assert (empty[:, 1] != 0.0).all()


def test_a_schemes_draws_depend_on_its_trial_alone_and_repeat():
    together = normals(0, range(5), 2, (4, 3))
    alone = normals(0, range(3, 4), 2, (4, 3))
    np.testing.assert_array_equal(together[3:4], alone)
    longer = normals(0, range(5), 2, (6, 3))
    np.testing.assert_array_equal(longer[:, :4], together)  # more draws only add some


@pytest.mark.parametrize(
    "z",
    [
        object_normals(0, range(10000), 0, Use.MEASUREMENT, np.arange(2), 3).ravel(),
        normals(0, range(60), 5, (1000,)).ravel(),
    ],
)
def test_draws_are_standard_normal(z):
    """Mean, variance and distribution of 60000 draws; false alarm below 1e-5 each."""
    assert abs(z.mean()) < 4.5 / np.sqrt(z.size)
    assert abs(z.var() - 1) < 4.5 * np.sqrt(2 / z.size)
    assert stats.kstest(z, "norm").pvalue > 1e-5


def test_neighbouring_keys_are_uncorrelated():
    """Successive slots, objects and components: correlations of 10000 within 4.5 sigma."""
    slots = [
        object_normals(0, range(10000), slot, Use.MEASUREMENT, np.arange(2), 3).reshape(10000, 6)
        for slot in (0, 1)
    ]
    correlation = np.corrcoef(np.concatenate(slots, axis=1), rowvar=False) - np.eye(12)
    assert np.abs(correlation).max() < 4.5 / np.sqrt(10000)


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
        assert [record.mode for record in records] == found["mode"].values.tolist()
        for name in ("rate", "estimated", "measured"):
            stacked = np.stack([getattr(record, name) for record in records])
            np.testing.assert_allclose(stacked, found[name].values, rtol=1e-10)


def test_process_noise_moves_the_object_on_its_road():
    """Steps have the conditional law of Q_s on the ground (5 sigma of a chi-square).

    The height is untouched; the variance along the road is the reciprocal of sin^2 / (d s_1)^2 +
    cos^2 / s_2^2, the information that angle and distance noise leave of a point on the road.
    """
    own = {"angle_std": 1e-3, "distance_std": 0.4, "velocity_std": 2.0}
    keys = {f"truth.{key}": value for key, value in own.items()}
    scenario = small_scenario(1).replace({"truth.process_noise": True, **keys})
    quiet = eb.simulate(small_scenario(1), ["omni"], trials=1)
    noisy = eb.simulate(scenario, ["omni"], trials=500)
    height = noisy["truth"][..., 1] * np.sin(noisy["truth"][..., 0])
    flown = np.broadcast_to(noisy["uav_position"].sel(axis="z").values[None, :, None], height.shape)
    np.testing.assert_allclose(height.values, flown, rtol=1e-12)
    theta, d, _ = quiet["truth"].values[0, 0, 0]
    step = (noisy["position"] - quiet["position"].isel(trial=0)).values[:, 1, 0, 0]
    information = np.sin(theta) ** 2 / (d * 1e-3) ** 2 + np.cos(theta) ** 2 / 0.4**2
    assert abs(step.var() * information - 1) < 5 * np.sqrt(2 / 500)
    speed = (noisy["truth"] - quiet["truth"].isel(trial=0)).values[:, 1, 0, 2]
    assert abs(speed.var() / 4.0 - 1) < 5 * np.sqrt(2 / 500)


def test_no_objects_is_sensing_only():
    result = eb.simulate(small_scenario(0), SCHEMES, trials=2)
    assert result.sizes["object"] == 0
    assert result["rate"].shape == (3, 2, 8, 0)


def test_an_object_right_under_the_uav_runs():
    scenario = small_scenario(1)
    under = scenario.replace({"objects.0.angle": np.pi / 2, "objects.0.velocity": 0.0})
    result = eb.simulate(under, SCHEMES, trials=20, seed=1)
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
    made = {"scenario", "seed", "names", "echobeam_version", "environment", "created"}
    assert set(result.attrs) == made
    assert "numpy" in result.attrs["environment"]
