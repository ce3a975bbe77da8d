"""Runs on unlabelled detections at the doors: JSON, files, tables, sweeps, pictures, bad input."""

from __future__ import annotations

import json

import numpy as np
import pytest
import xarray as xr

import echobeam as eb

from .test_cli import echobeam, refused

SCENARIO = """\
name = "coming"
schemes = ["water-filling"]

[array]
n_tx = 8

[radio]
power = 1e4

[radar]
crb = "exact"
detections = "unlabelled"
clutter = 2

[[objects]]
angle = "63 deg"
velocity = "10 m/s"

[[objects]]
angle = "45 deg"
velocity = "-5 m/s"
appears = "30 ms"
leaves = "0.15 s"

[frame]
slots_per_frame = 5
frames = 4

[filter]
velocity_prior = "30 m/s"
"""
SLOTS, TRIALS = 20, 3


@pytest.fixture
def place(tmp_path):
    (tmp_path / "coming.toml").write_text(SCENARIO)
    return tmp_path


def run(place, *more, out="r.nc"):
    return echobeam(
        "run", "coming.toml", "--trials", TRIALS, "--quiet", "--out", out, *more, cwd=place
    )


@pytest.mark.slow
def test_json_has_the_figures_of_tracks_and_a_labelled_run_has_none(place):
    done = run(place, "--json", "--scheme", "water-filling", "--scheme", "omni")
    assert done.returncode == 0, done.stderr
    for found in json.loads(done.stdout)["schemes"].values():
        for name in ("gospa", "ospa", "gospa_localisation", "gospa_missed", "gospa_false"):
            assert len(found[name]) == SLOTS
            assert all(value >= 0.0 for value in found[name])
        assert found["detection_delay"] >= 1.0  # the first detection's track is tentative
        for name in ("false_tracks", "identity_switches"):
            assert found[name] >= 0.0
        assert 0.0 < found["tracked"] < 1.0
        low, high = found["intervals"]["frame_gospa"]
        assert low <= found["frame_gospa"] <= high
    labelled = run(place, "--json", "--set", 'radar.detections="labelled"', out="l.nc")
    (found,) = json.loads(labelled.stdout)["schemes"].values()
    assert not {"gospa", "detection_delay", "false_tracks", "tracked"} & set(found)
    with xr.open_dataset(place / "l.nc") as result:
        assert not [name for name in result if str(name).startswith("track_")]


@pytest.mark.slow
def test_the_figures_in_json_are_those_of_the_file(place):
    """GOSPA of the first slot by hand: nothing is confirmed, and one object is there."""
    done = run(place, "--json")
    (found,) = json.loads(done.stdout)["schemes"].values()
    assert found["gospa"][0] == pytest.approx(np.sqrt(50.0))
    assert found["gospa_missed"][0] == pytest.approx(50.0)
    assert found["gospa_false"][0] == 0.0
    with xr.open_dataset(place / "r.nc") as result:
        held = np.isin(result["track_status"].values[0], [2, 3])
        about = np.where(held, result["track_object"].values[0], -1)
        present = result["present"].values.astype(bool)
    served = (about[..., None] == np.arange(2)).any(axis=-2) & present
    assert found["tracked"] == pytest.approx(served.sum() / present.sum())
    delays = []
    for trial in range(TRIALS):
        for who in range(2):
            if served[trial, :, who].any():
                delays.append(served[trial, :, who].argmax() - present[trial, :, who].argmax())
    assert found["detection_delay"] == pytest.approx(np.mean(delays))


@pytest.mark.slow
def test_the_file_says_what_its_tracks_are(place):
    assert run(place).returncode == 0
    with xr.open_dataset(place / "r.nc") as result:
        status = result["track_status"]
        assert status.dims == ("scheme", "trial", "slot", "track")
        assert status.attrs["flag_meanings"] == "none tentative confirmed coasting"
        assert list(status.attrs["flag_values"]) == [0, 1, 2, 3]
        assert set(np.unique(status)) <= {0, 1, 2, 3}
        assert result["track_state"].dims == (*status.dims, "state")
        assert result["track_state"].attrs["units"] == "rad, m, m/s"
        assert result["shared"].dims == ("scheme", "trial", "slot", "object")
        assert result.sizes["track"] == 16
        known = status.values != 0
        assert ((result["track_id"].values >= 0) == known).all()
        assert (np.isfinite(result["track_state"].values).all(axis=-1) == known).all()
        assert (result["track_object"].values[~known] == -1).all()
        identity = result["identity"].values
        assert (identity[:, :3] == [0, -1]).all()
        assert (identity[:, 3:15] == [0, 1]).all()
        assert (identity[:, 15:] == [0, -1]).all()
        absent = identity == -1
        assert np.isnan(result["truth"].values[absent]).all()
        assert np.isnan(result["rate"].values[0][absent]).all()


@pytest.mark.slow
def test_the_table_has_a_part_about_tracks(place):
    done = echobeam("run", "coming.toml", "--trials", 2, "--out", "r.nc", cwd=place)
    assert done.returncode == 0, done.stderr
    for words in ("GOSPA, m", "slots until an object is tracked", "false tracks per 100 slots"):
        assert words in done.stdout
    described = echobeam("describe", "coming.toml", cwd=place)
    assert described.returncode == 0, described.stderr


@pytest.mark.slow
def test_summary_and_pictures_of_an_unlabelled_result(place):
    run(place)
    table = eb.summary(place / "r.nc")
    (found,) = json.loads(run(place, "--json", "--force").stdout)["schemes"].values()
    for name in ("frame_gospa", "detection_delay", "false_tracks", "identity_switches", "tracked"):
        assert table.loc[("water-filling", name), "value"] == pytest.approx(found[name])
    assert table.loc[("water-filling", "frame_gospa"), "unit"] == "m"
    assert table.loc[("water-filling", "gospa"), "value"] == pytest.approx(np.mean(found["gospa"]))
    with xr.open_dataset(place / "r.nc") as result:
        for kind in ("rate", "tracking", "trajectories"):
            figure = eb.plot(result, kind)
            assert figure.axes
    done = echobeam("plot", "r.nc", "--kind", "rate", cwd=place)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_a_sweep_over_false_alarms_with_two_associations_side_by_side(place):
    schemes = [f"water-filling:association={one}" for one in ("jpda", "nearest")]
    asked = [part for scheme in schemes for part in ("--scheme", scheme)]
    done = echobeam(
        "sweep", "coming.toml", "--vary", "radar.false_alarm=1e-6,1e-4", *asked,
        "--trials", 2, "--csv", "s.csv", "--json", "--quiet", cwd=place,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert "frame_gospa" in json.dumps(document)
    with xr.open_dataset(place / "coming-sweep.nc") as result:
        assert result["frame_gospa"].sizes == {"radar.false_alarm": 2, "scheme": 2}
        assert np.isfinite(result["frame_gospa"]).all()
        table = eb.summary(result)
    assert "detection_delay" in (place / "s.csv").read_text()
    # A point of the sweep is a run.
    own = run(place, "--json", *asked, "--set", "radar.false_alarm=1e-4", "--trials", 2)
    for name, found in json.loads(own.stdout)["schemes"].items():
        for quantity in ("frame_gospa", "tracked", "frame_rate_mean"):
            row = table.xs(name, level="scheme").xs(quantity, level="quantity")
            assert row["value"].iloc[-1] == pytest.approx(found[quantity])


@pytest.mark.slow
def test_a_sweep_over_a_key_of_tracks_and_one_that_mixes_labels(place):
    done = echobeam(
        "sweep", "coming.toml", "--vary", "tracks.coast=1,6", "--trials", 2, "--quiet", cwd=place
    )
    assert done.returncode == 0, done.stderr
    done = echobeam(
        "sweep", "coming.toml", "--vary", "radar.detections=labelled,unlabelled", "--trials", 2,
        "--out", "m.nc", "--csv", "m.csv", "--quiet", cwd=place,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    with xr.open_dataset(place / "m.nc") as result:
        gospa = result["frame_gospa"].squeeze("scheme").values
        assert np.isnan(gospa[0])
        assert np.isfinite(gospa[1])
        assert len(eb.summary(result))


def test_keys_of_tracks_are_no_parameters_of_a_labelled_run(place):
    label = ("--set", 'radar.detections="labelled"')
    refused(
        run(place, *label, "--scheme", "temporal:association=mht"),
        'association: a parameter only of runs with radar.detections = "unlabelled"',
    )


@pytest.mark.slow
def test_a_result_without_some_of_its_tracks_has_no_summary(place):
    scenario = eb.load_scenario(place / "coming.toml").replace({"frame.frames": 1})
    result = eb.simulate(scenario, schemes=["water-filling"], trials=1)
    assert eb.summary(result)["value"]["water-filling", "false_tracks"] >= 0.0
    for cut in (result.isel(track=slice(0, 3)), result.isel(track=0)):
        with pytest.raises(eb.InputError, match="track"):
            eb.summary(cut)
    result.isel(object=[0]).to_netcdf(place / "objects.nc")
    result.drop_vars("track_id").to_netcdf(place / "id.nc")
    for name, told in (("objects", "1 of 2"), ("id", "holds no track_id")):
        refused(echobeam("plot", f"{name}.nc", "--kind", "gospa", cwd=place), told)
        refused(echobeam("plot", f"{name}.nc", "--kind", "consistency", cwd=place), told)


def test_the_genie_has_no_beams_for_nobody(place):
    scenario = eb.load_scenario(place / "coming.toml")
    result = eb.simulate(scenario, schemes=["genie"], trials=1)
    assert eb.summary(result)["value"]["genie", "rate_lost_to_false"] == 0.0


BAD = [
    (["--set", 'objects=[{angle=1.0, appears="0.2 s", leaves="0.1 s"}]'], ["leaves", "appears"]),
    (["--set", "tracks.capacity=0"], ["tracks.capacity", "1"]),
    (["--set", "radar.false_alarm=0"], ["radar.false_alarm"]),
    (["--set", "radar.false_alarm=1"], ["radar.false_alarm"]),
    (["--set", "tracks.confirm=4"], ["tracks.window", "confirm"]),
    (["--set", "radar.clutter=-1"], ["radar.clutter"]),
    (["--set", "tracks.gate=1.5"], ["tracks.gate"]),
    (["--set", 'tracks.association="nearst"'], ["tracks.association", "nearest"]),
    (["--scheme", "temporal:association=nearst"], ["association", "nearest"]),
    (["--scheme", "temporal:asociation=mht"], ["asociation", "association"]),
    (["--scheme", "temporal:confirm=4"], ["confirm"]),
    (["--scheme", "temporal:window=1"], ["window", "confirm"]),
    (["--set", 'radar.detections="unlabeled"'], ["radar.detections", "unlabelled"]),
]


@pytest.mark.parametrize(("arguments", "words"), BAD)
def test_bad_input_is_one_message_and_status_2(place, arguments, words):
    done = run(place, *arguments)
    refused(done, *words)
    assert not (place / "r.nc").exists()


def test_a_vehicle_that_is_twice_in_a_time_step_is_named(place):
    rows = [f"{t},car,{20 + 5 * t},0,5" for t in range(4)]
    rows.insert(2, "1,car,40,0,5")
    (place / "twice.csv").write_text("\n".join(["t,id,x,y,speed", *rows]))
    (place / "road.toml").write_text(SCENARIO[: SCENARIO.index("[[objects]]")])
    done = echobeam(
        "run", "road.toml", "--trace", "twice.csv", "--trials", 1, "--out", "r.nc", cwd=place
    )
    refused(done, "twice.csv", "'car'")


@pytest.mark.slow
def test_a_trace_of_vehicles_that_come_and_go(place):
    rows = [
        f"{t / 2},{name},{x + v * t / 2},0,{abs(v)}"
        for t in range(3)
        for name, x, v in (("a", 20, 10), ("b", 90, -15), ("c", 60, -5))
        if not (name == "c" and t < 1)
    ]
    (place / "trace.csv").write_text("\n".join(["t,id,x,y,speed", *rows]))
    (place / "road.toml").write_text(SCENARIO[: SCENARIO.index("[[objects]]")])
    more = ("--set", "frame.slots_per_frame=10", "--set", "frame.frames=8")
    done = echobeam(
        "run", "road.toml", "--trace", "trace.csv", "--trials", 2, "--out", "r.nc", *more,
        cwd=place,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    with xr.open_dataset(place / "r.nc") as result:
        assert (result["track_object"].values >= 0).any()
