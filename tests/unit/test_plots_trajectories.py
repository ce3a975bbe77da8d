"""Trajectories: positions by plane geometry, ellipses by a Gaussian's law, arrows by direction."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import echobeam as eb
from echobeam.physics.geometry import offset, offset_cov
from echobeam.plots import Choice, Source
from echobeam.plots.drawing import draw
from echobeam.plots.scene import chosen_slots, occupants, read_scene
from echobeam.values import GaussianState

from ..forms import flying, predict
from .plot_dataset import build_result
from .plot_figures import figure_of, series_of, written

TIME = 0.01 * np.arange(10)


def scene_of(result, **choice):
    return read_scene(Source(result, Choice(**choice)))


def arrows_of(data):
    """Return each arrow's tip and the offset of its tail in the first panel."""
    texts = draw(data).axes[0].texts
    return [(a.xy, np.array(a.xyann)) for a in texts if getattr(a, "arrow_patch", None)]


def ellipses_of(panel):
    return [one for one in panel.series if one.name == "95 % region"]


def test_true_positions_are_on_the_ground_where_the_kinematics_put_them():
    scene = scene_of(build_result())
    for k, (angle, velocity) in enumerate(((75.0, 30.0), (135.0, -3.0))):
        x = 100.0 / np.tan(np.deg2rad(angle)) + velocity * TIME
        np.testing.assert_allclose(scene.true[:, k, 0], x, rtol=1e-12)
        np.testing.assert_allclose(scene.true[:, k, 1], 0.0, atol=1e-9)


def test_the_uav_is_where_the_record_says():
    result = build_result()
    scene = scene_of(result)
    np.testing.assert_allclose(scene.uav[:, 0], 0.0, atol=1e-12)
    np.testing.assert_allclose(scene.uav[:, 1], 100.0 - 15.0 * TIME)
    result["uav_position"].loc[{"axis": "x"}] = 15.0 * TIME
    moved = scene_of(result)
    np.testing.assert_allclose(moved.uav[:, 0], 15.0 * TIME)
    shift = moved.estimated[..., 0] - scene.estimated[..., 0]
    np.testing.assert_allclose(shift, np.broadcast_to(15.0 * TIME[:, None], (10, 2)), atol=1e-9)


def test_estimated_and_predicted_positions_are_in_the_close_ups():
    result = build_result()
    panel = figure_of("trajectories", result, trial=3).panels[2]
    one = result.sel(scheme="temporal").isel(trial=3, object=1)
    for name in ("estimated", "predicted"):
        theta, d = one[name].sel(state="angle"), one[name].sel(state="distance")
        drawn = series_of(panel, name)
        np.testing.assert_allclose(drawn.x, d * np.cos(theta))
        np.testing.assert_allclose(drawn.y, 100.0 - 15.0 * TIME - d * np.sin(theta), atol=1e-9)


def test_the_position_covariance_is_the_jacobians_sandwich():
    """Against a Jacobian by the complex step, of the complex position d exp(-j theta)."""
    rng = np.random.default_rng(3)
    state = np.array([1.1, 80.0, 7.0])
    root = rng.standard_normal((3, 3))
    cov = root @ root.T
    step = 1e-20

    def place(theta, d):
        return np.array([d * np.cos(theta), -d * np.sin(theta)])

    jacobian = np.column_stack(
        [
            place(state[0] + 1j * step, state[1]).imag / step,
            place(state[0], state[1] + 1j * step).imag / step,
        ]
    )
    np.testing.assert_allclose(offset(state), place(*state[:2]))
    np.testing.assert_allclose(
        offset_cov(state, cov), jacobian @ cov[:2, :2] @ jacobian.T, rtol=1e-12
    )


def test_ellipses_hold_95_per_cent():
    """Every point of the ellipse has the Mahalanobis distance of chi-square's 95 % quantile."""
    result = build_result(slots=3)
    scene = scene_of(result)
    ellipses = ellipses_of(figure_of("trajectories", result).panels[1])
    assert len(ellipses) == 3
    for n, ellipse in enumerate(ellipses):
        away = np.stack([ellipse.x, ellipse.y], axis=-1) - scene.estimated[n, 0]
        squared = np.einsum("pi,ij,pj->p", away, np.linalg.inv(scene.spread[n, 0]), away)
        np.testing.assert_allclose(squared, stats.chi2.ppf(0.95, 2), rtol=1e-6)


def test_a_first_region_that_exceeds_the_picture_is_left_out():
    """The ellipses that are drawn begin with the first of ordinary size; the last is drawn."""
    result = build_result(slots=20, trials=1)
    cov = result["estimated_cov"].values
    cov[:, :, :-1] = cov[:, :, -1:]
    cov[:, :, :2] *= 1e6
    scene = scene_of(result)
    ellipses = ellipses_of(figure_of("trajectories", result).panels[1])
    centres = np.array([[one.x[:-1].mean(), one.y[:-1].mean()] for one in ellipses])
    assert len(ellipses) == 3
    np.testing.assert_allclose(centres[[0, -1]], scene.estimated[[2, 19], 0], atol=1e-9)


def test_arrows_point_in_the_direction_of_movement():
    arrows = arrows_of(figure_of("trajectories", build_result()))
    uav, right, left = [tail for _, tail in arrows]
    assert uav[1] > 0
    assert right[0] < 0
    assert left[0] > 0
    np.testing.assert_allclose(arrows[1][0], [100 / np.tan(np.deg2rad(75)) + 2.7, 0], atol=1e-9)


def test_what_does_not_move_has_a_dot_and_no_arrow():
    result = build_result(angles=(60.0,), velocities=(0.0,), speed=0.0)
    data = figure_of("trajectories", result)
    assert not arrows_of(data)
    assert [line.get_marker() for line in draw(data).axes[0].get_lines()].count("o") == 2


def test_stays_end_where_an_object_leaves():
    scene = scene_of(build_result(coming_and_going=True))
    assert scene.stays == [(0, slice(0, 5)), (1, slice(2, 7))]


def test_stays_end_where_another_vehicle_takes_the_column():
    assert occupants(np.array([4, 4, 4, 7, 7, -1, 7])) == [slice(0, 3), slice(3, 5), slice(6, 7)]
    assert occupants(np.full(4, -1)) == []


@pytest.mark.parametrize("objects", [1, 2, 3, 4])
def test_a_few_objects_have_a_close_up_and_a_forecast_each(objects):
    angles = np.linspace(40.0, 140.0, objects)
    result = build_result(angles=angles, velocities=np.full(objects, 9.0), trials=1)
    assert len(figure_of("trajectories", result).panels) == 1 + 2 * objects


@pytest.mark.slow
def test_objects_that_come_and_go_are_drawn_over_the_time():
    result = eb.simulate(eb.load_scenario("traffic", {"frame.frames": 3}), ["temporal"], trials=1)
    road, error = figure_of("trajectories", result).panels
    scene = scene_of(result)
    assert (road.x.name, error.y.unit) == ("Time", "m")
    for number, (k, stay) in enumerate(scene.stays):
        one = series_of(road, f"stay {number + 1}, true")
        np.testing.assert_allclose(one.x, result["time"].values[stay])
        np.testing.assert_allclose(one.y, scene.true[stay, k, 0])
        off = np.hypot(*(scene.predicted - scene.true)[stay, k].T)
        np.testing.assert_allclose(error.series[number].y, off)


def test_axes_name_their_units():
    scene, *others = figure_of("trajectories", build_result()).panels
    assert (str(scene.x), str(scene.y)) == ("Position along the road (m)", "Height (m)")
    assert (str(others[-1].x), str(others[-1].y)) == ("Slot", "Position (m)")
    assert scene.equal


def test_forecasts_are_drawn_from_the_middle_of_a_short_stay_along_the_road():
    """The way and its 3-sigma band against the filter's own repeated predictions."""
    result = build_result(trials=4)
    scenario = Source(result).scenario
    true, predicted, band, way = figure_of("trajectories", result, trial=2).panels[3].series
    one = result.sel(scheme="temporal").isel(trial=2, object=0, slot=5)
    state = GaussianState(
        one["estimated"].values[None], one["estimated_cov"].values[None], np.array([True])
    )
    std = [scenario.filter.angle_std, scenario.filter.distance_std, scenario.filter.velocity_std]
    for _ in range(4):
        state = predict(state, flying(15.0, -np.pi / 2), 0.01, std)
    theta, d = state.mean[0, :2]
    gradient = np.array([-d * np.sin(theta), np.cos(theta)])
    sigma = np.sqrt(gradient @ state.cov[0, :2, :2] @ gradient)
    own = result["predicted"].sel(scheme="temporal").isel(trial=2, object=0)
    along = own.sel(state="distance") * np.cos(own.sel(state="angle"))
    np.testing.assert_allclose(predicted.y, along)
    np.testing.assert_array_equal(way.x, [6, 7, 8, 9, 10])
    assert way.y[-1] == pytest.approx(d * np.cos(theta))
    np.testing.assert_allclose(true.y[0], 100 / np.tan(np.deg2rad(75)))
    ends = d * np.cos(theta) + np.array([-3.0, 3.0]) * sigma
    np.testing.assert_allclose(band.band[-1], ends)


def test_long_stays_have_three_cones_that_do_not_overlap():
    assert chosen_slots(slice(0, 10)) == [5]
    assert chosen_slots(slice(20, 120)) == [30, 60, 90]
    assert chosen_slots(slice(3, 4)) == []
    result = build_result(slots=100, trials=1, per_frame=10)
    panel = figure_of("trajectories", result).panels[3]
    ways = [one for one in panel.series if one.name.startswith("forecast") and one.band is None]
    assert [(one.x[0], one.x[-1]) for one in ways] == [(11, 41), (41, 71), (71, 100)]


@pytest.mark.parametrize("scheme", ["temporal", "genie"])
def test_without_a_covariance_there_is_no_cone(scheme):
    result = build_result(schemes=("temporal", "genie"), trials=1)
    if scheme == "temporal":
        result["estimated"].values[:] = np.nan
    result["estimated_cov"].values[:] = np.nan if scheme == "temporal" else 0.0
    data = figure_of("trajectories", result, schemes=(scheme,))
    assert [note.text for note in data.panels[3].notes] == ["no forecast"]
    assert "no forecast" in written(data)


def test_the_first_slots_are_all_marked_however_long_the_run():
    panel = figure_of("trajectories", build_result(slots=200, trials=1)).panels[1]
    for name in ("estimated", "predicted"):
        assert series_of(panel, name).x.size == 4 + 20
