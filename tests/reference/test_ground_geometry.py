"""The ground's geometry: a linear array on a road is the road's, and the prototype's rates."""

from __future__ import annotations

import numpy as np
import pytest

import echobeam as eb
from echobeam.schemes.base import System
from echobeam.schemes.configure import system_of
from echobeam.schemes.matched import matched_beams
from echobeam.simulation.scene import scene_of
from echobeam.simulation.world import begin

ANGLES, SPEEDS = (50.0, 75.0, 130.0), (20.0, -5.0, 12.0)
COMMON = {
    "array.n_tx": 12, "array.n_rx": 10, "radio.power": 300, "radar.crb": "exact",
    "frame.slots_per_frame": 4,
}  # fmt: skip


def both(axis):
    """Return a road and the ground with the same linear array and the same objects on y = 0."""
    road = eb.load_scenario("paper-multi").replace(
        COMMON
        | {
            "array.axis": axis,
            "uav": {"height": 100, "speed": 15, "heading": "-30 deg"},
            "objects": [
                {"angle": f"{angle} deg", "velocity": speed}
                for angle, speed in zip(ANGLES, SPEEDS, strict=True)
            ],
        }
    )
    down = np.radians(30.0)
    ground = eb.load_scenario("ground").replace(
        COMMON
        | {
            "array": {"kind": "linear", "n_tx": 12, "n_rx": 10, "axis": axis},
            "uav": {
                "position": [0, 0, 100],
                "velocity": [15 * np.cos(down), 0, -15 * np.sin(down)],
            },
            "radar.rcs": [120, 120],
            "objects": [
                {"position": [100.0 / np.tan(np.radians(angle)), 0], "velocity": [speed, 0]}
                for angle, speed in zip(ANGLES, SPEEDS, strict=True)
            ],
        }
    )
    return road, ground


@pytest.mark.parametrize("axis", ["horizontal", "vertical"])
def test_a_linear_array_on_a_road_is_that_of_the_road(axis):
    """Rates, echoes, bounds and beams, to 1e-9, of what is decided without noise."""
    road, ground = (
        eb.simulate(one, schemes=["genie", "omni"], trials=1, seed=2) for one in both(axis)
    )
    for name in ("sinr", "rate", "radar_snr", "present"):
        np.testing.assert_allclose(ground[name].values, road[name].values, rtol=1e-9)
    np.testing.assert_allclose(ground["beam"].values, road["beam"].values, atol=1e-9)
    np.testing.assert_allclose(ground["position"].values, road["position"].values, atol=1e-9)
    angle = road["truth"].values[..., 0]
    slope = np.cos(angle) if axis == "vertical" else np.sin(angle)
    ours, theirs = (one["true_var"].sel(scheme="omni").values for one in (ground, road))
    np.testing.assert_allclose(ours[..., 0], theirs[..., 0] * slope**2, rtol=1e-9)
    assert np.isinf(ours[..., 1]).all()
    np.testing.assert_allclose(ours[..., 2:], theirs[..., 1:], rtol=1e-9)


@pytest.mark.parametrize("axis", ["horizontal", "vertical"])
def test_matched_beams_and_ideal_measurements_are_those_of_the_road(axis):
    beams, values = [], []
    for scenario in both(axis):
        world = begin(scene_of(scenario), 0, range(1)).advance()
        system: System = system_of(scenario)
        beams.append(matched_beams(world.place, np.ones((1, 3), dtype=bool), system))
        values.append(world.ideal()[0])
    np.testing.assert_allclose(beams[1], beams[0], atol=1e-9)
    road, ground = values
    project = np.sin if axis == "vertical" else np.cos
    np.testing.assert_allclose(ground[:, 0], project(road[:, 0]), rtol=1e-9)
    np.testing.assert_allclose(ground[:, 2:], road[:, 1:], rtol=1e-9)


def one_object(position, size=8, **changes):
    return eb.load_scenario("ground").replace(
        {
            "radio.power": 1,
            "radar.rcs": [120, 120],
            "array.rows": size,
            "array.columns": size,
            "objects": [{"position": position, "velocity": [20, 5]}],
            **changes,
        }
    )


@pytest.mark.parametrize(
    ("position", "size", "mean", "quantile"),
    [([40, 30], 8, 0.888, 0.857), ([80, -60], 8, 0.876, 0.823), ([40, 30], 16, 0.898, 0.892)],
)
def test_the_prototypes_rates_are_reached(position, size, mean, quantile):
    """The prototype has a sigma-point filter; matched beams hardly notice the difference."""
    result = eb.simulate(one_object(position, size), ["water-filling", "genie"], trials=60, seed=1)
    rate = result["rate"].sum("object").mean("slot")
    over = (rate.sel(scheme="water-filling") / rate.sel(scheme="genie").mean()).values
    assert over.mean() == pytest.approx(mean, abs=0.006)
    assert np.quantile(over, 0.05) > quantile - 0.02


def test_an_object_behind_the_array_has_no_link_and_no_echo():
    scenario = one_object([40, 30], **{"array.facing": [-1, 0, 0], "frame.slots_per_frame": 3})
    result = eb.simulate(scenario, ["omni", "water-filling", "genie"], trials=2, seed=0)
    assert result["present"].values.all()
    np.testing.assert_array_equal(result["rate"].values, 0.0)
    np.testing.assert_array_equal(result["radar_snr"].values, 0.0)
    assert np.isnan(result["measured"].values).all()
    ahead = scenario.replace({"array.facing": "ahead"})
    assert (eb.simulate(ahead, ["genie"], trials=1)["rate"].values > 0.0).all()


def test_two_polarisations_have_the_rates_of_one_for_one_object():
    """One beam to one object is matched in either: the gain is the number of elements."""
    results = [
        eb.simulate(
            one_object([40, 30], **{"array.polarisations": polarisations}),
            ["genie", "water-filling"], trials=1, seed=0,
        )
        for polarisations in (1, 2)
    ]  # fmt: skip
    one, two = (result["rate"].sel(scheme="genie").values for result in results)
    np.testing.assert_allclose(two, one, rtol=1e-6)
    assert results[1].sizes["antenna"] == 128


@pytest.mark.slow
def test_names_and_units_are_those_of_the_contract(tmp_path):
    result = eb.run(
        "ground", schemes=["water-filling"], trials=2, out=tmp_path / "g.nc", quiet=True
    )
    import xarray as xr

    with xr.open_dataset(tmp_path / "g.nc") as file:
        assert list(file["state"].values) == ["x", "y", "v_x", "v_y"]
        assert list(file["measurement"].values) == ["u", "v", "delay", "doppler"]
        assert file["cover"].dims == (
            "scheme", "trial", "slot", "object", "cosine", "cosine_b"
        )  # fmt: skip
        assert "covered" not in file
        assert file["truth"].attrs["units"] == "m, m, m/s, m/s"
        table = eb.summary(tmp_path / "g.nc")
    assert "frame_position_rmse" in table.index.get_level_values("quantity")
    assert "angle_rmse" not in table.index.get_level_values("quantity")
    del result


def unlabelled(**changes):
    return eb.load_scenario("ground").replace(
        {
            "radar.detections": "unlabelled",
            "radar.crb": "exact",
            "radar.rcs": [120, 120],
            "radar.clutter": 1.0,
            "frame.frames": 2,
            **changes,
        }
    )


@pytest.mark.slow
def test_objects_on_the_ground_are_found_and_tracked_without_labels():
    """With strong echoes every object is tracked from the first slots on, and nobody else is."""
    result = eb.simulate(unlabelled(), ["water-filling", "temporal"], trials=4, seed=0)
    table = eb.summary(result)["value"]
    for name in ("water-filling", "temporal"):
        assert table[name, "tracked"] > 0.9
        assert table[name, "lost"] == 0.0
        assert table[name, "frame_gospa"] < 2.5
        assert table[name, "false_tracks"] < 5.0
    state = result["track_state"].values
    assert np.isfinite(state).any()
    assert result.sizes["state"] == 4


def test_two_polarisations_are_tracked_without_labels():
    result = eb.simulate(
        unlabelled(**{"array.polarisations": 2, "frame.frames": 1}), ["water-filling"], trials=2
    )
    assert (result["rate"].values[..., -1, :] > 0.0).all()


def test_false_detections_are_uniform_over_the_visible_disc():
    """u^2 + v^2 of a uniform law on the disc is uniform: Kolmogorov and Smirnov, p > 1e-4."""
    from scipy import stats

    from echobeam.schemes.configure import detection_of
    from echobeam.simulation.detections import _false

    scenario = unlabelled(**{"radar.clutter": 20.0})
    world = begin(scene_of(scenario), 5, range(300))
    law = detection_of(scenario)
    value, more = _false(world, law, np.ones(300, dtype=bool))
    found = value[np.isfinite(value[..., 0])]
    assert found.shape[1:] == (4,)
    assert more.shape[-1] == 5
    assert len(found) / 300 == pytest.approx(law.mean_false, rel=5 / np.sqrt(300 * 20))
    square = found[:, 0] ** 2 + found[:, 1] ** 2
    assert stats.kstest(square, "uniform").pvalue > 1e-4
    assert stats.kstest(found[:, 2] / law.longest, "uniform").pvalue > 1e-4
    turn = np.arctan2(found[:, 1], found[:, 0]) / (2 * np.pi) + 0.5
    assert stats.kstest(turn, "uniform").pvalue > 1e-4
    area = np.pi * law.longest * 2.0 * law.widest
    np.testing.assert_allclose(law.density(found[:, :2]), law.mean_false / area)


@pytest.mark.slow
def test_tracks_that_no_beams_separate_share_one():
    """Two vehicles within a beam: one stream for both in turns, and its cover reaches both."""
    near = [{"position": place, "velocity": [20, 5]} for place in ([40, 30], [41, 31])]
    result = eb.simulate(
        unlabelled(objects=near, **{"radar.clutter": 0.0}), ["water-filling"], trials=2, seed=3
    )
    beams = result["mode"].values == 1
    assert result["shared"].values.any(axis=-1)[beams].mean() > 0.5
    both = result["shared"].values.all(axis=-1)
    assert (result["rate"].values[both] > 0.0).all()
