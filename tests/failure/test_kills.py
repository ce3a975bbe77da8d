"""Real processes, killed at random moments, resumed until they are done: the same bytes.

They are forked from one that has imported the command line already: an import takes three times as
long as the run, and a kill during it meets nothing.
"""

import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

BLOCK = 3
"""Trials per block here: small, so that a short run has many and kills land between them."""

ENDLESS = 600.0
"""Seconds after which a process is taken to hang: far beyond what a busy machine makes of any."""

COMMAND = (
    sys.executable,
    "-c",
    f"import echobeam.simulation.blocks as blocks; blocks.MOST_TRIALS = {BLOCK}\n"
    "from echobeam.cli.main import main; main()",
)
ENVIRONMENT = {**os.environ, "SOURCE_DATE_EPOCH": "1700000000"}  # results hold their date
IMPORTED = (
    "echobeam.cli.main",
    "echobeam.cli.run",
    "echobeam.cli.sweep",
    "echobeam.cli.reproduce",
    "echobeam.commands.run",
    "echobeam.commands.sweep",
    "echobeam.commands.reproduce",
    "echobeam.schemes.water_filling",
    "h5netcdf",
    "scipy.special",
)
"""Modules that the commands import when they are used."""
FORKED = """
import os, sys
os.setsid()
file = os.open({said!r}, os.O_WRONLY)
os.dup2(file, 1)
os.dup2(file, 2)
os.chdir({place!r})
os.environ["SOURCE_DATE_EPOCH"] = "1700000000"
sys.argv = ["echobeam", *{arguments!r}]
import echobeam.simulation.blocks as blocks
blocks.MOST_TRIALS = {block}
from echobeam.cli.main import main
main()
"""
LIGHT = ("--scheme", "water-filling", "--scheme", "omni", "--trials", "27", "--quiet")
RUN = ("run", "paper-single", *LIGHT)
SWEEP = ("sweep", "paper-single", *LIGHT, "--vary", "radio.power=0.1,1", "--full")
REPRODUCE = ("reproduce", "approx", "t4", "--trials", "4", "--quiet")


@pytest.fixture(scope="module")
def fork(tmp_path_factory):
    """Give a call that starts a command in a directory: a process, and the file of what it says."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([*IMPORTED])

    def fork(arguments, place):
        said = Path(tempfile.mkstemp(dir=tmp_path_factory.getbasetemp())[1])
        words = [*map(str, arguments)]
        code = FORKED.format(said=str(said), place=str(place), arguments=words, block=BLOCK)
        process = context.Process(target=exec, args=(code, {"__name__": "forked"}))
        process.start()
        return process, said

    return fork


def finish(fork, arguments, place):
    """Let a command come through."""
    process, said = fork(arguments, place)
    process.join(ENDLESS)
    assert (process.exitcode, said.read_text()) == (0, "")


def contents(directory):
    """Return every file below a directory but the blocks that `reproduce` keeps."""
    files = (path for path in directory.rglob("*") if path.is_file())
    return {
        str(path.relative_to(directory)): path.read_bytes()
        for path in files
        if "blocks" not in path.relative_to(directory).parts
    }


@dataclass
class Tally:
    """What the kills met: how many hit a living process, and how many of these between blocks."""

    kills: int = 0
    between: int = 0


def blocks(place):
    return sum(path.suffix == ".npz" for path in place.rglob("*"))


def kill_and_resume(fork, arguments, place, kills, generator, tally):
    """Kill a command some blocks after its start, at a random moment; then let it come through.

    Progress is counted in blocks, not in time, which depends on how busy the machine is.
    """
    for _ in range(kills):
        process, _ = fork([*arguments, "--resume"], place)
        enough = blocks(place) + generator.integers(0, 3)
        while process.is_alive() and blocks(place) < enough:
            time.sleep(0.002)
        process.join(generator.uniform(0.0, 0.1))
        if process.is_alive():
            with suppress(ProcessLookupError):  # it ends by itself just now
                os.kill(process.pid, signal.SIGKILL)  # alone: workers must end by themselves
                tally.kills += 1
                tally.between += blocks(place) > 0
        process.join(ENDLESS)
    finish(fork, [*arguments, "--resume"], place)


@pytest.mark.slow
def test_twenty_runs_killed_at_random_come_to_the_same_bytes(tmp_path, fork):
    whole = tmp_path / "whole"
    whole.mkdir()
    finish(fork, [*RUN, "--out", "r.nc"], whole)
    generator, tally = np.random.default_rng(50), Tally()
    for number in range(20):
        place = tmp_path / str(number)
        place.mkdir()
        kills = 3 if number % 5 == 0 else 1
        kill_and_resume(fork, [*RUN, "--out", "r.nc"], place, kills, generator, tally)
        assert contents(place) == contents(whole), number
    assert tally.kills >= 10
    assert tally.between >= 4


@pytest.mark.slow
@pytest.mark.parametrize(
    ("command", "out", "kills"),
    [
        pytest.param((*RUN, "--jobs", "2"), "r.nc", 3, id="run with two processes"),
        pytest.param((*SWEEP, "--csv", "s.csv"), "s.nc", 5, id="sweep"),
        pytest.param(REPRODUCE, "r", 3, id="reproduce"),
    ],
)
def test_other_commands_killed_at_random_come_to_the_same_bytes(
    tmp_path, fork, command, out, kills
):
    generator, tally = np.random.default_rng(51), Tally()
    places = [tmp_path / "whole", tmp_path / "killed"]
    for place in places:
        place.mkdir()
        arguments = [*command, "--out", out]
        if place is places[0]:
            finish(fork, arguments, place)
        else:
            kill_and_resume(fork, arguments, place, kills, generator, tally)
    assert contents(places[0]) == contents(places[1])
    assert tally.kills >= 1


def children_of(pid):
    return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text().split()]


def gone(pid):
    with suppress(FileNotFoundError, ProcessLookupError):
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
    return True


def wait_for(condition, seconds=ENDLESS):
    """Wait until a condition holds; return what it gave."""
    end = time.monotonic() + seconds
    while not (found := condition()):
        assert time.monotonic() < end
        time.sleep(0.02)
    return found


LONG = ("run", "paper-long", "--scheme", "water-filling", "--trials", "3000", "--quiet")


def start(arguments):
    return subprocess.Popen(
        [*COMMAND, *map(str, arguments)],
        env=ENVIRONMENT,
        start_new_session=True,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def started(place):
    """Start a long run with two processes; return it when both are at work."""
    run = start([*LONG, "--jobs", "2", "--out", place / "r.nc"])
    blocks = place / "r.nc.blocks"
    wait_for(lambda: run.poll() is None and len(list(blocks.glob("*.npz"))) > 2)
    return run


@pytest.mark.slow
def test_workers_end_with_the_process_that_they_work_for(tmp_path):
    run = started(tmp_path)
    children = children_of(run.pid)
    assert len(children) >= 2
    os.kill(run.pid, signal.SIGKILL)
    run.communicate()
    wait_for(lambda: all(gone(child) for child in children))


@pytest.mark.slow
def test_an_interruption_is_one_message_and_ends_every_process(tmp_path):
    """Ctrl-C reaches the whole group of processes at once."""
    run = started(tmp_path)
    children = children_of(run.pid)
    os.killpg(run.pid, signal.SIGINT)
    out, err = run.communicate(timeout=ENDLESS)
    assert (run.returncode, out) == (1, "")
    assert err.count("\n") == 1, err
    assert err.startswith("echobeam: interrupted; ")
    assert "continue with --resume" in err
    wait_for(lambda: all(gone(child) for child in children))


NOTHING = """
class Nothing:
    def sizes(self): return [1] * 5000
    def missing(self): return list(range(5000))
    def piece(self, task): return lambda advance: advance(1)
    def write(self, task, block): pass
"""
MANY_SMALL_TASKS = """
from nothing import Nothing
from echobeam.store.workers import Workers, do_all

do_all(Nothing(), Workers(jobs=2), lambda done, all: done and print(done, flush=True))
"""


@pytest.mark.slow
def test_an_interruption_while_tasks_are_gathered_leaves_no_lock_behind(tmp_path):
    """The process that gathers outcomes is interrupted in its midst, and still comes to its end."""
    script = tmp_path / "many.py"
    script.write_text(MANY_SMALL_TASKS)
    (tmp_path / "nothing.py").write_text(NOTHING)
    generator = np.random.default_rng(52)
    for _ in range(5):
        run = subprocess.Popen(
            [sys.executable, str(script)],
            start_new_session=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
        )
        run.stdout.readline()  # at work
        time.sleep(generator.uniform(0, 0.1))
        os.killpg(run.pid, signal.SIGINT)
        _, err = run.communicate(timeout=ENDLESS)
        assert err.rstrip().endswith("KeyboardInterrupt")


@pytest.mark.slow
def test_two_processes_do_not_work_on_the_same_result(tmp_path):
    run = started(tmp_path)
    for further in ("--resume", "--force"):
        second = start([*LONG, "--out", tmp_path / "r.nc", further])
        out, err = second.communicate(timeout=ENDLESS)
        assert (second.returncode, out) == (2, "")
        assert "another process works on these blocks" in err
    assert run.poll() is None
    os.kill(run.pid, signal.SIGKILL)
    run.communicate()
