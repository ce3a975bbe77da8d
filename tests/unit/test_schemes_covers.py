"""Covers on the ground: ellipses of direction cosines, and how often they hold the truth."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import echobeam as eb
from echobeam.physics.plane import GROUND_GEOMETRY
from echobeam.schemes.configure import system_of
from echobeam.schemes.covers import THINNEST, ellipse, predicted_spread
from echobeam.values import UavState

SCENARIO = eb.load_scenario("ground")
SYSTEM = system_of(SCENARIO)


def test_an_ellipse_is_that_of_the_covariance_within_limits():
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    square = turn @ np.diag([1e-3, 4e-4]) @ turn.T
    covers, wanted = ellipse(square[None, None], SYSTEM)
    np.testing.assert_allclose(covers[0, 0], SCENARIO.coverage.width**2 * square, rtol=1e-12)
    assert wanted.all()
    wide, _ = ellipse(np.diag([9.0, 1e-12])[None, None], SYSTEM)
    widest = np.sin(SCENARIO.coverage.max_halfwidth)
    np.testing.assert_allclose(np.linalg.eigvalsh(wide[0, 0]), [THINNEST**2, widest**2])
    covers, wanted = ellipse(np.full((1, 1, 2, 2), np.nan), SYSTEM)
    assert not wanted.any()
    assert np.isfinite(covers).all()


def test_an_axis_of_one_element_is_covered_thinly():
    scenario = SCENARIO.replace({"array": {"kind": "linear", "n_tx": 8, "axis": "horizontal"}})
    covers, wanted = ellipse(np.diag([1e-3, np.inf])[None, None], system_of(scenario))
    np.testing.assert_allclose(covers[0, 0], np.diag([9e-3, THINNEST**2]))
    assert wanted.all()


def test_the_predicted_spread_is_that_of_samples():
    rng = np.random.default_rng(0)
    uav = UavState(np.array([1.0, 2.0, 100.0]), np.zeros(3))
    mean, cov = np.array([40.0, 30.0, 20.0, 5.0]), np.diag([1.0, 0.25, 1.0, 1.0])
    cov[0, 1] = cov[1, 0] = 0.3
    drawn = rng.multivariate_normal(mean, cov, 100_000)
    seen = GROUND_GEOMETRY.place(drawn, uav)[:, :2]
    view = dataclasses.make_dataclass("Shown", ["uav", "system"])(uav, SYSTEM)
    np.testing.assert_allclose(predicted_spread(mean, cov, view), seen.std(axis=0), rtol=0.02)


@pytest.fixture(scope="module")
def result():
    """Few objects, no floors: designs of wide ellipses take tenths of a second each."""
    return eb.simulate(
        SCENARIO.replace({"objects": [{"position": [40, 30], "velocity": [20, 5]}]}),
        ["temporal", "temporal:spread=posterior", "pilot-predict"], trials=6, seed=0,
    )  # fmt: skip


@pytest.mark.slow
def test_the_cover_is_the_ellipse_of_the_last_measurement(result):
    one = result.sel(scheme="temporal").isel(object=0)
    measured = one["measured_var"].values[:, 1:-1, :2]
    expected = SCENARIO.coverage.width**2 * measured[..., None] * np.eye(2)
    np.testing.assert_allclose(one["cover"].values[:, 2:], expected, rtol=1e-9)
    assert np.isnan(one["cover"].values[:, 0]).all()


def test_coverage_counts_true_directions_inside(result):
    table = eb.summary(result)["value"]
    for name in ("temporal", "temporal:spread=posterior"):
        one = result.sel(scheme=name).isel(object=0)
        uav = UavState(np.array([0.0, 0.0, 100.0]), np.zeros(3))
        off = (
            GROUND_GEOMETRY.place(one["predicted"].values, uav)
            - GROUND_GEOMETRY.place(one["truth"].values, uav)
        )[..., :2]
        inside = []
        for trial in range(6):
            for slot in range(1, 10):
                C = one["cover"].values[trial, slot]
                inside.append(off[trial, slot] @ np.linalg.solve(C, off[trial, slot]) <= 1.0)
        assert table[name, "coverage"] == pytest.approx(np.mean(inside))
        assert np.mean(inside) > 0.9


def test_heights_that_the_uav_does_not_know_act_on_echo_and_link():
    changes = {"truth.terrain": "10 m", "frame.slots_per_frame": 2}
    low, high = (
        eb.simulate(one, ["omni"], trials=1, seed=0)
        for one in (SCENARIO, SCENARIO.replace(changes))
    )
    squares = [
        (one["position"].values[0, 0] - one["uav_position"].values[0]) ** 2 for one in (low, high)
    ]
    ratio = squares[0].sum(axis=-1) / squares[1].sum(axis=-1)
    np.testing.assert_allclose(
        high["radar_snr"].values[0, 0, 0] / low["radar_snr"].values[0, 0, 0], ratio**2
    )
