"""The command as a program: `python -m`, its version, and the completion of shells."""

import os
import platform
import shutil
import subprocess
import sys
from importlib.metadata import version

import pytest

from echobeam.cli.main import COMMANDS
from echobeam.version import __version__

from .test_cli import echobeam

HEAVY = "{'numpy','scipy','xarray','matplotlib','clarabel','numba','pydantic','rich'}"
LIGHT = f"""
import atexit, os, sys
atexit.register(lambda: {HEAVY} & set(sys.modules) and os._exit(9))
from echobeam.cli.main import main
sys.argv = ["echobeam", *sys.argv[1:]]
main()
"""
"""The command, which ends with 9 if anything was imported that takes long."""


def light(*arguments, **environment):
    return subprocess.run(
        [sys.executable, "-c", LIGHT, *arguments],
        capture_output=True,
        text=True,
        env={**os.environ, **environment},
    )


@pytest.mark.slow
def test_python_m_is_the_same_command(tmp_path):
    whole = [sys.executable, "-m", "echobeam"]
    done = subprocess.run([*whole, "schemes"], capture_output=True, text=True, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (0, echobeam("schemes").stdout)
    done = subprocess.run([*whole, "run", "nowhere"], capture_output=True, text=True, cwd=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == echobeam("run", "nowhere").stderr


def test_the_version_comes_with_what_the_numbers_depend_on_and_is_light():
    done = light("--version")
    assert (done.returncode, done.stderr) == (0, "")
    first, python, *rest = done.stdout.splitlines()
    assert first == f"echobeam, version {__version__}"
    assert python == f"python {platform.python_version()}"
    libraries = ("numpy", "scipy", "numba", "clarabel")
    assert rest[:-1] == [f"{name} {version(name)}" for name in libraries]
    assert rest[-1].startswith(f"processor {platform.machine()}")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_a_shells_completion_is_produced_and_light(shell):
    done = light(_ECHOBEAM_COMPLETE=f"{shell}_source")
    assert (done.returncode, done.stderr) == (0, "")
    assert f"_ECHOBEAM_COMPLETE={shell}_complete" in done.stdout


@pytest.mark.parametrize(
    ("words", "completed"),
    [
        ("echobeam ", [f"plain,{name}" for name in COMMANDS]),
        ("echobeam re", ["plain,reproduce"]),
        ("echobeam run --tr", ["plain,--trials", "plain,--trace", "plain,--traceback"]),
        ("echobeam run mine", ["file,mine"]),
        ("echobeam plot r", ["file,r"]),
    ],
)
def test_commands_options_and_files_are_completed_and_nothing_heavy_is_imported(words, completed):
    typed = words.split(" ")
    done = light(
        _ECHOBEAM_COMPLETE="bash_complete", COMP_WORDS=words, COMP_CWORD=str(len(typed) - 1)
    )
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.split() == completed


@pytest.mark.skipif(shutil.which("bash") is None, reason="no bash here")
def test_bash_understands_its_completion(tmp_path):
    script = light(_ECHOBEAM_COMPLETE="bash_source").stdout
    (tmp_path / "complete.sh").write_text(script)
    code = f"source {tmp_path / 'complete.sh'}; complete -p echobeam"
    done = subprocess.run(["bash", "-c", code], capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    assert "_echobeam_completion echobeam" in done.stdout
