import csv
import math
import pickle
import re
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import echobeam as eb
from echobeam.faults import RunError
from echobeam.scenario import ScenarioError
from echobeam.simulation.summary import summarise
from echobeam.store.block_files import BlockFiles
from echobeam.store.result import write_dataset
from echobeam.store.writing import StoreError
from echobeam.sweeps.coordinates import coordinate
from echobeam.sweeps.grid import (
    Grid,
    SweepError,
    Varied,
    grid_dataset,
    read_varied,
    tidy_csv,
    together,
)
from echobeam.sweeps.points import run_study, study_in
from echobeam.units import parse_quantity

AXES = (Varied("radio.power", ("0.1", "1")), Varied("objects.0.angle", ("60 deg", "45 deg")))
SCHEMES = ("water-filling", "omni")


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    grid = Grid("paper-single", ("frame.slots_per_frame=4",), AXES)
    study = study_in(tmp_path_factory.mktemp("s") / "b", grid.points(SCHEMES, 20, ("rate",)), 3)
    run_study(study)
    return grid, study, grid_dataset(grid, study)


def test_a_point_is_the_run_of_its_scenario(swept):
    """Every point against a run of its own, with the same seed: common random numbers."""
    _, study, dataset = swept
    assert dict(dataset.sizes) == {
        "radio.power": 2, "objects.0.angle": 2, "scheme": 2, "slot": 4, "end": 2,
    }  # fmt: skip
    for index, (power, angle) in enumerate([("0.1", "60 deg"), ("0.1", "45 deg"), ("1", "60 deg")]):
        scenario = eb.load_scenario(
            "paper-single",
            ["frame.slots_per_frame=4", f"radio.power={power}", f"objects.0.angle={angle}"],
        )
        result = eb.simulate(scenario, SCHEMES, trials=20, seed=3)
        np.testing.assert_array_equal(study.kept(index)["rate"], result["rate"].values)
        at_angle = parse_quantity(angle, "angle")
        point = dataset.sel({"radio.power": float(power), "objects.0.angle": at_angle})
        for name, figures in summarise(result, scenario).items():
            at = point.sel(scheme=name)
            assert float(at["frame_rate_mean"]) == figures.frame_rate_mean
            np.testing.assert_array_equal(at["nis"].values, figures.nis)
            np.testing.assert_array_equal(at["angle_over_bound"].values, figures.angle_over_bound)
            np.testing.assert_array_equal(
                at["frame_rate_interval"].values, figures.frame_rate_interval
            )


def test_a_tidy_csv_has_a_row_per_point_and_scheme(swept, tmp_path):
    tidy_csv(swept[2], tmp_path / "s.csv")
    with open(tmp_path / "s.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 8
    assert float(rows[0]["objects.0.angle"]) == math.radians(60)
    assert {"frame_rate_mean", "frame_rate_low", "frame_rate_high", "outage"} <= set(rows[0])
    last = swept[2].isel({"radio.power": 1, "objects.0.angle": 1}).sel(scheme="omni")
    (row,) = [
        row
        for row in rows[4:]
        if (float(row["objects.0.angle"]), row["scheme"]) == (math.radians(45), "omni")
    ]
    for name in ("angle_over_bound", "distance_over_bound", "nees"):
        assert float(row[name]) == pytest.approx(float(last[name].mean()))
    assert row["frame_rate_over_genie"] == ""


@pytest.mark.slow
def test_a_grid_opens_from_its_file(swept, tmp_path):
    swept[2].to_netcdf(tmp_path / "s.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "s.nc") as found:
        xr.testing.assert_equal(found, swept[2])


@pytest.mark.slow
def test_an_interrupted_study_goes_on_and_comes_to_the_same(swept, tmp_path):
    grid, whole, _ = swept
    study = study_in(tmp_path / "b", whole.points, 3)

    def stop(done, total):
        if done > total / 2:
            raise KeyboardInterrupt

    with pytest.raises(RunError, match=r"2 of 4 blocks.*--resume"):
        run_study(study, progress=stop)
    with pytest.raises(StoreError, match="another run"):
        run_study(study_in(tmp_path / "b", whole.points[:2], 3), resume=True)
    run_study(study, resume=True)
    xr.testing.assert_identical(
        grid_dataset(grid, study).drop_attrs(), grid_dataset(grid, whole).drop_attrs()
    )


@pytest.mark.parametrize(
    "text",
    [
        "radio.power",
        "radio.power,=1,2",
        "=1,2",
        "radio.power=",
        "radio.power=1,,2",
    ],
)
def test_what_does_not_vary_is_refused(text):
    with pytest.raises(SweepError, match="vary"):
        read_varied(text)


def swept_values(source, key, *texts):
    """Return the coordinate of a grid with one axis that is not run."""
    points = Grid(source, (), (Varied(key, texts),)).points(("omni",), None, ())
    return coordinate([point.scenario for point in points], key, texts)


@pytest.mark.parametrize(
    ("key", "texts", "values", "units"),
    [
        ("array.n_tx", ("16", "32"), [16, 32], "1"),
        ("trials", ("2", "3"), [2, 3], "1"),
        ("radio.power", ("1", "10"), [1.0, 10.0], "1"),
        ("uav.height", ("80 m", "0.09 km", "100"), [80.0, 90.0, 100.0], "m"),
        ("objects.0.angle", ("60 deg", "45 deg"), [math.pi / 3, math.pi / 4], "rad"),
        ("radio.carrier", ("30 GHz", "28e9"), [30e9, 28e9], "Hz"),
        ("coverage.ripple", ("1", "3"), [1.0, 3.0], "1"),
        ("coverage.ripple", ("3", "0.1 N_t"), ["3", "0.1 N_t"], None),
        ("filter.evolution", ("paper", "exact"), ["paper", "exact"], None),
        ("truth.process_noise", ("true", "false"), ["true", "false"], None),
        ("radar.rcs", ("[1, 2]", "[2,3]"), ["[1, 2]", "[2,3]"], None),
        ("radar.rcs.0", ("1", "2"), [1.0, 2.0], None),
        ("schemes.temporal.ripple", ("1", "3"), [1, 3], None),
        ("schemes.pilot.velocity_prior", ("20 m/s", "30 m/s"), ["20 m/s", "30 m/s"], None),
    ],
)
def test_coordinates_are_what_the_scenario_reads(key, texts, values, units):
    found, attrs = swept_values("paper-single", key, *texts)
    assert found.dtype.kind == np.array(values).dtype.kind
    assert found.tolist() == pytest.approx(values) if units else found.tolist() == values
    assert attrs.get("units") == units


@pytest.mark.parametrize(
    ("key", "texts"),
    [
        ("radio.power", ("1", "2", "1")),
        ("radio.power", ("1", "1.0")),
        ("uav.height", ("80 m", "8000 cm")),
        ("filter.distance_std", ("0.7 m", "70 cm")),  # 70 * 0.01 is not 0.7
        ("objects.0.angle", ("60 deg", "1.0471975511965976")),
        ("radar.rcs", ("[1, 2]", "[1.0,2]")),
        ("coverage.ripple", ("0.1 N_t", "0.10 N_t")),
    ],
)
def test_values_that_the_scenario_reads_alike_are_refused(key, texts):
    axes = (Varied("array.n_tx", ("8", "16")), Varied(key, texts), Varied("trials", ("1", "2")))
    first, last = texts[0], texts[-1]
    message = (
        f"--vary {key}: a value is given twice, as {first} and as {last}; give each value once"
    )
    with pytest.raises(SweepError, match=f"^{re.escape(message)}$"):
        Grid("paper-single", (), axes).points(("omni",), None, ())


def test_every_axis_of_a_product_has_its_own_values():
    axes = (AXES[1], Varied("array.n_tx", ("8", "16", "32")), AXES[0])
    grid = Grid("paper-single", (), axes)
    points = grid.points(("omni",), 1, ())
    assert [one.array.n_tx for one in grid.along(points, 1)] == [8, 16, 32]
    assert [one.radio.power for one in grid.along(points, 2)] == [0.1, 1.0]
    assert [round(math.degrees(one.objects[0].angle)) for one in grid.along(points, 0)] == [60, 45]


@pytest.mark.slow
def test_keys_that_vary_together_are_one_dimension(tmp_path):
    """A point is the run of its scenario; what varies with the first key is beside it."""
    grid = Grid(
        "paper-single",
        ("frame.slots_per_frame=4",),
        (read_varied("array.n_tx, array.n_rx=8,16"), read_varied("radio.power=1,10")),
    )
    assert grid.size == 4
    assert grid.keys == ["array.n_tx", "array.n_rx", "radio.power"]
    study = study_in(tmp_path / "b", grid.points(SCHEMES, 3, ()), 0)
    scenarios = [point.scenario for point in study.points]
    assert [one.array.n_tx for one in scenarios] == [8, 8, 16, 16]
    assert [one.array.n_rx for one in scenarios] == [8, 8, 16, 16]
    run_study(study)
    write_dataset(tmp_path / "s.nc", grid_dataset(grid, study))
    with xr.open_dataset(tmp_path / "s.nc", engine="h5netcdf") as found:
        assert found["frame_rate_mean"].dims == ("array.n_tx", "radio.power", "scheme")
        assert found["array.n_rx"].dims == ("array.n_tx",)
        assert "array.n_rx" in found.coords
        assert found["array.n_rx"].values.tolist() == [8, 16]
        point = found["frame_rate_mean"].sel({"array.n_tx": 16, "radio.power": 10})
        settings = ["frame.slots_per_frame=4", "array.n_tx=16", "array.n_rx=16", "radio.power=10"]
        alone = eb.load_scenario("paper-single", settings)
        figures = summarise(eb.simulate(alone, SCHEMES, trials=3, seed=0), alone)
        for name in SCHEMES:
            assert float(point.sel(scheme=name)) == figures[name].frame_rate_mean
        tidy_csv(found, tmp_path / "s.csv")
    with open(tmp_path / "s.csv", newline="") as file:
        rows = list(csv.DictReader(file))
    assert list(rows[0])[:4] == ["array.n_tx", "array.n_rx", "radio.power", "scheme"]
    assert [row["array.n_rx"] for row in rows] == ["8"] * 4 + ["16"] * 4


def test_keys_that_vary_together_may_have_values_of_their_own():
    axis = together(("array.n_tx", "array.n_rx"), [("8", "16"), ("8", "32"), ("16", "16")])
    points = Grid("paper-single", (), (axis,)).points(("omni",), 1, ())
    found = [(point.scenario.array.n_tx, point.scenario.array.n_rx) for point in points]
    assert found == [(8, 16), (8, 32), (16, 16)]
    assert axis.name == "array.n_tx,array.n_rx"


def test_groups_that_are_none():
    pair = ("array.n_tx", "array.n_rx")
    with pytest.raises(SweepError, match=r"n_tx,array\.n_rx: \(8, 16, 3\) is not accepted"):
        together(pair, [("8", "16", "3")])
    with pytest.raises(SweepError, match="no key or no value"):
        together((), [])
    with pytest.raises(SweepError, match=r"array\.n_rx has 1 values, array\.n_tx has 2"):
        Varied("array.n_tx", ("1", "2"), (("array.n_rx", ("1",)),))
    same = together(pair, [("8", "16"), ("8", "16")])
    with pytest.raises(SweepError, match=r"twice, as \(8, 16\) and as \(8, 16\)"):
        Grid("paper-single", (), (same,)).points(("omni",), 1, ())
    with pytest.raises(SweepError, match="varied twice"):
        Grid("paper-single", (), (read_varied("trials,trials=1,2"),)).points((), 1, ())
    axes = (read_varied("array.n_tx,trials=1,2"), read_varied("trials=1,2"))
    with pytest.raises(SweepError, match="varied twice"):
        Grid("paper-single", (), axes).points((), 1, ())
    moved = Grid("paper-single", (), (read_varied("trials,objects.0.angle=1,2"),), "t.csv")
    with pytest.raises(SweepError, match=r"objects\.0\.angle.*--trace"):
        moved.points((), 1, ())


def test_grids_that_are_none():
    with pytest.raises(SweepError, match="no key varies"):
        Grid("paper-single", (), ()).points((), 1, ())
    with pytest.raises(SweepError, match="twice"):
        Grid("paper-single", (), (AXES[0], AXES[0])).points((), 1, ())
    with pytest.raises(ScenarioError, match=r"radio\.power"):
        Grid("paper-single", (), (Varied("radio.power", ("0",)),)).points((), 1, ())


@pytest.mark.parametrize(
    ("vary", "options", "words"),
    [
        ("trials=2,3", {"trials": 4}, "--vary trials: not together with --trials"),
        ("schemes=[1],[2]", {"schemes": ("omni",)}, "--vary schemes: not together with --scheme"),
        ("trace.file=a,b", {"trace": "t.csv"}, r"--vary trace\.file: not together with --trace"),
        ("uav.height,trials=2,3", {"overrides": ("uav.height = 9",)}, "with --set uav.height"),
    ],
)
def test_what_another_option_would_undo_is_refused(vary, options, words):
    """The points would have been alike, under different labels."""
    grid = Grid(
        "paper-single", options.get("overrides", ()), (read_varied(vary),), options.get("trace")
    )
    with pytest.raises(SweepError, match=words):
        grid.points(options.get("schemes", ()), options.get("trials"), ())


def test_a_grid_of_millions_is_refused_at_once():
    values = ",".join(map(str, range(1, 1001)))
    axes = tuple(read_varied(f"{key}={values}") for key in ("radio.power", "uav.height"))
    with pytest.raises(SweepError, match="1000000 points are too many; accepted are 100000"):
        Grid("paper-single", (), axes).points((), None, ())


def test_a_list_is_one_value():
    assert read_varied("radar.rcs=[1, 2],[2,3]").values == ("[1, 2]", "[2,3]")
    assert read_varied("uav.height=80 m, '90 m'").values == ("80 m", "90 m")


def test_trials_may_vary(tmp_path):
    grid = Grid("paper-single", ("frame.slots_per_frame=4",), (Varied("trials", ("2", "3")),))
    study = study_in(tmp_path / "b", grid.points(("omni",), None, ()), 0)
    run_study(study)
    assert grid_dataset(grid, study).attrs["trials"] == [2, 3]
    assert [len(study.statistics_of(index)["sum_rate"][0]) for index in (0, 1)] == [2, 3]


def test_a_schemes_own_parameter_may_vary(tmp_path):
    axis = Varied("schemes.temporal.tracker", ("ekf", "dead-reckoning"))
    grid = Grid("paper-single", ("frame.slots_per_frame=3",), (axis,))
    study = study_in(tmp_path / "b", grid.points(("temporal",), 4, ()), 0)
    run_study(study)
    figures = grid_dataset(grid, study)["angle_rmse"].sel(scheme="temporal")
    values = ["temporal:tracker=ekf", "temporal:tracker=dead-reckoning"]
    scenario = eb.load_scenario("paper-single", ["frame.slots_per_frame=3"])
    alone = summarise(eb.simulate(scenario, values, trials=4), scenario)
    for text, name in zip(axis.values, values, strict=True):
        found = figures.sel({axis.key: text}).values
        np.testing.assert_array_equal(found, alone[name].angle_rmse)


def test_each_point_reads_its_own_blocks_once(swept, monkeypatch):
    grid, study, _ = swept
    read = []
    whole = BlockFiles.read

    def counted(files, index, wanted=lambda name: True):
        read.append(index)
        return whole(files, index, wanted)

    monkeypatch.setattr(BlockFiles, "read", counted)
    grid_dataset(grid, study)
    assert read == [0, 1, 2, 3]
    study.kept(2)
    assert read == [0, 1, 2, 3, 2]


def test_a_task_on_its_way_to_a_cluster_does_not_carry_the_grid():
    """What goes over the network with every block must not grow with the number of points."""
    sizes = []
    for count in (2, 20):
        powers = tuple(str(power) for power in range(1, count + 1))
        grid = Grid("paper-single", (), (Varied("radio.power", powers),))
        study = study_in(Path("b"), grid.points(("omni",), 10, ()), 0)
        sizes.append(len(pickle.dumps(study.piece(0))))
    assert sizes[0] == sizes[1] < 10_000
