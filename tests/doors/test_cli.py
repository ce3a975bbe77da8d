"""The command line as a user meets it: real processes, real files, exit statuses."""

import contextlib
import io
import json
import math
import os
import subprocess
import sys
import tomllib
from dataclasses import dataclass

import numpy as np
import pytest
import xarray as xr

from echobeam.cli.main import COMMANDS, main
from echobeam.cli.report import measured
from echobeam.scenario import BUILT_IN, preset_text

LIGHT = ["--scheme", "water-filling", "--scheme", "omni"]


@dataclass(frozen=True)
class Done:
    returncode: int
    stdout: str
    stderr: str


def echobeam(*arguments, cwd=None, stdin=None):
    """Run the command line in this process: a second faster than in one of its own."""
    out, err = io.StringIO(), io.StringIO()
    argv, status = ["echobeam", *map(str, arguments)], 0
    with (
        pytest.MonkeyPatch.context() as patch,
        contextlib.redirect_stdout(out),
        contextlib.redirect_stderr(err),
    ):
        patch.setattr(sys, "argv", argv)
        patch.setenv("COLUMNS", "100")
        patch.setattr(sys, "stdin", io.StringIO(stdin or ""))
        if cwd is not None:
            patch.chdir(cwd)
        try:
            main()
        except SystemExit as stop:
            status = stop.code or 0
    return Done(status, out.getvalue(), err.getvalue())


def process(*arguments, cwd=None):
    command = [sys.executable, "-c", "from echobeam.cli.main import main; main()"]
    return subprocess.run(
        [*command, *map(str, arguments)], capture_output=True, text=True, cwd=cwd, timeout=600
    )


def refused(done, *words):
    """Status 2, one clear message, no traceback, nothing on stdout."""
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""
    for word in words:
        assert word in done.stderr


def test_help_is_light():
    code = (
        "import sys; from echobeam.cli.main import cli;"
        "cli.main(['--help'], standalone_mode=False);"
        "heavy = {'numpy','scipy','xarray','matplotlib','clarabel','cvxpy','pydantic','rich'};"
        "sys.exit(', '.join(heavy & set(sys.modules)) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("command", COMMANDS)
def test_examples_in_help_stand_on_lines_of_their_own(command):
    lines = echobeam(command, "--help").stdout.splitlines()
    assert not any("\\b" in line or line.count("  echobeam ") > 1 for line in lines)
    examples = [line.split() for line in lines if line.startswith("  echobeam ")]
    assert examples or command in ("schemes", "beam")
    used_in = {"schemes": "run"}.get(command, command)
    assert all(example[1] == used_in for example in examples)


def test_importing_the_package_is_light():
    code = "import sys, echobeam; sys.exit('numpy' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code]).returncode == 0


@pytest.mark.slow
def test_a_fault_in_a_process_of_its_own_has_status_2(tmp_path):
    refused(process("run", "nowhere.toml", cwd=tmp_path), "nowhere.toml")


def test_describe_in_words_and_as_json(tmp_path):
    text = echobeam("describe", "paper-single").stdout
    for words in (
        "P_T = 1 ",
        "(-26.0 dBm)",
        "(55.6 dBsm)",
        "WARNING measurements reach",
        "far field",
    ):
        assert words in " ".join(text.split())
    assert max(map(len, text.splitlines())) <= 105
    near = ("--set", "array.n_tx=256", "--set", 'radio.carrier="28 GHz"')
    text = echobeam("describe", "paper-single", *near).stdout
    assert "WARNING far field: wavefronts are plane beyond 2 D^2 / lambda = 348 m" in text
    own = ("--set", "schemes.temporal.ripple=1")
    assert "temporal (ripple=1), pilot" in echobeam("describe", "paper-multi", *own).stdout
    text = echobeam("describe", "paper-height", "--set", "radar.target=3gpp-vehicle").stdout
    assert "mean cross-section of 11.25 dBsm" in " ".join(text.split())
    row = next(line for line in text.splitlines() if line.split()[2:3] == ["omni"])
    assert row.split()[-1] == "7.1"  # dBsm, from behind at 45 degrees
    document = json.loads(echobeam("describe", "paper-multi", "--json").stdout)
    assert document["scenario"] == "paper-multi"
    assert [one["name"] for one in document["objects"]] == ["object 1", "object 2"]
    assert document["objects"][1]["snr"] == pytest.approx(5e-5)  # 1 / 141.4^2
    (far,) = [one for one in document["assumptions"] if one["name"] == "far field"]
    assert far["holds"] is True
    (path,) = [one for one in document["assumptions"] if one["name"] == "line of sight"]
    assert (path["holds"], path["value"]) == (None, None)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["paper-mutli"], ["paper-mutli", "paper-multi"]),
        (["paper-multi", "--set", "radio.pwer=1"], ["radio.pwer", "power"]),
        (["paper-multi", "--set", "radio.power=30 dBm"], ["30 dBm", "1 W", "linear"]),
        (["paper-multi", "--set", "radio.power"], ["KEY=VALUE"]),
        (["paper-multi", "--set", 'schemes=["temproal"]'], ["temproal"]),
        (["paper-multi", "--trace", "nowhere.csv"], ["nowhere.csv"]),
        ([], ["SCENARIO"]),
    ],
)
def test_what_cannot_be_described_is_one_message_and_status_2(tmp_path, arguments, words):
    refused(echobeam("describe", *arguments, cwd=tmp_path), *words)


@pytest.mark.slow
def test_a_run_within_the_near_field_warns_on_stderr(tmp_path):
    near = ("--set", "array.n_tx=256", "--set", "frame.slots_per_frame=2", "--trials", 1)
    run = ("run", "paper-single", "--scheme", "omni", *near, "--json", "--out")
    done = echobeam(*run, "r.nc", cwd=tmp_path)
    assert json.loads(done.stdout)["scenario"] == "paper-single"
    (line,) = [line for line in done.stderr.splitlines() if line.startswith("warning")]
    assert "far field of the array begins at 325 m" in line
    assert echobeam(*run, "q.nc", "--quiet", cwd=tmp_path).stderr == ""


@pytest.mark.slow
def test_scenarios_are_listed_and_printed(tmp_path):
    listed = echobeam("scenarios").stdout.splitlines()
    assert [line.split()[0] for line in listed] == list(BUILT_IN)
    printed = echobeam("scenarios", "paper-multi").stdout
    assert printed == preset_text("paper-multi")
    (tmp_path / "mine.toml").write_text(printed.replace('name = "paper-multi"', 'name = "mine"'))
    done = echobeam("run", "mine.toml", *LIGHT, "--trials", 2, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "mine.nc").is_file()


def test_schemes_are_listed():
    lines = echobeam("schemes").stdout.splitlines()
    names = [line.split()[0] for line in lines if line and not line.startswith(" ")]
    assert {"temporal", "pilot", "water-filling", "genie", "omni"} <= set(names)
    assert any('ripple="0.1 N_t"' in line for line in lines)
    assert {"frame", "tracker", "beamer"} <= set(lines)


@pytest.mark.slow
def test_a_run_writes_a_result_and_prints_a_table(tmp_path):
    done = echobeam("run", "paper-multi", *LIGHT, "--trials", 5, "--out", "r.nc", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "water-filling" in done.stdout
    assert "r.nc" in done.stdout
    assert "±" in done.stdout
    assert "100%" in done.stderr
    with xr.open_dataset(tmp_path / "r.nc") as result:
        assert dict(result.sizes) == {
            "scheme": 2, "trial": 5, "slot": 10, "object": 2, "state": 3, "state_b": 3,
            "measurement": 3, "antenna": 30, "axis": 3, "part": 2,
        }  # fmt: skip
        assert result["scheme"].values.tolist() == ["water-filling", "omni"]
        assert result["slot"].values.tolist() == list(range(1, 11))
        assert result["time"].values[0] == 0
        assert result["present"].dtype == bool
        assert result["phase"].dims == ("scheme", "slot")
        assert tomllib.loads(result.attrs["scenario"])["name"] == "paper-multi"
        assert result.attrs["seed"] == 0
    assert not list(tmp_path.glob("*.blocks"))


@pytest.mark.slow
def test_json_and_nothing_else_on_stdout(tmp_path):
    done = echobeam(
        "run", "paper-multi", *LIGHT, "--trials", 4, "--seed", 7, "--json", "--quiet", cwd=tmp_path
    )
    assert done.returncode == 0
    assert done.stderr == ""
    document = json.loads(done.stdout)
    assert (document["scenario"], document["seed"], document["trials"]) == ("paper-multi", 7, 4)
    figures = document["schemes"]["omni"]
    assert len(figures["rate_mean"]) == len(figures["rate_interval"]) == 10
    assert {"frame_rate_mean", "frame_rate_q05", "angle_rmse", "fallbacks"} <= set(figures)
    taken = document["decision_seconds"]
    assert taken["omni"] == {"mean": None, "p99": None}
    assert 0 < taken["water-filling"]["mean"] <= taken["water-filling"]["p99"] < 1
    with xr.open_dataset(tmp_path / document["result"]) as result:
        rates = result["rate"].sel(scheme="omni").sum("object")
        np.testing.assert_allclose(figures["rate_mean"], rates.mean("trial"), rtol=1e-12)
        error = (result["estimated"] - result["truth"]).sel(scheme="omni", state="angle")
        rmse = np.sqrt((error**2).mean(("trial", "object")))
        np.testing.assert_allclose(figures["angle_rmse"], rmse, rtol=1e-9)


@pytest.mark.slow
def test_one_trial_has_no_interval(tmp_path):
    done = echobeam("run", "paper-multi", *LIGHT, "--trials", 1, "--json", cwd=tmp_path)
    assert json.loads(done.stdout)["schemes"]["omni"]["rate_interval"][0] == [None, None]


@pytest.mark.slow
def test_processes_do_not_change_a_bit(tmp_path):
    arguments = ("run", "paper-single", *LIGHT, "--trials", 300, "--quiet")
    assert echobeam(*arguments, "--out", "one.nc", cwd=tmp_path).returncode == 0
    done = process(*arguments, "--out", "two.nc", "--jobs", 2, cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    with xr.open_dataset(tmp_path / "one.nc") as one, xr.open_dataset(tmp_path / "two.nc") as two:
        for name in one.data_vars:
            np.testing.assert_array_equal(one[name].values, two[name].values)


@pytest.mark.slow
def test_an_existing_result_is_kept(tmp_path):
    arguments = ("run", "paper-multi", *LIGHT, "--trials", 1, "--quiet", "--out", "r.nc")
    assert echobeam(*arguments, cwd=tmp_path).returncode == 0
    before = (tmp_path / "r.nc").read_bytes()
    refused(echobeam(*arguments, cwd=tmp_path), "exists already", "--force")
    assert (tmp_path / "r.nc").read_bytes() == before
    assert echobeam(*arguments, "--force", cwd=tmp_path).returncode == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "nowhere.toml"], ["nowhere.toml", "no such file"]),
        (["run", "text.toml"], ["text.toml", "not a TOML file"]),
        (["run", "unknown.toml"], ["unknown.toml", "speling", "unknown key"]),
        (["run", "paper-multi", "--set", "uav.height=80 kg"], ["uav.height", "kg", "km"]),
        (["run", "paper-multi", "--set", "array.n_tx=-3"], ["array.n_tx", "-3"]),
        (["run", "paper-multi", "--set", "objects.0.angle=0 deg"], ["objects.0.angle"]),
        (["run", "paper-multi", "--set", "objects.0.angle=180 deg"], ["objects.0.angle"]),
        (["run", "paper-multi", "--set", "radio.power=nan"], ["radio.power", "nan"]),
        (["run", "paper-multi", "--set", "nonsense"], ["nonsense", "KEY=VALUE"]),
        (["run", "paper-multi", "--scheme", "temproal"], ["temproal", "did you mean"]),
        (["run", "paper-multi", "--scheme", "raises.py:f"], ["raises.py", "boom"]),
        (["run", "paper-multi", "--trials", "0"], ["trials", "0"]),
        (["run", "paper-multi", "--trials", "many"], ["trials", "many"]),
        (["run", "paper-multi", "--seed", "-1"], ["seed", "-1"]),
        (["run", "paper-multi", "--out", "no/where/r.nc"], ["no/where", "no directory"]),
        (["run", "paper-multi", "--out", "."], ["directory"]),
        (["run", "paper-multi", "--jobs", "0"], ["jobs"]),
        (["run", "paper-multi", "--trace", "nowhere.csv"], ["nowhere.csv"]),
        (["run", "paper-multi", "--trace", "empty.csv"], ["empty.csv"]),
        (["run", "paper-multi", "--trace", "cut.xml"], ["cut.xml"]),
        (["run", "paper-multi", "--trace", "cut.csv.gz"], ["cut.csv.gz"]),
        (["run", "paper-multi", "--trace", "point.csv"], ["point.csv"]),
        (["run"], ["SCENARIO"]),
        (["run", "paper-multi", "--bogus"], ["--bogus"]),
        (["bogus"], ["bogus"]),
        (["scenarios", "bogus"], ["bogus", "paper-multi"]),
        (["plot", "nowhere.nc"], ["nowhere.nc"]),
        (["plot", "text.toml"], ["text.toml"]),
        (["plot", "."], ["no such result"]),
        (["beam", "nowhere.json"], ["nowhere.json"]),
        (["beam", "text.toml"], ["text.toml"]),
    ],
)
def test_wrong_input_is_one_message_and_status_2(tmp_path, arguments, words):
    (tmp_path / "text.toml").write_text("this is no toml")
    (tmp_path / "unknown.toml").write_text(preset_text("paper-multi") + "\n[speling]\nx = 1\n")
    (tmp_path / "empty.csv").write_text("")
    (tmp_path / "cut.xml").write_text('<fcd-export><timestep time="0"><vehicle id="a" x="1" y=')
    (tmp_path / "cut.csv.gz").write_bytes(b"\x1f\x8b\x08\x00\x00\x00\x00\x00\x00\x03\x4b\x04")
    (tmp_path / "point.csv").write_text("t,id,x,y,speed\n0,a,1,2,3\n")
    (tmp_path / "raises.py").write_text("raise RuntimeError('boom')")
    light = [] if "--scheme" in arguments or arguments[0] != "run" else LIGHT
    refused(echobeam(*arguments, *light, cwd=tmp_path), *words)
    assert not list(tmp_path.glob("*.nc"))


def test_all_faults_of_a_file_are_reported_together(tmp_path):
    text = (
        preset_text("paper-multi")
        .replace("n_tx = 30", "n_tx = -3")
        .replace("\nripple =", "\nriple =")
    )
    (tmp_path / "bad.toml").write_text(text)
    refused(echobeam("run", "bad.toml", cwd=tmp_path), "2 faults", "array.n_tx", "coverage.riple")


def test_faults_of_options_are_reported_with_those_of_the_file(tmp_path):
    (tmp_path / "bad.toml").write_text(
        preset_text("paper-multi").replace("\nripple =", "\nriple =")
    )
    done = echobeam(
        "run", "bad.toml", "--set", "uav.height=80 kg", "--set", "nonsense", "--scheme", "temproal",
        "--scheme", "omni", "--trials", 0, "--seed", -1, cwd=tmp_path,
    )  # fmt: skip
    refused(done, "5 errors in the input", "bad.toml: 2 faults", "riple", "uav.height")
    refused(done, "--set nonsense", "'temproal'", "trials: 0", "seed: -1")
    done = echobeam(
        "sweep", "paper-single", "--vary", "radio.power", "--vary", "array.n_tx=", "--seed", -1,
        cwd=tmp_path,
    )  # fmt: skip
    refused(done, "3 errors in the input", "--vary radio.power:", "--vary array.n_tx=:", "seed: -1")


def test_schemes_of_a_faulty_file_its_trace_and_the_results_place_are_reported_at_once(tmp_path):
    (tmp_path / "bad.toml").write_text(
        'name = "bad"\nschemes = ["temporal", "nope"]\n[uav]\nheight = -5\n'
    )
    done = echobeam(
        "run", "bad.toml", "--trials", 0, "--trace", "nofile.csv", "--out", "nodir/x.nc",
        cwd=tmp_path,
    )  # fmt: skip
    refused(done, "5 errors in the input", "bad.toml: uav.height: -5", "nofile.csv: cannot be read")
    refused(done, "bad.toml: unknown scheme 'nope'", "trials: 0", "nodir/x.nc: no directory nodir")
    done = echobeam(
        "sweep", "bad.toml", "--vary", "array.n_tx=8", "--out", "nodir/x.nc", "--csv", "no/x.csv",
        "--scheme", "temporal:gate=0.9", cwd=tmp_path,
    )  # fmt: skip
    refused(done, "3 errors in the input", "uav.height", "nodir/x.nc: no directory", "no/x.csv: no")
    assert "gate" not in done.stderr  # which unlabelled runs have: the file does not say what it is
    assert not any(path.name != "bad.toml" for path in tmp_path.iterdir())


@pytest.mark.slow
def test_zero_objects_run_as_sensing_only(tmp_path):
    done = echobeam("run", "paper-multi", "--set", "objects=[]", "--trials", 2, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "0.000" in done.stdout


@pytest.mark.slow
def test_a_csv_trace_moves_the_objects(tmp_path):
    rows = [f"{t / 2},car{c},{20 * c + 5 * t},0,10" for t in range(20) for c in range(2)]
    (tmp_path / "trace.csv").write_text("\n".join(["t,id,x,y,speed", *rows]))
    done = echobeam(
        "run", "paper-multi", *LIGHT, "--trace", "trace.csv", "--trials", 2, "--out", "r.nc",
        cwd=tmp_path,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    with xr.open_dataset(tmp_path / "r.nc") as result:
        assert result["present"].values.all()
        speed = result["truth"].sel(state="velocity").values
        np.testing.assert_allclose(np.abs(speed), 10, rtol=1e-6)


@pytest.mark.skipif(os.geteuid() == 0, reason="the superuser may write anywhere")
def test_a_place_that_cannot_be_written(tmp_path):
    tmp_path.chmod(0o500)
    refused(echobeam("run", "paper-multi", "--out", tmp_path / "r.nc"), "cannot be written")


@pytest.mark.slow
def test_plot_draws_every_picture(tmp_path):
    echobeam("run", "paper-multi", *LIGHT, "--trials", 3, "--out", "r.nc", "--quiet", cwd=tmp_path)
    done = echobeam("plot", "r.nc", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    for kind in ("rate", "tracking", "patterns", "trajectories"):
        assert (tmp_path / f"r-{kind}.png").read_bytes().startswith(b"\x89PNG")
    done = echobeam("plot", "r.nc", "--kind", "rate", "--out", "figure.svg", cwd=tmp_path)
    assert "<svg" in (tmp_path / "figure-rate.svg").read_text()
    refused(echobeam("plot", "r.nc", "--out", "figure.doc", cwd=tmp_path), "doc")
    refused(echobeam("plot", "r.nc", "--out", "no/figure.png", cwd=tmp_path), "no directory no")


SWEEP = ["sweep", "paper-single", *LIGHT, "--set", "frame.slots_per_frame=4", "--trials", "5"]
GRID = ["--vary", "radio.power=0.1,1", "--vary", "objects.0.angle=60 deg,45 deg"]


def contents(directory):
    return {
        str(path.relative_to(directory)): path.read_bytes()
        for path in directory.rglob("*")
        if path.is_file()
    }


@pytest.mark.slow
def test_a_sweep_as_json_is_its_result_and_nothing_else(tmp_path):
    done = echobeam(*SWEEP, *GRID, "--json", "--quiet", "--out", "s.nc", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    document = json.loads(done.stdout)
    assert {key: document[key] for key in ("scenario", "seed", "trials", "result")} == {
        "scenario": "paper-single", "seed": 0, "trials": 5, "result": "s.nc",
    }  # fmt: skip
    assert document["vary"] == {
        "radio.power": [0.1, 1],
        "objects.0.angle": [math.radians(60), math.radians(45)],
    }
    assert len(document["points"]) == 4
    with xr.open_dataset(tmp_path / "s.nc") as result:
        for point in document["points"]:
            at = result.sel(point["settings"])
            for name, figures in point["schemes"].items():
                one = at.sel(scheme=name)
                assert set(figures) == {v for v in result.data_vars if "scheme" in result[v].dims}
                assert figures["frame_rate_mean"] == float(one["frame_rate_mean"])
                assert figures["rate_mean"] == one["rate_mean"].values.tolist()
                assert figures["rate_over_genie"] == [None] * 4  # there is no genie
            taken = point["decision_seconds"]
            assert taken["omni"] == {"mean": None, "p99": None}
            assert 0 < taken["water-filling"]["mean"] <= taken["water-filling"]["p99"] < 1


@pytest.mark.slow
def test_a_sweeps_table_shows_values_as_they_were_given(tmp_path):
    done = echobeam(*SWEEP, *GRID, "--out", "s.nc", cwd=tmp_path)
    assert done.returncode == 0
    assert "60 deg" in done.stdout
    assert "45 deg" in done.stdout
    assert f"{math.radians(60):.4f}" not in done.stdout


@pytest.mark.slow
def test_keys_vary_together_on_the_command_line(tmp_path):
    vary = ("--vary", "array.n_tx,array.n_rx=8,16")
    done = echobeam(*SWEEP, *vary, "--json", "--quiet", "--out", "s.nc", cwd=tmp_path)
    document = json.loads(done.stdout)
    assert document["vary"] == {"array.n_tx": [8, 16], "array.n_rx": [8, 16]}
    settings = [point["settings"] for point in document["points"]]
    assert settings == [{"array.n_tx": n, "array.n_rx": n} for n in (8, 16)]
    done = echobeam(*SWEEP, *vary, "--out", "t.nc", cwd=tmp_path)
    heads, *rows = done.stdout.splitlines()[2:5]
    assert heads.split() == ["array.n_tx", "array.n_rx", "water-filling", "omni"]
    for row, point in zip(rows, document["points"], strict=True):
        assert row.split()[:2] == [str(point["settings"]["array.n_tx"])] * 2
        mean = point["schemes"]["water-filling"]["frame_rate_mean"]
        low, high = point["schemes"]["water-filling"]["frame_rate_interval"]
        assert measured(mean, (low, high)) in row
    again = echobeam(*SWEEP, *vary, "--resume", "--out", "t.nc", cwd=tmp_path)
    assert again.stderr == "t.nc: already complete, nothing to do\n"


@pytest.mark.slow
def test_full_results_of_a_sweep_are_those_of_runs(tmp_path):
    done = echobeam(*SWEEP, *GRID, "--full", "--json", "--out", "s.nc", cwd=tmp_path)
    points = json.loads(done.stdout)["points"]
    settings = ["radio.power=1", "objects.0.angle=45 deg", "frame.slots_per_frame=4"]
    sets = [word for setting in settings for word in ("--set", setting)]
    run = ("run", "paper-single", *LIGHT, *sets, "--trials", 5, "--out", "r.nc", "--quiet")
    assert echobeam(*run, cwd=tmp_path).returncode == 0
    assert points[3]["settings"] == {"radio.power": 1, "objects.0.angle": math.radians(45)}
    with (
        xr.open_dataset(tmp_path / points[3]["result"]) as point,
        xr.open_dataset(tmp_path / "r.nc") as result,
    ):
        xr.testing.assert_equal(point, result)
        assert point.attrs["scenario"] == result.attrs["scenario"]
    refused(echobeam(*SWEEP, *GRID, "--full", "--out", "s.nc", cwd=tmp_path), "exists already")
    fewer = (*SWEEP, "--vary", "radio.power=1,2", "--full", "--force", "--out", "s.nc")
    assert echobeam(*fewer, cwd=tmp_path).returncode == 0
    assert sorted(path.name for path in (tmp_path / "s-points").iterdir()) == ["0001.nc", "0002.nc"]


@pytest.mark.slow
def test_plot_draws_a_sweep_and_each_of_its_points(tmp_path):
    vary = ("--vary", "array.n_tx=8,16", "--quiet")
    echobeam(*SWEEP, *vary, "--full", "--out", "f.nc", cwd=tmp_path)
    done = echobeam("plot", "f.nc", "--quantity", "outage", cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, "f.png\n")
    refused(echobeam("plot", "f.nc", "--kind", "rate", cwd=tmp_path), "no such picture of a sweep")
    done = echobeam("plot", "f-points/0001.nc", "--kind", "rate", cwd=tmp_path)
    assert done.returncode == 0, done.stderr


@pytest.mark.slow
def test_resuming_a_finished_sweep_says_so_and_changes_no_byte(tmp_path):
    arguments = (*SWEEP, *GRID, "--full", "--csv", "s.csv", "--out", "s.nc", "--resume")
    first = echobeam(*arguments, cwd=tmp_path)  # nothing to resume: it begins
    before = contents(tmp_path)
    assert set(before) == {"s.nc", "s.csv", *(f"s-points/{i:04d}.nc" for i in range(1, 5))}
    again = echobeam(*arguments, cwd=tmp_path)
    rates, times, end = first.stdout.partition("decision per trial and slot")
    assert times
    assert (again.returncode, again.stdout) == (0, rates + end[end.rindex("result:") :])
    assert again.stderr == "s.nc: already complete, nothing to do\n"
    assert contents(tmp_path) == before
    refused(echobeam(*arguments, "--seed", 1, cwd=tmp_path), "exists already")
    (tmp_path / "s.csv").unlink()
    assert echobeam(*arguments, cwd=tmp_path).returncode == 0
    assert contents(tmp_path) == before


@pytest.mark.slow
def test_resuming_a_finished_run_says_so(tmp_path):
    arguments = ("run", "paper-single", *LIGHT, "--trials", 2, "--out", "r.nc", "--resume")
    first = echobeam(*arguments, cwd=tmp_path)
    again = echobeam(*arguments, cwd=tmp_path)
    lines = first.stdout.splitlines(keepends=True)
    untimed = [line for line in lines if not line.startswith("decision per trial and slot")]
    assert len(untimed) == len(lines) - 1
    assert (again.returncode, again.stdout) == (0, "".join(untimed))
    assert again.stderr == "r.nc: already complete, nothing to do\n"
    again = echobeam(*arguments, "--json", "--quiet", cwd=tmp_path)
    assert json.loads(again.stdout)["decision_seconds"] is None


@pytest.mark.slow
def test_a_sweep_of_a_trace(tmp_path):
    rows = [f"{t / 2},car{c},{20 * c + 5 * t},0,10" for t in range(20) for c in range(2)]
    (tmp_path / "trace.csv").write_text("\n".join(["t,id,x,y,speed", *rows]))
    trace = ("sweep", "paper-multi", *LIGHT, "--trials", 2, "--trace", "trace.csv")
    vary = ("--vary", "radio.power=1,10")
    done = echobeam(*trace, *vary, "--full", "--out", "s.nc", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    run = ("run", "paper-multi", *LIGHT, "--trials", 2, "--trace", "trace.csv")
    assert echobeam(*run, "--set", "radio.power=10", "--out", "r.nc", cwd=tmp_path).returncode == 0
    with (
        xr.open_dataset(tmp_path / "s-points" / "0002.nc") as point,
        xr.open_dataset(tmp_path / "r.nc") as result,
    ):
        xr.testing.assert_equal(point, result)
    refused(echobeam(*trace, "--vary", "objects.0.angle=1,2", cwd=tmp_path), "--trace")


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], ["no key varies"]),
        (["--vary", "radio.power"], ["--vary radio.power", "KEY=V1,V2"]),
        (["--vary", "radio.power=1,1"], ["twice"]),
        (["--vary", "uav.height=80 m,8000 cm"], ["uav.height", "twice", "80 m and as 8000 cm"]),
        (["--vary", "radio.power=1,-1"], ["radio.power", "-1"]),
        (["--vary", "radio.pwer=1,2"], ["radio.pwer", "power"]),
        (["--vary", "schemes=1,2"], ["schemes"]),
        (["--vary", "radio.power=1,2", "--out", "no/where/s.nc"], ["no/where", "no directory"]),
        (["--vary", "radio.power=1,2", "--out", "."], ["directory"]),
        (["--vary", "radio.power=1,2", "--csv", "no/s.csv"], ["no/s.csv", "no directory"]),
        (["--vary", "radio.power=1,2", "--out", "s", "--csv", "./s"], ["s: is the result file"]),
        (["--vary", "radio.power=1,2", "--csv", "paper-single-sweep.nc"], ["is the result file"]),
        (["--vary", "radio.power=1,2", "--full", "--out", "taken.nc"], ["taken-points"]),
        (["--vary", "radio.power=1,2", "--trace", "nowhere.csv"], ["nowhere.csv"]),
        (["--vary", "radio.power=1,2", "--scheme", "temproal"], ["temproal"]),
        (["--vary", "radio.power=1,2", "--jobs", "0"], ["jobs"]),
    ],
)
def test_sweeps_that_are_none_are_one_message_and_status_2(tmp_path, arguments, words):
    (tmp_path / "taken-points").write_text("mine")
    refused(echobeam(*SWEEP, *arguments, cwd=tmp_path), *words)
    assert contents(tmp_path) == {"taken-points": b"mine"}
