"""Faults of a user's scheme at the command line: one message, and all of it with --traceback."""

import pytest

from .test_cli import echobeam, process

SOURCE = """\
import sys

def helper():
    return [][3]

def mine(prior, view):
    return helper()

def leaves(prior, view):
    print("a user's own print")
    sys.exit("no more")

def stops(prior, view):
    raise KeyboardInterrupt

def flat(prior, view):
    return [1.0, 2.0]
"""


@pytest.fixture
def place(tmp_path):
    (tmp_path / "mine.py").write_text(SOURCE)
    (tmp_path / "syntax.py").write_text("def mine(:\n")
    return tmp_path


def run(place, scheme, *more):
    return echobeam(
        "run", "paper-single", "--scheme", scheme, "--trials", 3, "--quiet", *more, cwd=place
    )


def test_a_scheme_that_raises_is_one_line_with_status_1(place):
    done = run(place, "mine.py:mine")
    assert (done.returncode, done.stdout) == (1, "")
    assert done.stderr == (
        "echobeam: mine.py, line 4, in helper: IndexError: list index out of range "
        "(scheme 'mine', transmit of slot 2, trials 0 to 2)\n"
    )
    assert not list(place.glob("*.nc*"))


def test_the_traceback_is_there_if_asked_for_and_the_users_part_alone(place):
    done = run(place, "mine.py:mine", "--traceback")
    assert done.returncode == 1
    lines = done.stderr.splitlines()
    assert lines[0] == "Traceback (most recent call last):"
    assert lines[-1].startswith("echobeam: mine.py, line 4, in helper: IndexError: ")
    assert [line.strip() for line in lines if line.startswith("  File")] == [
        f'File "{place / "mine.py"}", line 7, in mine',
        f'File "{place / "mine.py"}", line 4, in helper',
    ]


@pytest.mark.parametrize("command", ["run", "sweep"])
def test_a_file_that_is_no_python_is_named_with_its_line_and_status_2(place, command):
    vary = ["--vary", "radio.power=1,2"] if command == "sweep" else []
    arguments = [command, "paper-single", *vary, "--scheme", "syntax.py:mine", "--quiet"]
    done = echobeam(*arguments, cwd=place)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.startswith("echobeam: syntax.py, line 1: SyntaxError: ")
    done = echobeam(*arguments, "--traceback", cwd=place)
    assert "    def mine(:" in done.stderr.splitlines()
    assert "importlib" not in done.stderr


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("leaves", "mine.py, line 11, in leaves: SystemExit: no more (scheme 'leaves'"),
        ("stops", "interrupted; 0 of 1 blocks are stored"),
        ("flat", "scheme 'flat' returned beams of shape (2,) in slot 2; expected"),
    ],
)
def test_other_ways_to_fail_are_one_message(place, name, words):
    done = run(place, f"mine.py:{name}")
    assert (done.returncode, done.stdout) == (1, "")
    said = done.stderr.removeprefix("a user's own print\n")
    assert words in said
    assert said.count("\n") == 1


@pytest.mark.slow
def test_a_batch_systems_signal_is_an_interruption(place):
    (place / "asked.py").write_text(
        "import os, signal\n\ndef to_end(prior, view):\n    os.kill(os.getpid(), signal.SIGTERM)\n"
    )
    done = process("run", "paper-single", "--scheme", "asked.py:to_end", "--quiet", cwd=place)
    assert (done.returncode, done.stdout) == (1, "")
    assert "interrupted; 0 of 2 blocks are stored" in done.stderr


@pytest.mark.slow
def test_another_process_says_the_same(place):
    arguments = ["run", "paper-single", "--scheme", "mine.py:mine", "--trials", 300]
    done = process(*arguments, "--quiet", "--jobs", 2, "--traceback", cwd=place)
    assert (done.returncode, done.stdout) == (1, "")
    lines = done.stderr.splitlines()
    assert sum(line.startswith("  File") for line in lines) == 2
    assert lines[-1].startswith("echobeam: mine.py, line 4, in helper: IndexError: ")
    assert "(scheme 'mine', transmit of slot 2, trials " in lines[-1]
