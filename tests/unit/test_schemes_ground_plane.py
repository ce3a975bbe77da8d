"""The tracker `ground` and the beamer `posterior` on a plane, in runs and against draws."""

import numpy as np
import pytest

import echobeam as eb
from echobeam.estimation.consistency import chi_square_band, nees
from echobeam.physics.plane import GROUND_GEOMETRY, facing
from echobeam.schemes.cosine_beliefs import WIDEST, cosine_belief
from echobeam.values import Status, Tracks, UavState

GROUND = "water-filling:tracker=ground"
POSTERIOR = "water-filling:tracker=ground,beamer=posterior"
UAV = UavState(np.array([3.0, -5.0, 90.0]), np.zeros(3))


def scenario(position=("40 m", "30 m"), velocity=("20 m/s", "5 m/s"), **changes):
    """One object below the paper's radar at P_T = 1."""
    objects = [{"position": list(position), "velocity": list(velocity)}]
    given = {"radio.power": 1.0, "radar.rcs": [120, 120], "objects": objects}
    return eb.load_scenario("ground").replace(given | changes)


def ratios(result, name):
    """Mean rate of a frame over the genie's, ``(trials,)``."""
    rate = result["rate"].sum("object").mean("slot")
    return (rate.sel(scheme=name) / rate.sel(scheme="genie")).values


def errors(result, name):
    """Normalised squared errors ``(slots, trials)``."""
    one = result.sel(scheme=name).isel(object=0)
    off = (one["estimated"] - one["truth"]).values
    return nees(off, one["estimated_cov"].values, ()).T


@pytest.mark.slow
@pytest.mark.parametrize(
    ("changes", "prototype"),
    [
        ({}, (0.888, 0.857)),
        ({"position": ("80 m", "-60 m")}, (0.876, 0.823)),
        ({"array.rows": 16, "array.columns": 16}, (0.898, 0.892)),
    ],
)
def test_rates_are_those_of_a_filter_that_knows_the_variance_and_nothing_is_overconfident(
    changes, prototype
):
    """Within three standard errors; NEES of all four components below their 99.9 % band's end."""
    trials = 100
    schemes = ["genie", "water-filling", GROUND, POSTERIOR]
    result = eb.simulate(scenario(**changes), schemes=schemes, trials=trials, seed=1)
    plain = ratios(result, "water-filling")
    for name in result.scheme.values[2:]:
        ratio = ratios(result, name)
        assert ratio.mean() > prototype[0] - 3.0 * ratio.std() / np.sqrt(trials)
        assert np.quantile(ratio, 0.05) > prototype[1] - 0.012
        assert (errors(result, name).mean(axis=1) < chi_square_band(4, trials, 0.999)[1]).all()
        assert ratio.mean() > plain.mean() - 1e-3  # whose height is exact, as it is here
        assert np.isfinite(result["estimated"].sel(scheme=name)).all()


@pytest.mark.slow
def test_posterior_beams_are_above_all_others_where_the_belief_is_wide():
    """Mean and 5 % quantile at (80, -60) m."""
    schemes = ["genie", "temporal", "pilot", "water-filling", POSTERIOR]
    given = scenario(("80 m", "-60 m"))
    result = eb.simulate(given, schemes=schemes, trials=100, seed=2)
    best = ratios(result, result.scheme.values[-1])
    for name in schemes[1:-1]:
        other = ratios(result, name)
        assert best.mean() > other.mean()
        assert np.quantile(best, 0.05) > np.quantile(other, 0.05)


@pytest.mark.parametrize(
    "changes",
    [
        {"radar.variance": "known"},
        {"radar.crb": "exact", "radio.power": 64.0},  # which has no gain of sending
        {"radar.fluctuation": "swerling1"},
        {"uav.altimeter_std": 0, "uav.terrain_std": 0},
        {"uav.velocity": ["10 m/s", "0 m/s", "-3 m/s"]},
        {"array.facing": ["1", "0", "-1"]},
    ],
)
@pytest.mark.slow
def test_it_is_not_overconfident_with_other_equipment(changes):
    result = eb.simulate(scenario(**changes), schemes=[POSTERIOR], trials=60, seed=3)
    found = errors(result, result.scheme.values[0])
    assert (found.mean(axis=1) < chi_square_band(4, 60, 0.999)[1]).all()


ARRAYS = [
    {"kind": "linear", "n_tx": 24, "axis": "vertical"},
    {"kind": "linear", "n_tx": 24, "axis": "horizontal"},
    {"kind": "planar", "rows": 1, "columns": 24, "facing": "ahead"},
    {"kind": "planar", "rows": 24, "columns": 1, "facing": [1, 0, -0.5]},
]


@pytest.mark.slow
@pytest.mark.parametrize("array", ARRAYS)
def test_one_cosine_is_enough_for_beams_and_its_reported_error_is_honest(array):
    """Beams of one slot in ten omnidirectional have 0.9 of the genie's rate at most.

    Distance and cosine are what the array measures; which of the places that have both is the
    object's it cannot tell. Mean squares of the distance's errors over their variances are below
    the end of the 99.9 % band of chi-square.
    """
    trials = 40
    changes = {"array": array, "radio.power": 1000.0, "radar.rcs": [4, 4]}
    schemes = ["water-filling", GROUND, POSTERIOR, "genie"]
    result = eb.simulate(scenario(**changes), schemes=schemes, trials=trials, seed=2)
    uav = result["uav_position"].values[:, None]
    offset = result["estimated"].values[:3, ..., 0, :2] - uav[..., :2].swapaxes(0, 1)
    true = result["truth"].values[..., 0, :2] - uav[..., :2].swapaxes(0, 1)
    length = np.hypot(*np.moveaxis(offset, -1, 0))
    towards = offset / length[..., None]
    cov = result["estimated_cov"].values[:3, ..., 0, :2, :2]
    variance = np.einsum("...i,...ij,...j->...", towards, cov, towards)
    square = (length - np.hypot(*np.moveaxis(true, -1, 0))) ** 2 / variance
    for name, one in zip(result.scheme.values[:3], square, strict=True):
        assert ratios(result, name).mean() > 0.8
        if name != "water-filling":  # whose linearisation is too sure of itself
            assert (one.mean(axis=0) < chi_square_band(1, trials, 0.999)[1]).all()


@pytest.mark.slow
def test_several_objects_are_tracked_and_those_that_leave_are_forgotten():
    given = eb.load_scenario("ground")
    objects = [item.model_dump(exclude_unset=True) for item in given.objects]
    objects[1]["leaves"] = 0.05
    given = given.replace({"objects": objects})
    result = eb.simulate(given, schemes=[POSTERIOR], trials=5, seed=4).isel(scheme=0)
    off = np.abs(result["estimated"] - result["truth"]).sel(state=["x", "y"])
    last = off.isel(slot=-1).median("trial")
    assert (last.isel(object=[0, 2]) < 1.0).all()
    gone = result["estimated"].isel(object=1, slot=slice(6, None))
    assert np.isnan(gone).all()


def tracks(mean, cov):
    known = np.full((1, 1), Status.CONFIRMED, dtype=np.int8)
    return Tracks(np.array([[mean]]), np.array([[cov]]), known, np.zeros((1, 1), dtype=np.int64))


def test_a_belief_in_cosines_has_the_moments_of_draws():
    root = np.array([[6.0, 0.0], [4.0, 5.0]])
    cov = np.diag([0.0, 0.0, 4.0, 9.0])
    cov[:2, :2] = root @ root.T
    mean = np.array([43.0, 20.0, 1.0, 2.0])
    belief = cosine_belief(tracks(mean, cov), GROUND_GEOMETRY, UAV)
    draws = np.random.default_rng(5).multivariate_normal(mean, cov, 200_000)
    seen = GROUND_GEOMETRY.place(draws, UAV)[:, :3]
    exact = np.cov(seen.T)
    std = np.sqrt(exact.diagonal())
    axes = belief.axes[0, 0]
    np.testing.assert_allclose((belief.mean[0, 0] - seen.mean(axis=0)[:2]) / std[:2], 0, atol=0.01)
    off = (axes.T @ axes - exact[:2, :2]) / np.outer(std[:2], std[:2])
    np.testing.assert_allclose(off, 0.0, atol=0.03)
    slope = np.linalg.solve(exact[:2, :2], exact[:2, 2]) / seen[:, 2].mean()
    np.testing.assert_allclose(belief.stretch[0, 0] * std[:2], slope * std[:2], atol=2e-3)
    assert belief.distance[0, 0] == pytest.approx(seen[:, 2].mean(), rel=1e-3)


def test_a_belief_without_an_end_and_one_behind_the_array_are_no_trouble():
    wide = cosine_belief(tracks(np.zeros(4), 1e6 * np.eye(4)), GROUND_GEOMETRY, UAV)
    assert (np.linalg.norm(wide.axes, axis=-1) <= WIDEST * (1 + 1e-12)).all()
    exact = cosine_belief(tracks(np.zeros(4), np.zeros((4, 4))), GROUND_GEOMETRY, UAV)
    assert not exact.axes.any()
    np.testing.assert_array_equal(exact.stretch, 0.0)
    ahead = facing((1.0, 0.0, 0.0))
    behind = cosine_belief(tracks(np.array([-40.0, 0, 0, 0]), np.eye(4)), ahead, UAV)
    assert np.isinf(behind.distance).all()


@pytest.mark.slow
def test_it_keeps_the_rules_of_a_scheme():
    eb.testing.check_scheme(POSTERIOR, "ground")
