"""Runs that are killed, blocks that are damaged, disks that are full: nothing is lost or mixed."""

import os
import resource
import signal
import subprocess
import sys
import time

import numpy as np
import pytest
import xarray as xr

import echobeam as eb
from echobeam.faults import RunError
from echobeam.store.block_files import BlockFiles
from echobeam.store.recorded import Recording, record
from echobeam.store.writing import StoreError

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

    with pytest.raises(RunError, match="go on with --resume"):
        record(recording(path, **changes), progress)
    assert not path.exists()
    assert len(list(BlockFiles.beside(path).directory.glob("*.npz"))) == after


def test_an_interrupted_run_goes_on_and_comes_to_the_same(tmp_path):
    record(recording(tmp_path / "whole.nc"))
    interrupted(tmp_path / "cut.nc")
    record(recording(tmp_path / "cut.nc", resume=True))
    same(tmp_path / "whole.nc", tmp_path / "cut.nc")
    assert not BlockFiles.beside(tmp_path / "cut.nc").directory.exists()


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
        with pytest.raises(StoreError, match="not made by one"):
            record(recording(tmp_path / "r.nc", force=force))
    assert (directory / "notes.txt").read_text() == "mine"
    (tmp_path / "f.nc.blocks").write_text("a file")
    with pytest.raises(StoreError, match="not made by one"):
        record(recording(tmp_path / "f.nc"))


def test_a_changed_scheme_file_is_no_finished_run(tmp_path):
    code = "import numpy as np\ndef f(prior, view):\n    return np.full(30, {})\n"
    (tmp_path / "u.py").write_text(code.format(0.01))
    run = {"schemes": (f"{tmp_path / 'u.py'}:f",)}
    record(recording(tmp_path / "r.nc", **run))
    (tmp_path / "u.py").write_text(code.format(0.001))
    with pytest.raises(StoreError, match="exists already"):
        record(recording(tmp_path / "r.nc", resume=True, **run))


def test_blocks_of_another_run_are_refused_and_kept(tmp_path):
    path = tmp_path / "r.nc"
    interrupted(path)
    for changes in ({"seed": 2}, {"trials": 50}, {"schemes": ("omni",)}):
        with pytest.raises(StoreError, match="belong to another run"):
            record(recording(path, resume=True, **changes))
    with pytest.raises(StoreError, match="--resume, or --force"):
        record(recording(path))
    assert len(list(BlockFiles.beside(path).directory.glob("*.npz"))) == 2
    record(recording(path, force=True))
    assert path.exists()


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


def test_a_disk_that_is_full_is_one_message_and_the_run_goes_on_later(tmp_path):
    """A limit on file sizes stands in for the disk: the write fails in the same way."""
    record(recording(tmp_path / "whole.nc"))
    path = tmp_path / "r.nc"
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    previous = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100_000, hard))
    try:
        with pytest.raises(RunError, match="go on with --resume"):
            record(recording(path))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, previous)
    assert not path.exists()
    assert not list(tmp_path.rglob("*.tmp"))
    record(recording(path, resume=True))
    same(tmp_path / "whole.nc", path)


@pytest.mark.slow
@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_killed_process_loses_nothing(tmp_path, jobs):
    """Real processes, killed at random moments until they come through."""
    assert (
        subprocess.run([*COMMAND, *RUN, "--quiet", "--out", tmp_path / "whole.nc"]).returncode == 0
    )
    generator = np.random.default_rng(5)
    path = tmp_path / "r.nc"
    for attempt in range(12):
        child = subprocess.Popen(
            [*COMMAND, *RUN, "--quiet", "--out", path, "--jobs", jobs, "--resume"],
            start_new_session=True,
        )
        try:
            child.wait(generator.uniform(0.8, 3.5) if attempt < 6 else 120)
        except subprocess.TimeoutExpired:
            os.killpg(child.pid, signal.SIGKILL)
            child.wait()
            continue
        assert child.returncode == 0
        break
    same(tmp_path / "whole.nc", path)


@pytest.mark.slow
def test_a_worker_that_dies_is_replaced(tmp_path):
    whole = [*COMMAND, *RUN, "--quiet", "--out", tmp_path / "whole.nc"]
    assert subprocess.run(whole).returncode == 0
    run = subprocess.Popen([*COMMAND, *RUN, "--quiet", "--out", tmp_path / "r.nc", "--jobs", "2"])
    killed = False
    for _ in range(200):
        time.sleep(0.05)
        if run.poll() is not None:
            break
        workers = workers_of(run.pid)
        if workers and list((tmp_path / "r.nc.blocks").glob("*.npz")):
            os.kill(workers[0], signal.SIGKILL)
            killed = True
            break
    assert run.wait(120) == 0
    assert killed
    same(tmp_path / "whole.nc", tmp_path / "r.nc")


def workers_of(pid):
    """Return a process's spawned workers (not the resource tracker)."""
    with open(f"/proc/{pid}/task/{pid}/children") as file:
        children = [int(child) for child in file.read().split()]
    found = []
    for child in children:
        with open(f"/proc/{child}/cmdline") as file:
            if "spawn_main" in file.read():
                found.append(child)
    return found
