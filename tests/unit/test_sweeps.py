import csv
import pickle
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import echobeam as eb
from echobeam.faults import RunError
from echobeam.scenario import ScenarioError
from echobeam.simulation.summary import summarise
from echobeam.store.block_files import BlockFiles
from echobeam.store.writing import StoreError
from echobeam.sweeps.grid import Grid, SweepError, Varied, grid_dataset, read_varied, tidy_csv
from echobeam.sweeps.points import run_study, study_in

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
        point = dataset.sel({"radio.power": float(power), "objects.0.angle": angle})
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
    assert rows[0]["objects.0.angle"] == "60 deg"
    assert {"frame_rate_mean", "frame_rate_low", "frame_rate_high", "outage"} <= set(rows[0])
    last = swept[2].isel({"radio.power": 1, "objects.0.angle": 1}).sel(scheme="omni")
    (row,) = [
        row for row in rows[4:] if (row["objects.0.angle"], row["scheme"]) == ("45 deg", "omni")
    ]
    for name in ("angle_over_bound", "distance_over_bound", "nees"):
        assert float(row[name]) == pytest.approx(float(last[name].mean()))
    assert row["frame_rate_over_genie"] == ""


def test_a_grid_opens_from_its_file(swept, tmp_path):
    swept[2].to_netcdf(tmp_path / "s.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "s.nc") as found:
        xr.testing.assert_equal(found, swept[2])


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
        "=1,2",
        "radio.power=",
        "radio.power=1,,2",
        "radio.power=1,1",
        "radio.power=1,1.0",
    ],
)
def test_what_does_not_vary_is_refused(text):
    with pytest.raises(SweepError, match="vary"):
        read_varied(text)


def test_grids_that_are_none():
    with pytest.raises(SweepError, match="nothing varies"):
        Grid("paper-single", (), ()).points((), 1, ())
    with pytest.raises(SweepError, match="twice"):
        Grid("paper-single", (), (AXES[0], AXES[0])).points((), 1, ())
    with pytest.raises(ScenarioError, match=r"radio\.power"):
        Grid("paper-single", (), (Varied("radio.power", ("0",)),)).points((), 1, ())


def test_a_list_is_one_value():
    assert read_varied("radar.rcs=[1, 2],[2,3]").values == ("[1, 2]", "[2,3]")
    assert read_varied("uav.height=80 m, '90 m'").values == ("80 m", "90 m")


def test_trials_may_vary(tmp_path):
    grid = Grid("paper-single", ("frame.slots_per_frame=4",), (Varied("trials", ("2", "3")),))
    study = study_in(tmp_path / "b", grid.points(("omni",), None, ()), 0)
    run_study(study)
    assert grid_dataset(grid, study).attrs["trials"] == [2, 3]
    assert [len(study.digest_of(index)["sum_rate"][0]) for index in (0, 1)] == [2, 3]


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
