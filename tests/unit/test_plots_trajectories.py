"""Trajectories: positions by plane geometry, ellipses by a Gaussian's law, arrows by direction."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.patches import Ellipse
from scipy import stats

from echobeam.physics.geometry import offset, offset_cov
from echobeam.plots import trajectories
from echobeam.plots.cones import chosen_slots
from echobeam.plots.ground import occupants, read_scene
from echobeam.plots.setting import read_scenario
from echobeam.values import GaussianState

from ..forms import flying, predict
from .plot_dataset import build_result

TIME = 0.01 * np.arange(10)


def scene_of(result, scheme="temporal", trial=0):
    return read_scene(result, scheme, trial)


def arrows_of(axes):
    """Return each arrow's tip and the offset of its tail."""
    return [(a.xy, np.array(a.xyann)) for a in axes.texts if getattr(a, "arrow_patch", None)]


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


def test_estimated_and_predicted_positions_are_drawn_in_the_close_ups():
    result = build_result()
    figure = trajectories.draw(result, trial=3)
    one = result.sel(scheme="temporal").isel(trial=3, object=1)
    for name in ("estimated", "predicted"):
        theta, d = one[name].sel(state="angle"), one[name].sel(state="distance")
        (line,) = [line for line in figure.axes[2].get_lines() if line.get_label() == name]
        np.testing.assert_allclose(line.get_xdata(), d * np.cos(theta))
        height = 100.0 - 15.0 * TIME - d * np.sin(theta)
        np.testing.assert_allclose(line.get_ydata(), height, atol=1e-9)


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
    axes = trajectories.draw(result).axes[1]
    ellipses = [child for child in axes.get_children() if isinstance(child, Ellipse)]
    assert len(ellipses) == 3
    for n, ellipse in enumerate(ellipses):
        outline = ellipse.get_patch_transform().transform(
            [[np.cos(t), np.sin(t)] for t in np.linspace(0, 6, 7)]
        )
        away = outline - scene.estimated[n, 0]
        squared = np.einsum("pi,ij,pj->p", away, np.linalg.inv(scene.spread[n, 0]), away)
        np.testing.assert_allclose(squared, stats.chi2.ppf(0.95, 2), rtol=1e-6)


def test_a_first_region_that_exceeds_the_picture_is_left_out():
    """All ellipses that are drawn lie within the axes, as the legend says; the last is drawn."""
    result = build_result(slots=20, trials=1)
    cov = result["estimated_cov"].values
    cov[:, :, :-1] = cov[:, :, -1:]
    cov[:, :, :2] *= 1e6
    scene = scene_of(result)
    figure = trajectories.draw(result)
    axes = figure.axes[1]
    ellipses = [child for child in axes.get_children() if isinstance(child, Ellipse)]
    centres = np.array([ellipse.get_center() for ellipse in ellipses])
    np.testing.assert_allclose(centres[[0, -1]], scene.estimated[[2, 19], 0])
    assert len(ellipses) == 3
    (low_x, high_x), (low_y, high_y) = axes.get_xlim(), axes.get_ylim()
    for ellipse in ellipses:
        box = ellipse.get_path().get_extents(ellipse.get_patch_transform())
        assert low_x < box.x0 < box.x1 < high_x
        assert low_y < box.y0 < box.y1 < high_y
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert "95 % region (if within axes)" in labels


def test_arrows_point_in_the_direction_of_movement():
    scene_axes = trajectories.draw(build_result()).axes[0]
    uav, right, left = [tail for _, tail in arrows_of(scene_axes)]
    assert uav[1] > 0
    assert right[0] < 0
    assert left[0] > 0
    tips = np.array([tip for tip, _ in arrows_of(scene_axes)])
    np.testing.assert_allclose(tips[1], [100 / np.tan(np.deg2rad(75)) + 2.7, 0], atol=1e-9)


def test_what_does_not_move_has_a_dot_and_no_arrow():
    result = build_result(angles=(60.0,), velocities=(0.0,), speed=0.0)
    axes = trajectories.draw(result).axes[0]
    assert not arrows_of(axes)
    assert [line.get_marker() for line in axes.get_lines()].count("o") == 2


def test_stretches_end_where_an_object_leaves():
    scene = scene_of(build_result(coming_and_going=True))
    assert scene.stretches == [[slice(0, 5)], [slice(2, 7)]]


def test_stretches_end_where_another_vehicle_takes_the_column():
    assert occupants(np.array([4, 4, 4, 7, 7, -1, 7])) == [slice(0, 3), slice(3, 5), slice(6, 7)]


def test_a_column_without_anybody_has_no_stretch():
    assert occupants(np.full(4, -1)) == []


@pytest.mark.parametrize("objects", [1, 2, 3, 4, 7])
def test_close_ups_are_made_of_up_to_four_objects(objects):
    angles = np.linspace(40.0, 140.0, objects)
    result = build_result(angles=angles, velocities=np.full(objects, 9.0), trials=1)
    assert len(trajectories.draw(result).axes) == 1 + 2 * min(objects, 4)


def test_close_ups_are_of_those_who_stay_longest():
    result = build_result(angles=(40.0, 60, 80, 100, 120), velocities=(9.0,) * 5, trials=1)
    result["identity"][:, 4:, 1] = -1
    titles = [axes.get_title() for axes in trajectories.draw(result).axes[1:]]
    assert titles == 2 * ["object 1", "object 3", "object 4", "object 5"]


def test_axes_name_their_units():
    *planes, road, _ = trajectories.draw(build_result()).axes
    for axes in planes:
        assert axes.get_xlabel().endswith("(m)")
        assert axes.get_ylabel() == "Height (m)"
    assert road.get_xlabel() == "Slot"
    assert road.get_ylabel() == "Position (m)"


def test_forecasts_are_drawn_from_the_middle_of_a_short_stay_along_the_road():
    """The way and its 3-sigma band against the filter's own repeated predictions."""
    result = build_result(trials=4)
    scenario = read_scenario(result)
    road = trajectories.draw(result, trial=2).axes[3]
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
    true, way, _ = road.get_lines()
    np.testing.assert_array_equal(way.get_xdata(), [6, 7, 8, 9, 10])
    assert way.get_ydata()[-1] == pytest.approx(d * np.cos(theta))
    np.testing.assert_allclose(true.get_ydata()[0], 100 / np.tan(np.deg2rad(75)))
    outline = road.collections[0].get_paths()[0].vertices
    ends = outline[outline[:, 0] == 10][:, 1]
    assert [ends.min(), ends.max()] == pytest.approx(
        [d * np.cos(theta) - 3 * sigma, d * np.cos(theta) + 3 * sigma]
    )


def test_long_stays_have_three_cones_that_do_not_overlap():
    assert chosen_slots(slice(0, 10)) == [5]
    assert chosen_slots(slice(20, 120)) == [30, 60, 90]
    assert chosen_slots(slice(3, 4)) == []
    result = build_result(slots=100, trials=1, per_frame=10)
    ways = [
        line
        for line in trajectories.draw(result).axes[3].get_lines()
        if line.get_linestyle() == "--"
    ]
    spans = [(line.get_xdata()[0], line.get_xdata()[-1]) for line in ways]
    assert spans == [(11, 41), (41, 71), (71, 100)]


@pytest.mark.parametrize("scheme", ["temporal", "genie"])
def test_without_a_doubtful_belief_there_is_no_cone(scheme):
    result = build_result(schemes=("temporal", "genie"), trials=1)
    if scheme == "temporal":
        result["estimated"].values[:] = np.nan
    result["estimated_cov"].values[:] = np.nan if scheme == "temporal" else 0.0
    road = trajectories.draw(result, scheme).axes[3]
    assert [text.get_text() for text in road.texts] == ["no forecast"]


def test_the_first_slots_are_all_marked_however_long_the_run():
    axes = trajectories.draw(build_result(slots=200, trials=1)).axes[1]
    for line in axes.get_lines():
        if line.get_label() in ("estimated", "predicted"):
            assert line.get_markevery()[:6] == [0, 1, 2, 3, 4, 10]
