"""Surroundings are no fault of ours: displays, encodings, file names, homes, results cut."""

import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import echobeam as eb

from .test_cli import echobeam, refused

pytestmark = pytest.mark.slow  # the quick selection stays under a minute

LIGHT = ["--scheme", "omni", "--trials", 2]
ODD = os.fsdecode(b"stra\xdfe")
"""A file name that was packed on a machine of another encoding."""


MAIN = "from echobeam.cli.main import main; main()"


def process(*arguments, cwd, begin=(), code=MAIN, **environment):
    command = [*begin, sys.executable, "-c", code]
    return subprocess.run(
        [*command, *map(str, arguments)],
        capture_output=True,
        cwd=cwd,
        env={**os.environ, **environment},
    )


@pytest.fixture(scope="module")
def result(tmp_path_factory):
    """A result on disk, not to be changed."""
    path = tmp_path_factory.mktemp("result") / "r.nc"
    done = echobeam("run", "paper-single", *LIGHT, "--scheme", "water-filling", "--out", path)
    assert done.returncode == 0, done.stderr
    return path


# displays


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["module://nowhere", "tkagg"])
def test_a_notebooks_back_end_does_not_matter_to_pictures(tmp_path, result, backend):
    arguments = ["plot", result, "--kind", "rate", "--out", tmp_path / "p.png"]
    done = process(*arguments, cwd=tmp_path, MPLBACKEND=backend, DISPLAY="")
    assert (done.returncode, done.stderr) == (0, b"")
    assert (tmp_path / "p-rate.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_nor_does_it_to_reproduction(tmp_path):
    arguments = ["reproduce", "approx", "--trials", 2, "--quiet"]
    done = process(*arguments, cwd=tmp_path, MPLBACKEND="module://matplotlib_inline.nowhere")
    assert (done.returncode, done.stderr) == (0, b"")


# encodings

NAMED = 'name = "Überflug 飛行"\nschemes = ["omni"]\n[[objects]]\nangle = "60 deg"\n'
ASCII = {"LC_ALL": "C", "PYTHONUTF8": "0", "PYTHONCOERCECLOCALE": "0"}


@pytest.mark.slow
def test_a_locale_that_cannot_name_the_result_asks_for_another_name(tmp_path):
    named = "import echobeam as eb; eb.run({!r}, set={{'name': '\\xdcberflug'}}, {})"
    small = "scheme='omni', trials=1, quiet=True"
    done = process(code=named.format("paper-single", small), cwd=tmp_path, **ASCII)
    assert b"locale" in done.stderr
    assert b"give another --out" in done.stderr
    assert not list(tmp_path.iterdir())
    done = process(code=named.format("paper-single", f"{small}, out='r.nc'"), cwd=tmp_path, **ASCII)
    assert done.returncode == 0
    assert 'name = "Überflug"' in xr.load_dataset(tmp_path / "r.nc").attrs["scenario"]


@pytest.mark.slow
def test_a_name_inside_the_file_is_no_trouble_in_any_locale(tmp_path):
    (tmp_path / "s.toml").write_text(NAMED, encoding="utf-8")
    done = process("run", "s.toml", *LIGHT, cwd=tmp_path, **ASCII)
    assert done.returncode == 0
    assert xr.load_dataset(tmp_path / "s.nc").attrs["scenario"].startswith('name = "Überflug 飛行"')


@pytest.mark.slow
@pytest.mark.parametrize("encoding", ["cp437", "utf-8"])
def test_a_terminal_of_few_letters_prints_what_it_can(tmp_path, encoding):
    (tmp_path / "s.toml").write_text(NAMED, encoding="utf-8")
    arguments = ["run", "s.toml", *LIGHT, "--out", "r.nc", "--force"]
    done = process(*arguments, cwd=tmp_path, PYTHONIOENCODING=encoding)
    assert done.returncode == 0, done.stderr
    said = done.stdout.decode(encoding)
    assert "result: r.nc" in said
    for letter in "Ü±飛":
        try:
            assert letter.encode(encoding).decode(encoding) in said
        except UnicodeEncodeError:
            assert letter.encode("ascii", "backslashreplace").decode() in said


@pytest.mark.parametrize(
    ("content", "words"),
    [
        pytest.param(NAMED.encode("utf-16"), "UTF-16 text; save it as UTF-8", id="utf-16"),
        pytest.param(NAMED.encode("latin-1", "replace"), "not UTF-8 text", id="latin-1"),
        pytest.param(NAMED.encode("utf-16-le"), "not a TOML file", id="utf-16 without a mark"),
        pytest.param(b"\x89PNG\r\n\x1a\n", "not UTF-8 text", id="picture"),
    ],
)
def test_a_scenario_of_another_encoding_is_one_message(tmp_path, content, words):
    (tmp_path / "s.toml").write_bytes(content)
    refused(echobeam("run", "s.toml", *LIGHT, cwd=tmp_path), "s.toml", words)


def test_a_byte_order_mark_is_read_over(tmp_path):
    (tmp_path / "s.toml").write_text(NAMED, encoding="utf-8-sig")
    done = echobeam("run", "s.toml", *LIGHT, "--quiet", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("value", ["100,5 m", "100,5", "1.000,5 m", "-3,5 m", "+0,1 km", "1,000 m"])
def test_a_decimal_comma_is_named(tmp_path, value):
    text = NAMED + f'[uav]\nheight = "{value}"\n'
    (tmp_path / "s.toml").write_text(text, encoding="utf-8")
    done = echobeam("run", "s.toml", *LIGHT, cwd=tmp_path)
    refused(done, f"uav.height: '{value}' is no number; decimals take a point")


# file names


def trace(path):
    rows = [f"{t},a,{20 * t},0" for t in range(5)]
    path.write_text("\n".join(["t,id,x,y", *rows]))
    return path


def test_a_traces_name_does_not_decide_whether_there_is_a_result(tmp_path):
    trace(tmp_path / f"{ODD}.csv")
    arguments = ["traffic", "--trace", f"{ODD}.csv", *LIGHT, "--quiet"]
    done = echobeam("run", *arguments, "--out", "r.nc", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    document = tomllib.loads(xr.load_dataset(tmp_path / "r.nc").attrs["scenario"])
    assert document["trace"]["file"] == f"{tmp_path}/stra\\udcdfe.csv"
    vary = ["--vary", "radio.power=1,2", "--full", "--csv", f"{ODD}-table.csv"]
    done = echobeam("sweep", *arguments, *vary, "--out", f"{ODD}.nc", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / f"{ODD}-table.csv").is_file()
    assert (tmp_path / f"{ODD}-points" / "0002.nc").is_file()


def test_a_scenario_keeps_the_name_of_its_trace_when_it_is_changed(tmp_path):
    path = trace(tmp_path / f"{ODD}.csv")
    scenario = eb.load_scenario("traffic").with_trace(path)
    assert scenario.replace({"radio.power": 2}).trace.file == str(path)


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["scenario", "out", "scheme", "directory"])
def test_other_files_of_such_names_work_too(tmp_path, kind):
    place = tmp_path / ODD if kind == "directory" else tmp_path
    place.mkdir(exist_ok=True)
    name = f"{ODD}.toml" if kind == "scenario" else "s.toml"
    out = f"{ODD}.nc" if kind == "out" else "r.nc"
    (place / name).write_text(NAMED, encoding="utf-8")
    (place / f"{ODD}.py").write_text(
        "import numpy as np\ndef mine(prior, view):\n"
        "    return np.zeros((*prior.known.shape, view.system.array.n_tx))\n"
    )
    light = ["--scheme", f"{ODD}.py:mine", "--trials", 2] if kind == "scheme" else LIGHT
    run = process if kind == "out" else echobeam  # one by the bytes that a shell would give
    done = run("run", name, *light, "--out", out, cwd=place)
    assert done.returncode == 0, done.stderr
    done = run("plot", out, "--kind", "rate", cwd=place)
    assert done.returncode == 0, done.stderr
    assert (place / out.replace(".nc", "-rate.png")).is_file()


@pytest.mark.parametrize(
    "name",
    [
        "../elsewhere", "/absolute", "a/b", "a\\\\b", "..", ".", "", "   ", "a\\u0000b",
        "two\\nlines", "bell\\u0007", "\\u202eright to left", "x" * 201, "é" * 101,
    ],
)  # fmt: skip
def test_a_name_that_is_no_file_name_is_refused_by_its_key(tmp_path, name):
    text = NAMED.replace("Überflug 飛行", name)
    (tmp_path / "s.toml").write_text(text, encoding="utf-8")
    refused(
        echobeam("run", "s.toml", *LIGHT, cwd=tmp_path),
        "s.toml: name: ",
        "is not accepted; expected a ",
    )
    assert [path.name for path in tmp_path.iterdir()] == ["s.toml"]


@pytest.mark.parametrize("name", ["x" * 200, "飛行", ".hidden", "a b", "-x", "CON"])
def test_other_names_give_a_result_of_that_name(tmp_path, name):
    """The name of a built-in scenario that is changed, and that of a file."""
    done = echobeam("run", "paper-single", *LIGHT, "--set", f"name={name}", "--quiet", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    (tmp_path / f"{name}.toml").write_text(NAMED, encoding="utf-8")
    done = echobeam("run", f"./{name}.toml", *LIGHT, "--quiet", "--force", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    (result,) = tmp_path.glob("*.nc")
    assert result.name == f"{name}.nc"
    assert xr.load_dataset(result).attrs["scenario"].startswith('name = "Überflug 飛行"')


@pytest.mark.parametrize("out", ["x" * 300, "s.toml/r.nc", ".", "/", "/dev/full"])
def test_a_result_that_cannot_be_there_is_refused_before_any_work(tmp_path, out):
    (tmp_path / "s.toml").write_text(NAMED, encoding="utf-8")
    refused(echobeam("run", "s.toml", *LIGHT, "--out", out, cwd=tmp_path), out)
    assert [path.name for path in tmp_path.iterdir()] == ["s.toml"]


# results cut by users

CUTS = {
    "one trial": (lambda whole: whole.isel(trial=0), "no dimension trial"),
    "one scheme": (lambda whole: whole.sel(scheme="omni"), "no dimension scheme"),
    "one slot": (lambda whole: whole.isel(slot=3), "no dimension slot"),
    "one object": (lambda whole: whole.isel(object=0), "no dimension object"),
    "a mean": (lambda whole: whole.drop_vars("phase").mean("trial"), "phase missing"),
    "half": (lambda whole: whole[["rate", "sinr"]], "truth, present"),
    "no coordinates": (lambda whole: whole.drop_vars(["phase", "time"]), "time, phase missing"),
    "two components": (lambda whole: whole.isel(state=[0, 1]), "2 along the dimension state"),
    "no trials": (lambda whole: whole.isel(trial=[]), "nothing along the dimension trial"),
    "turned": (lambda whole: whole.transpose("slot", ...), "truth has the dimensions slot, trial"),
    "stacked": (
        lambda whole: xr.concat([whole, whole], "run", data_vars="all"),
        "has the dimensions run",
    ),
}


@pytest.mark.parametrize(("cut", "words"), CUTS.values(), ids=CUTS)
def test_what_is_no_result_any_more_is_refused_in_one_message(tmp_path, result, cut, words):
    with xr.open_dataset(result) as whole:
        cut(whole.load()).to_netcdf(tmp_path / "cut.nc", engine="h5netcdf")
    refused(echobeam("plot", "cut.nc", cwd=tmp_path), "cut.nc: not a result of echobeam: ", words)
    assert [path.name for path in tmp_path.iterdir()] == ["cut.nc"]


@pytest.mark.slow
@pytest.mark.parametrize(
    "cut",
    [
        {"trial": [1]},
        {"slot": slice(2, 7)},
        {"scheme": [1]},
        {"scheme": [1, 0], "trial": [0], "slot": [0, 1]},
    ],
    ids=str,
)
def test_what_still_is_one_is_drawn(tmp_path, result, cut):
    with xr.open_dataset(result) as whole:
        whole.isel(cut).to_netcdf(tmp_path / "cut.nc", engine="h5netcdf")
    done = echobeam("plot", "cut.nc", "--kind", "rate", "--kind", "tracking", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "cut-rate.png").is_file()


# homes and places that cannot be written to


@pytest.fixture
def powerless(tmp_path):
    """The beginning of a command whose process has no right to write where the modes forbid it."""
    if os.geteuid() != 0:
        return []
    if shutil.which("setpriv") is None:
        pytest.skip("no setpriv, and the superuser may write anywhere")
    rights = "-dac_override,-dac_read_search,-fowner"
    return ["setpriv", f"--bounding-set={rights}", "--inh-caps=-all"]


@pytest.mark.slow
def test_without_a_home_and_beside_a_package_that_cannot_be_written_to(tmp_path, powerless):
    """As in a container with a user of its own: nothing frightening is said."""
    package = tmp_path / "package"
    shutil.copytree(Path(eb.__file__).parent, package / "echobeam")
    for folder in [package, *(path for path in package.rglob("*") if path.is_dir())]:
        folder.chmod(0o555)
    environment = {"HOME": "/proc/nowhere", "PYTHONPATH": str(package), "TMPDIR": "/proc/nowhere"}
    environment |= {"XDG_CACHE_HOME": "", "XDG_CONFIG_HOME": "", "MPLCONFIGDIR": ""}
    for arguments in (
        ["run", "paper-single", "--scheme", "water-filling", "--trials", 2, "--out", "r.nc"],
        ["plot", "r.nc", "--kind", "rate"],
    ):
        quiet = ["--quiet"] if arguments[0] == "run" else []
        done = process(*arguments, *quiet, cwd=tmp_path, begin=powerless, **environment)
        assert (done.returncode, done.stderr) == (0, b"")
    for folder in [package, *(path for path in package.rglob("*") if path.is_dir())]:
        folder.chmod(0o755)


@pytest.mark.slow
def test_a_working_directory_that_cannot_be_written_to_is_one_message(tmp_path, powerless):
    place = tmp_path / "place"
    place.mkdir(mode=0o555)
    for arguments, where in (
        (["run", "paper-single", *LIGHT], b"paper-single.nc: cannot be written: "),
        (["reproduce", "approx"], b"reproduction: cannot be made: "),
    ):
        done = process(*arguments, cwd=place, begin=powerless)
        assert (done.returncode, done.stdout) == (2, b"")
        assert done.stderr == b"echobeam: " + where + b"Permission denied\n"


def test_a_uav_below_its_floor_is_refused():
    done = echobeam("run", "paper-single", "--set", "uav.height=5 m", "--set", "uav.floor=20 m")
    refused(done, "uav.floor: 20 m is above uav.height, 5 m")


def test_texts_of_results_are_what_utf8_can_hold():
    from echobeam.store.result import _storable, _texts

    assert _storable(["ä", ODD, 3]) == ["ä", "stra\\udcdfe", 3]
    assert _texts(np.array([["a"], [ODD]])).tolist() == [["a"], ["stra\\udcdfe"]]
