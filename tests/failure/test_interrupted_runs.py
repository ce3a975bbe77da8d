"""Runs that are killed, blocks that are damaged, disks that are full: nothing is lost or mixed."""

import configparser
import os
import re
import resource
import shutil
import signal
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import echobeam as eb
from echobeam.faults import RunError
from echobeam.store.block_files import BlockFiles, Job
from echobeam.store.engine import COMPUTING, engine_here
from echobeam.store.inputs import input_digests
from echobeam.store.recording import Recording, record
from echobeam.store.writing import StoreError

pytestmark = pytest.mark.slow  # the quick selection stays under a minute

COMMAND = [sys.executable, "-c", "from echobeam.cli.main import main; main()"]
RUN = ["run", "paper-long", "--scheme", "water-filling", "--scheme", "omni", "--trials", "520"]


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch):
    monkeypatch.setattr("echobeam.simulation.blocks.MOST_TRIALS", 10)


def recording(out, **changes):
    defaults = {
        "scenario": eb.load_scenario("paper-multi"),
        "schemes": ("water-filling",),
        "trials": 40,
        "seed": 1,
        "out": out,
    }
    return Recording(**{**defaults, **changes})


def same(one, two):
    with xr.open_dataset(one) as a, xr.open_dataset(two) as b:
        assert set(a.variables) == set(b.variables)
        for name in a.variables:
            np.testing.assert_array_equal(a[name].values, b[name].values)


def interrupted(path, after=2, **changes):
    """Stop a run after some blocks, as Ctrl-C would."""
    done = []

    def progress(now, total):
        done.append(now)
        if now > after * 10 * 10:
            raise KeyboardInterrupt

    with pytest.raises(RunError, match="continue with --resume"):
        record(recording(path, **changes), progress)
    assert not path.exists()
    assert len(list(BlockFiles.beside(path).directory.glob("*.npz"))) == after


@pytest.mark.slow
def test_an_interrupted_run_goes_on_and_comes_to_the_same(tmp_path):
    record(recording(tmp_path / "whole.nc"))
    interrupted(tmp_path / "cut.nc")
    record(recording(tmp_path / "cut.nc", resume=True))
    same(tmp_path / "whole.nc", tmp_path / "cut.nc")
    assert not BlockFiles.beside(tmp_path / "cut.nc").directory.exists()


@pytest.mark.slow
def test_resuming_what_is_finished_changes_nothing(tmp_path):
    path = tmp_path / "r.nc"
    record(recording(path))
    before = path.read_bytes()
    record(recording(path, resume=True))
    assert path.read_bytes() == before
    with pytest.raises(StoreError, match="exists already"):
        record(recording(path, resume=True, seed=2))


def test_what_a_run_did_not_make_is_left_alone(tmp_path):
    directory = tmp_path / "r.nc.blocks"
    directory.mkdir()
    (directory / "notes.txt").write_text("mine")
    for force in (False, True):
        with pytest.raises(StoreError, match="not a directory of a run's blocks"):
            record(recording(tmp_path / "r.nc", force=force))
    assert (directory / "notes.txt").read_text() == "mine"
    (tmp_path / "f.nc.blocks").write_text("a file")
    with pytest.raises(StoreError, match="not a directory of a run's blocks"):
        record(recording(tmp_path / "f.nc"))


def test_a_changed_scheme_file_is_no_finished_run(tmp_path):
    code = "import numpy as np\ndef f(prior, view):\n    return np.full(30, {})\n"
    (tmp_path / "u.py").write_text(code.format(0.01))
    run = {"schemes": (f"{tmp_path / 'u.py'}:f",)}
    record(recording(tmp_path / "r.nc", **run))
    (tmp_path / "u.py").write_text(code.format(0.001))
    with pytest.raises(StoreError, match="exists already"):
        record(recording(tmp_path / "r.nc", resume=True, **run))


@pytest.mark.parametrize("place", ["name", "table", "table's name"])
def test_a_changed_file_of_a_part_is_another_run(tmp_path, place):
    part = tmp_path / "part.py"
    part.write_text("from echobeam.schemes.trackers import ExtendedKalman as T\n")
    text, table = f"water-filling:tracker={part}:T", {"tracker": f"{part}:T"}
    schemes, tables = {
        "name": ((text,), {}),
        "table": (("water-filling",), {"water-filling": table}),
        "table's name": ((text,), {text: {}}),
    }[place]
    scenario = eb.load_scenario("paper-single")
    if tables:
        scenario = scenario.model_copy(
            update={"schemes": tuple(tables), "scheme_parameters": tables}
        )
    before = input_digests(scenario, schemes)
    assert len(before) == 1
    assert input_digests(scenario, schemes) == before
    part.write_text(part.read_text() + "# changed\n")
    assert input_digests(scenario, schemes) != before


MINE = """
import numpy as np

def mine(prior, view):
    return np.zeros((*prior.known.shape, view.system.array.n_tx))
"""


def test_a_scheme_that_is_edited_while_it_runs_ends_the_run(tmp_path):
    """Its blocks would not fit together; with the file as it was the run goes on."""
    code, out = tmp_path / "mine.py", tmp_path / "r.nc"
    code.write_text(MINE)
    changes = {"schemes": (f"{code}:mine",)}

    def edit(now, total):
        if now > 10 * 10:
            code.write_text(MINE.replace("zeros", "ones"))

    with pytest.raises(RunError, match=r"mine\.py: is missing, or changed since the run started"):
        record(recording(out, **changes), edit)
    with pytest.raises(StoreError, match="inputs differ"):
        record(recording(out, resume=True, **changes))
    code.write_text(MINE)
    record(recording(out, resume=True, **changes))
    assert (xr.load_dataset(out)["beam"].isel(slot=1) == 0).all()


def test_blocks_of_another_run_are_refused_and_kept(tmp_path, monkeypatch):
    path = tmp_path / "r.nc"
    interrupted(path)
    others = {
        "seed": {"seed": 2},
        "trials": {"trials": 50},
        "schemes": {"schemes": ("omni",)},
        "scenarios": {"scenario": eb.load_scenario("paper-multi", {"radio.power": 2})},
    }
    for different, changes in others.items():
        with pytest.raises(StoreError, match=rf"belong to another run \({different} differ\)"):
            record(recording(path, resume=True, **changes))
    with pytest.raises(StoreError, match="--resume, or start again with --force"):
        record(recording(path))
    assert len(list(BlockFiles.beside(path).directory.glob("*.npz"))) == 2
    record(recording(path, force=True))
    assert path.exists()


HERE = engine_here()


def changed(name):
    """Return this environment with another version of one thing."""
    return re.sub(rf"(^|; ){name} [^;]+", rf"\g<1>{name} other", HERE.environment)


OTHERS = {
    "version": (HERE._replace(version="0.0.1"), f"version 0.0.1 (here {HERE.version})"),
    **{
        name: (HERE._replace(environment=changed(name)), f"{name} other (here ")
        for name in ("python", "numpy", "scipy", "numba", "clarabel", "processor")
    },
    "two": (
        HERE._replace(environment=changed("scipy").replace("numba ", "numba 0.")),
        f"scipy other (here {version('scipy')}), numba 0.{version('numba')} (here ",
    ),
    "sources": (HERE._replace(sources="?"), f"other code of version {HERE.version} than here"),
}


@pytest.mark.parametrize(("begun", "words"), OTHERS.values(), ids=OTHERS)
def test_blocks_of_other_code_are_refused(tmp_path, begun, words):
    files = BlockFiles(tmp_path / "b")
    with files.held(Job("run", (), (), (), 0, 1, begun), 1, resume=False, force=False):
        pass
    resumed = Job("run", (), (), (), 0, 1)
    with pytest.raises(StoreError, match=re.escape(f"started with {words}")):
        files.held(resumed, 1, resume=True, force=False).__enter__()
    (files.directory / "job.json").write_text('{"kind": "run"}')
    with pytest.raises(StoreError, match="started with other code"):
        files.held(resumed, 1, resume=True, force=False).__enter__()


def test_the_rooms_that_compute_are_those_below_the_simulation():
    """A block is what the simulation and all that it may import make of a job."""
    rules = configparser.ConfigParser()
    assert rules.read(Path(__file__).parents[2] / ".importlinter")
    layers = rules["importlinter:contract:rooms"]["layers"].split()
    below = [room for room in layers[layers.index("simulation") :] if room != "|"]
    assert set(COMPUTING) == set(below) - {"faults"}


def test_what_killed_processes_left_is_cleared(tmp_path):
    path = tmp_path / "r.nc"
    interrupted(path)
    leftovers = [tmp_path / ".r.nc.1.tmp", BlockFiles.beside(path).directory / ".000003.npz.1.tmp"]
    others = [tmp_path / ".rr.nc.1.tmp", tmp_path / ".r.nc.blocks.1.txt"]
    for leftover in (*leftovers, *others):
        leftover.touch()
    record(recording(path, resume=True))
    assert sorted(tmp_path.iterdir()) == sorted([path, *others])


def test_only_one_process_works_on_the_blocks(tmp_path):
    path, tried = tmp_path / "r.nc", []

    def progress(now, total):
        for further in ({"resume": True}, {"force": True}, {}):
            with pytest.raises(StoreError, match="another process works on these blocks"):
                record(recording(path, **further))
            tried.append(further)

    record(recording(path), progress)
    assert tried


def test_a_device_is_not_replaced():
    with pytest.raises(StoreError, match="not a regular file"):
        record(recording(Path("/dev/null"), force=True))


@pytest.mark.slow
def test_a_damaged_block_is_computed_again(tmp_path):
    record(recording(tmp_path / "whole.nc"))
    path = tmp_path / "r.nc"
    interrupted(path)
    block = BlockFiles.beside(path).path(0)
    content = bytearray(block.read_bytes())
    content[len(content) // 2] ^= 0xFF
    block.write_bytes(content)
    record(recording(path, resume=True))
    same(tmp_path / "whole.nc", path)


def test_a_scheme_that_breaks_the_rules_leaves_nothing_behind(tmp_path):
    (tmp_path / "bad.py").write_text("def bad(prior, view):\n    return 1 / 0\n")
    with pytest.raises(ValueError, match="ZeroDivisionError"):
        record(recording(tmp_path / "r.nc", schemes=(f"{tmp_path / 'bad.py'}:bad",)))
    assert [path.name for path in tmp_path.iterdir() if path.name != "__pycache__"] == ["bad.py"]


@contextmanager
def files_of_at_most(size):
    """Let writing fail beyond a size: it does so in the same way as on a full disk."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    previous = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, previous)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "kept"), [(100_000, 0), (200_000, 4), (640_000, 4)], ids=["block", "begin", "end"]
)
def test_a_disk_that_is_full_is_one_message_and_the_run_goes_on_later(tmp_path, size, kept):
    """While a block is written, or while they are joined: HDF5 must not hear of it."""
    whole, path = tmp_path / "whole.nc", tmp_path / "r.nc"
    record(recording(whole))
    assert whole.stat().st_size > size
    message = f"too large; {kept} of 4 blocks are stored .*; continue with --resume"
    with files_of_at_most(size), pytest.raises(RunError, match=message):
        record(recording(path))
    assert not path.exists()
    assert not list(tmp_path.rglob("*.tmp"))
    record(recording(path, resume=True))
    same(whole, path)


@pytest.fixture
def small_disk(tmp_path):
    """A disk of its own, whose size can be changed."""
    disk = tmp_path / "disk"
    disk.mkdir()

    def mount(*options):
        return subprocess.run(["mount", *options, disk], capture_output=True).returncode == 0

    if shutil.which("mount") is None or not mount("-t", "tmpfs", "-o", "size=64k", "tmpfs"):
        pytest.skip("no disk can be mounted here")
    yield disk, lambda size: mount("-o", f"remount,size={size}k")
    subprocess.run(["umount", disk], check=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "sizes"),
    [
        pytest.param(["run", "paper-single"], [16, 2300, 4000], id="run"),
        pytest.param(["sweep", "paper-single", "--vary", "radio.power=1,2"], [16, 72], id="sweep"),
    ],
)
def test_a_real_disk_that_is_full_is_one_message(tmp_path, small_disk, arguments, sizes):
    """A real process on a real disk, from one too small for a block to one nearly large enough."""
    disk, resize = small_disk
    run = [*COMMAND, *arguments, "--scheme", "omni", "--trials", "300", "--quiet"]
    environment = {**os.environ, "SOURCE_DATE_EPOCH": "1700000000"}
    for size in sizes:
        assert resize(size)
        done = subprocess.run(
            [*run, "--out", disk / "r.nc", "--resume"],
            env=environment,
            capture_output=True,
            text=True,
        )
        assert (done.returncode, done.stdout) == (1, "")
        assert done.stderr.count("\n") == 1
        assert "No space left on device" in done.stderr
        assert [path.name for path in disk.iterdir() if path.is_file()] == []
    assert resize(40_000)
    for path, further in ((disk / "r.nc", ["--resume"]), (tmp_path / "whole.nc", [])):
        done = subprocess.run([*run, "--out", path, *further], env=environment)
        assert done.returncode == 0
    assert (disk / "r.nc").read_bytes() == (tmp_path / "whole.nc").read_bytes()


@pytest.mark.slow
def test_a_worker_that_dies_is_replaced(tmp_path):
    whole = [*COMMAND, *RUN, "--quiet", "--out", tmp_path / "whole.nc"]
    assert subprocess.run(whole).returncode == 0
    run = subprocess.Popen([*COMMAND, *RUN, "--quiet", "--out", tmp_path / "r.nc", "--jobs", "2"])
    killed = False
    while run.poll() is None and not killed:
        time.sleep(0.02)
        workers = workers_of(run.pid)
        if workers and list((tmp_path / "r.nc.blocks").glob("*.npz")):
            os.kill(workers[0], signal.SIGKILL)
            killed = True
    assert run.wait(600) == 0
    assert killed
    same(tmp_path / "whole.nc", tmp_path / "r.nc")


def workers_of(pid):
    """Return a process's spawned workers (not the resource tracker)."""
    with open(f"/proc/{pid}/task/{pid}/children") as file:
        children = [int(child) for child in file.read().split()]
    found = []
    for child in children:
        with suppress(FileNotFoundError), open(f"/proc/{child}/cmdline") as file:
            if "spawn_main" in file.read():
                found.append(child)
    return found
