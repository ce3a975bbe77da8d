"""Python's door beside the shell's: the same numbers, files and messages from both."""

import contextlib
import io
import json
import os
import pty
import subprocess
import sys
import types
from itertools import product
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import xarray as xr

import echobeam as eb
from echobeam.cli.main import cli
from echobeam.commands import progress as bars
from echobeam.commands.sweep import axes_of
from echobeam.simulation import blocks

pytestmark = pytest.mark.slow  # the quick selection stays under a minute

LIGHT = ["water-filling", "omni"]
SHELL = ["--scheme", "water-filling", "--scheme", "omni"]


def shell(*arguments):
    """Run a command; return what it prints on stdout."""
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(io.StringIO()):
        cli.main([*map(str, arguments)], standalone_mode=False)
    return out.getvalue()


def told(call, *arguments, **named):
    """Return the message of wrong input."""
    with pytest.raises(eb.InputError) as error:
        call(*arguments, **named)
    return str(error.value)


def same(one, two):
    """Bit for bit, but for the moment of writing."""
    (a, b) = (each.load().copy() for each in (one, two))
    for each in (a, b):
        each.attrs.pop("created")
    xr.testing.assert_identical(a, b)


@pytest.fixture(autouse=True)
def _here(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


@pytest.fixture
def small_blocks(monkeypatch):
    """A run of a few trials in several blocks."""
    monkeypatch.setattr(blocks, "MOST_TRIALS", 2)


def test_a_run_is_the_shells_bit_for_bit(tmp_path):
    shell("run", "paper-multi", *SHELL, "--trials", 7, "--seed", 3, "--set", "uav.height=80 m",
          "--out", "shell.nc")  # fmt: skip
    wanted = {"schemes": LIGHT, "trials": 7, "seed": 3}
    with (
        eb.run("paper-multi", **wanted, set={"uav.height": "80 m"}) as named,
        eb.run("paper-multi", **wanted, set=["uav.height=80 m"], out=tmp_path / "b.nc") as texts,
        xr.open_dataset("shell.nc", engine="h5netcdf") as expected,
    ):
        same(named, expected)
        same(texts, expected)
    simulated = eb.simulate(eb.load_scenario("paper-multi", {"uav.height": 80}), **wanted)
    for name in eb.simulate("paper-multi", ["omni"], 1):
        np.testing.assert_array_equal(simulated[name].values, expected_values(name))
    assert (tmp_path / "paper-multi.nc").is_file()


def test_a_result_has_the_name_of_the_scenarios_file(tmp_path):
    """An edited copy may have kept the name inside."""
    scenario = eb.load_scenario("paper-single", {"frame.frames": 1})
    Path("mine.v2.toml").write_text(scenario.to_toml(), encoding="utf-8")
    eb.run("mine.v2.toml", scheme="omni", trials=1).close()
    eb.run(scenario, scheme="omni", trials=1).close()
    eb.run("paper-multi", scheme="omni", trials=1, set={"name": "renamed"}).close()
    assert {path.name for path in tmp_path.glob("*.nc")} == {
        "mine.v2.nc", "paper-single.nc", "renamed.nc",
    }  # fmt: skip


def expected_values(name):
    with xr.open_dataset("shell.nc", engine="h5netcdf") as expected:
        return expected[name].values


def test_a_result_that_is_replaced_is_read_anew():
    first = eb.run("paper-single", scheme="omni", trials=2, out="r.nc")
    second = eb.run("paper-single", scheme="omni", trials=3, out="r.nc", force=True)
    assert (first.sizes["trial"], second.sizes["trial"]) == (2, 3)
    assert np.isfinite(second["rate"].values).all()
    first.close()
    second.close()


@pytest.mark.parametrize(
    ("shells", "pythons"),
    [
        (["paper-multi", "--set", "uav.hight=3"], {"set": {"uav.hight": 3}}),
        (["paper-multi", "--set", "uav.height=-5 m"], {"set": {"uav.height": "-5 m"}}),
        (["paper-multi", "--set", "uav.height"], {"set": ["uav.height"]}),
        (["paper-multi", "--trials", "0", "--seed", "-1"], {"trials": 0, "seed": -1}),
        (["paper-multi", "--scheme", "needle"], {"schemes": ["needle"]}),
        (["paper-multi", "--scheme", "omni:ripple=1"], {"scheme": "omni:ripple=1"}),
        (["paper-multi", "--trace", "no.csv"], {"trace": "no.csv"}),
        (["nowhere.toml", "--set", "x"], {"set": "x"}),
        (["paper-multi", "--out", "no/r.nc"], {"out": "no/r.nc"}),
    ],
)
def test_a_fault_has_the_shells_message(shells, pythons):
    scenario = shells[0]
    assert told(shell, "run", *shells) == told(eb.run, scenario, **pythons)


def test_arguments_that_only_python_has_are_checked():
    assert "give only one of them" in told(eb.run, "paper-multi", scheme="omni", schemes=["omni"])
    assert "at least one" in told(eb.run, "paper-multi", schemes=[])
    assert "simulate also accepts functions" in told(eb.run, "paper-multi", schemes=[len])
    assert "jobs: 0" in told(eb.run, "paper-multi", jobs=0)
    assert "jobs: True" in told(eb.simulate, "paper-multi", jobs=True)
    assert "jobs: 1.5" in told(eb.reproduce, "t1", jobs=1.5)
    assert "uav.height" in told(eb.run, "paper-multi", set={"uav.height": object()})
    assert "list of values" in told(eb.sweep, "paper-multi", {"uav.height": "80 m"})
    assert "no key varies" in told(eb.sweep, "paper-multi", {})
    assert "vary: None is not accepted" in told(eb.sweep, "paper-multi", None)
    assert "vary 3: no key" in told(eb.sweep, "paper-multi", {3: [1, 2]})
    assert "vary 'uav.height,': no key" in told(eb.sweep, "paper-multi", {"uav.height,": [1]})
    assert "exists already" in told(_twice)


def _twice():
    eb.run("paper-single", scheme="omni", trials=1, out="r.nc").close()
    eb.run("paper-single", scheme="omni", trials=1, out="r.nc")


def test_any_setting_arrives_as_it_was_given():
    given = {
        "description": 'quotes " and \\ and ü',
        "array.n_tx": np.int64(16),
        "uav.height": np.float64(80),
        "objects.0.angle": "60 deg",
        "radar.rcs": np.array([100.0, 120.0]),
        "truth.process_noise": True,
        "schemes": ("omni",),
    }
    with eb.run("paper-single", set=given, trials=1) as result:
        text = result.attrs["scenario"]
    assert text == eb.load_scenario("paper-single", given).to_toml()
    assert "n_tx = 16" in text
    assert "rcs = [100.0, 120.0]" in text


@pytest.mark.slow
def test_a_sweep_is_the_shells_number_for_number():
    shell("sweep", "paper-single", *SHELL, "--vary", "radio.power=0.1,1", "--vary",
          "array.n_tx=8,16", "--trials", 3, "--out", "shell.nc", "--csv", "shell.csv")  # fmt: skip
    vary = {"radio.power": [0.1, 1], "array.n_tx": np.array([8, 16])}
    with (
        eb.sweep("paper-single", vary, schemes=LIGHT, trials=np.int64(3), csv="mine.csv") as mine,
        xr.open_dataset("shell.nc", engine="h5netcdf") as expected,
    ):
        a, b = mine.load(), expected.load()
        pd.testing.assert_frame_equal(pd.read_csv("mine.csv"), pd.read_csv("shell.csv"))
    assert a.attrs.pop("created")
    assert b.attrs.pop("created")
    xr.testing.assert_identical(a, b)
    again = eb.sweep("paper-single", ["radio.power=0.1,1", "array.n_tx=8,16"], schemes=LIGHT,
                     trials=3, resume=True)  # fmt: skip
    assert again.attrs["job"] == a.attrs["job"]
    again.close()
    message = told(shell, "sweep", "paper-single", "--vary", "radio.powr=1,2", "--trials", "0")
    assert message == told(eb.sweep, "paper-single", {"radio.powr": [1, 2]}, trials=0)


def test_a_scenario_a_name_and_a_path_are_one_grid(tmp_path):
    scenario = eb.load_scenario("paper-single", {"uav.height": "80 m"})
    (tmp_path / "mine.toml").write_text(scenario.to_toml(), encoding="utf-8")
    sources = {"a.nc": scenario, "b.nc": tmp_path / "mine.toml", "c.nc": "mine.toml"}
    jobs = set()
    for out, source in sources.items():
        with eb.sweep(source, {"array.n_tx": [8, 9]}, scheme="omni", trials=1, out=out) as swept:
            jobs.add((swept.attrs["job"], swept["array.n_tx"].values.tolist() == [8, 9]))
    assert len(jobs) == 1
    assert "is no scenario" in told(eb.run, None)
    assert "is no scenario" in told(eb.simulate, {"name": "x"})
    assert "--vary 3" in told(eb.sweep, scenario, [3])
    assert "--set 3" in told(eb.load_scenario, scenario, [3])


def test_axes_are_the_texts_of_the_shell():
    def columns(vary):
        return [axis().columns for axis in axes_of(vary)]

    assert columns({"a": [1, 2.5], "b": ["80 m", np.float64(9)]}) == [
        (("a", ("1", "2.5")),),
        (("b", ("80 m", "9.0")),),
    ]
    assert columns({("a", "b"): [(16, 8), 32]}) == [(("a", ("16", "32")), ("b", ("8", "32")))]
    assert columns({"radar.rcs": [[1, 2], (3, 4)]}) == [(("radar.rcs", ("[1, 2]", "[3, 4]")),)]
    assert columns("a=1,2") == columns(["a=1,2"]) == columns({"a": range(1, 3)})
    assert "expected 2 values" in told(columns, {("a", "b"): [(16, 8, 4)]})
    assert "a number" in told(columns, {"a": [None]})


@pytest.mark.slow
def test_the_names_of_one_object_are_a_list_as_well():
    """`identity` is an index into them."""
    with eb.run("paper-single", scheme="omni", trials=1, out="r.nc") as result:
        assert list(result.attrs["names"]) == eb.simulate("paper-single", "omni", 1).attrs["names"]


def test_keys_that_vary_together_are_a_tuple_or_a_text_with_commas():
    expected = [("array.n_tx", ("8", "16")), ("array.n_rx", ("8", "4"))]
    for keys in (("array.n_tx", "array.n_rx"), "array.n_tx, array.n_rx"):
        (read,) = axes_of({keys: [8, (16, 4)]})
        assert list(read().columns) == expected


def test_claims_are_those_of_the_file(tmp_path):
    claims = eb.reproduce("t4", trials=2, out=tmp_path / "mine")
    shell("reproduce", "t4", "--trials", 2, "--out", tmp_path / "shell", "--quiet")
    expected = json.loads((tmp_path / "shell" / "claims.json").read_text(encoding="utf-8"))
    assert claims == expected["claims"]
    assert {"id", "verdict", "ours", "interval"} <= set(claims[0])
    assert (tmp_path / "mine" / "t4.png").is_file()
    assert "exists already" in told(eb.reproduce, ["t4"], trials=2, out=tmp_path / "mine")
    assert told(eb.reproduce, "t99") == told(shell, "reproduce", "t99")
    assert "trials: 1 is not accepted" in told(eb.reproduce, "t4", trials=1)


@pytest.mark.slow
def test_pictures_formats_are_a_list_or_the_shells_text(tmp_path):
    for word, given in product(("format", "formats"), ("png, pdf", ["png", "pdf"])):
        eb.reproduce("approx", out=tmp_path / "r", force=True, **{word: given})
        assert {path.suffix for path in (tmp_path / "r").glob("approx.*")} >= {".png", ".pdf"}
        (tmp_path / "r" / "approx.pdf").unlink()
        assert "accepted: png, pdf, svg" in told(eb.reproduce, "approx", **{word: "bmp"})
    assert "give one of the two" in told(eb.reproduce, "approx", format="png", formats="png")


def test_a_description_takes_what_the_command_takes(tmp_path):
    (tmp_path / "t.csv").write_text("t,id,x,y\n0,a,0,0\n1,a,20,0\n2,a,40,0\n")
    given = {"uav.height": "80 m", "frame.frames": 1}
    document = json.loads(
        shell("describe", "traffic", "--set", "uav.height=80 m", "--set", "frame.frames=1",
              "--trace", "t.csv", "--json")
    )  # fmt: skip
    mine = eb.describe("traffic", set=given, trace="t.csv")
    assert mine.scenario.uav.height == 80.0
    assert mine.scenario.trace.file == str(tmp_path / "t.csv")
    assert len(mine.objects) == len(document["objects"]) == 1
    assert mine.objects[0].snr == document["objects"][0]["snr"]
    assert "uav.hight" in told(eb.describe, "traffic", set={"uav.hight": 1})


@pytest.mark.parametrize("value", ["uav.height=80", None, [1]])
def test_a_scenario_is_replaced_by_keys_and_values_alone(value):
    assert "dotted keys and their values" in told(eb.load_scenario("paper-single").replace, value)


def test_a_summary_has_the_figures_of_the_shells_json():
    document = json.loads(
        shell("run", "paper-multi", *SHELL, "--trials", 6, "--out", "r.nc", "--json")
    )
    table = eb.summary("r.nc")
    assert table.index.names == ["scheme", "quantity"]
    assert list(table.columns) == ["value", "low", "high", "unit"]
    for scheme, figures in document["schemes"].items():
        for name in ("frame_rate_mean", "frame_rate_q05", "lost", "fallbacks"):
            assert table.loc[(scheme, name), "value"] == figures[name]
        low, high = figures["frame_rate_interval"]
        assert table.loc[(scheme, "frame_rate_mean"), ["low", "high"]].tolist() == [low, high]
        angle = [value for value in figures["angle_rmse"] if value is not None]
        assert table.loc[(scheme, "angle_rmse"), "value"] == pytest.approx(np.mean(angle))
        assert table.loc[(scheme, "angle_rmse"), "unit"] == "rad"
    with xr.open_dataset("r.nc", engine="h5netcdf") as result:
        pd.testing.assert_frame_equal(eb.summary(result), table)
        some = eb.summary(result.sel(scheme=["omni"]))
        pd.testing.assert_frame_equal(some, table.loc[["omni"]])
        assert "list" in told(eb.summary, result.sel(scheme="omni"))
        assert "1 of 10 along slot" in told(eb.summary, result.isel(slot=[0]))
        assert "truth missing" in told(eb.summary, result.drop_vars("truth"))
    assert "no such result" in told(eb.summary, "missing.nc")


def test_the_summary_of_a_sweep_has_rows_for_every_point():
    with eb.sweep(
        "paper-single", {"uav.height": ["80 m", "90 m"]}, scheme="omni", trials=3
    ) as swept:
        table = eb.summary(swept)
    assert table.index.names == ["uav.height", "scheme", "quantity"]
    for height in (80.0, 90.0):
        alone = eb.simulate(eb.load_scenario("paper-single", {"uav.height": height}), "omni", 3)
        pd.testing.assert_frame_equal(table.loc[height], eb.summary(alone))
    pd.testing.assert_frame_equal(eb.summary("paper-single-sweep.nc"), table)


def test_names_are_those_of_the_lists():
    assert eb.scenarios() == [line.split()[0] for line in shell("scenarios").splitlines()]
    listed = [line.split()[0] for line in shell("schemes").splitlines() if line[:1].islower()]
    assert eb.schemes() == listed[: len(eb.schemes())]
    import echobeam.schemes.base  # whoever imports the package can still ask it

    assert echobeam.schemes() == eb.schemes()
    assert set(eb.__all__) == set(dir(eb))
    for name in eb.__all__:
        assert getattr(eb, name) is not None


@pytest.mark.parametrize("kind", [int, np.int8, np.uint64, np.array])
def test_whole_numbers_of_any_kind_are_whole_numbers(kind):
    given = eb.simulate("paper-single", "omni", kind(3), kind(5), jobs=kind(1))
    same(given, eb.simulate("paper-single", "omni", 3, 5))
    assert eb.LinearArray(kind(8)) == eb.LinearArray(8)
    assert eb.PlanarArray(kind(4), kind(2)).n == 8
    problem = eb.BeamProblem([1.3], [100.0], [0.05], 3, 0, 1, 1, kind(16))
    assert problem.n_tx == 16
    assert eb.load_scenario("paper-single", {"array.n_tx": kind(8)}).array.n_tx == 8
    assert next(iter(eb.slots("paper-single", "omni", kind(5), trial=kind(2)))).slot == 1


@pytest.mark.parametrize("value", [True, 3.5, 3.0, "3", np.array([3]), np.float64(3), None])
def test_what_is_no_whole_number_is_refused(value):
    assert "seed" in told(eb.simulate, "paper-single", "omni", 3, value)
    assert "jobs" in told(eb.simulate, "paper-single", "omni", 3, jobs=value)
    assert "trial" in told(list, eb.slots("paper-single", "omni", trial=value))
    assert "n must" in told(eb.LinearArray, value)


# Progress


def test_progress_is_told_to_a_function(small_blocks):
    calls = []
    eb.simulate("paper-single", LIGHT, 5, progress=lambda done, total: calls.append((done, total)))
    assert calls[-1] == (5 * 10 * 2, 5 * 10 * 2)
    assert [done for done, _ in calls] == sorted(done for done, _ in calls)


@pytest.mark.slow
def test_progress_of_processes_is_told_too(small_blocks):
    calls = []
    eb.simulate("paper-single", "omni", 5, jobs=2, progress=lambda *told: calls.append(told))
    assert calls[-1] == (50, 50)


def test_nothing_is_shown_without_a_terminal(capfd, monkeypatch):
    monkeypatch.setattr(bars, "SHORT", 0.0)
    eb.simulate("paper-single", "omni", 2)
    assert capfd.readouterr() == ("", "")


def test_a_terminal_has_a_bar_unless_it_is_not_wanted(monkeypatch):
    monkeypatch.setattr(bars, "SHORT", 0.0)
    for progress, seen in ((True, True), (False, False)):
        master, slave = pty.openpty()
        with open(slave, "w", encoding="utf-8") as terminal, contextlib.redirect_stderr(terminal):
            eb.simulate("paper-single", "omni", 2, progress=progress)
            print("end", file=terminal, flush=True)
            text = b""
            while b"end" not in text:
                text += os.read(master, 100_000)
        os.close(master)
        assert (b"paper-single" in text) == seen


class Handle:
    def __init__(self, shown):
        self.shown = shown

    def update(self, bundle, raw):
        assert raw
        self.shown.append(bundle["text/plain"])


def test_a_notebook_has_a_line_that_changes(monkeypatch, recwarn, capfd):
    shown = []

    def display(bundle, raw, display_id):
        assert raw
        assert display_id
        shown.append(bundle["text/plain"])
        return Handle(shown)

    ipython, module = types.ModuleType("IPython"), types.ModuleType("IPython.display")
    ipython.get_ipython = lambda: types.SimpleNamespace(kernel=object())
    module.display = display
    monkeypatch.setitem(sys.modules, "IPython", ipython)
    monkeypatch.setitem(sys.modules, "IPython.display", module)
    monkeypatch.setattr(bars, "SHORT", 0.0)
    monkeypatch.setattr(bars, "BETWEEN_UPDATES", 0.0)
    eb.simulate("paper-single", "omni", 2)
    assert shown[0].startswith("paper-single: ")
    assert "100%" in shown[-1]
    assert len(shown) > 5
    assert capfd.readouterr() == ("", "")
    assert not recwarn.list
    shown.clear()
    eb.simulate("paper-single", "omni", 2, progress=False)
    ipython.get_ipython = lambda: None  # IPython is imported, and nobody's shell
    eb.simulate("paper-single", "omni", 2)
    assert shown == []


def test_a_log_has_a_line_now_and_then(monkeypatch, capsys):
    clock = iter(range(0, 1000, 10))
    monkeypatch.setattr(bars, "monotonic", lambda: next(clock))
    with bars.progress_bar("work", quiet=False) as show:
        for done in range(1, 11):
            show(done, 10)
    lines = capsys.readouterr().err.splitlines()
    assert 3 <= len(lines) < 11
    assert lines[0].startswith("work: ")
    assert "left" in lines[0]
    assert lines[-1].startswith("work: 100%")
    with bars.progress_bar("work", quiet=True) as show:
        show(1, 1)
    assert capsys.readouterr().err == ""


# Processes


@pytest.mark.slow
def test_numbers_do_not_depend_on_the_processes(small_blocks, tmp_path, monkeypatch):
    (tmp_path / "elsewhere.py").write_text(
        "import numpy as np\nimport echobeam as eb\n\n"
        "@eb.scheme('even')\n"
        "def even(prior, view):\n"
        "    n = view.system.array.n_tx\n"
        "    return np.full((*prior.status.shape, n), 0.1 / n)\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    from importlib import import_module

    even = import_module("elsewhere").even
    schemes = ["water-filling", even, "elsewhere.py:even:angle_std=1 deg"]
    one, two = (eb.simulate("paper-multi", schemes, 7, seed=1, jobs=jobs) for jobs in (1, 2))
    same(one, two)


def test_a_scheme_that_cannot_travel_says_what_to_do(small_blocks):
    @eb.scheme("local")
    def local(prior, view):
        raise AssertionError("never called")

    message = told(eb.simulate, "paper-single", [local], 5, jobs=2)
    assert "scheme 'local' cannot be sent to other processes" in message
    assert "jobs=1" in message
    assert "\n" not in message
    lazy = told(eb.simulate, "paper-single", lambda prior, view: 0, 5, jobs=2)
    assert "cannot be sent to other processes" in lazy


@pytest.mark.slow
def test_a_script_needs_no_guard_for_its_processes(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(
        "import echobeam as eb\n"
        "from echobeam.simulation import blocks\n"
        "blocks.MOST_TRIALS = 2\n"
        "print('begun')\n"
        "print(eb.simulate('paper-single', 'omni', 5, jobs=2).sizes['trial'])\n"
        "def mine(prior, view): return 0\n"
        "try:\n"
        "    eb.simulate('paper-single', mine, 5, jobs=2)\n"
        "except eb.SchemeError as error:\n"
        "    print(error)\n"
    )
    done = subprocess.run(
        [sys.executable, script], capture_output=True, text=True, cwd=tmp_path, timeout=300
    )
    assert (done.returncode, done.stderr) == (0, "")
    begun, trials, message = done.stdout.splitlines()
    assert (begun, trials) == ("begun", "5")
    assert "in the script or notebook itself" in message
