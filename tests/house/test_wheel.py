"""The wheel: it holds all of the package, byte for byte, and runs from where it is installed.

So what runs from the checkout, as all examples of README and docs do in `test_docs`, runs from the
wheel.
"""

from __future__ import annotations

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from .test_docs import ROOT

PIP = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check"]


@pytest.mark.slow
def test_the_wheel_is_the_package_and_runs(tmp_path: Path) -> None:
    """In a process of its own that imports the wheel's files instead of the checkout's."""
    build = ["wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", str(tmp_path), str(ROOT)]
    subprocess.run([*PIP, *build], check=True)
    (wheel,) = tmp_path.glob("echobeam-*.whl")
    package = ROOT / "src"
    ours = {
        str(path.relative_to(package)): path.read_bytes()
        for path in (package / "echobeam").rglob("*")
        if path.is_file() and "__pycache__" not in path.parts
    }
    with zipfile.ZipFile(wheel) as archive:
        packed = {name: archive.read(name) for name in archive.namelist()}
    assert {name: packed[name] for name in packed if ".dist-info/" not in name} == ours
    assert "echobeam/py.typed" in ours

    installed = tmp_path / "site"
    subprocess.run(
        [*PIP, "install", "--no-deps", "--target", str(installed), str(wheel)], check=True
    )
    environment = {**os.environ, "PYTHONPATH": str(installed)}

    def run(*command: str) -> str:
        return subprocess.run(
            [sys.executable, *command],
            capture_output=True,
            text=True,
            env=environment,
            cwd=tmp_path,
            check=True,
        ).stdout

    where = run("-c", "import echobeam; print(echobeam.__file__)")
    assert Path(where.strip()).is_relative_to(installed)
    light = ("--scheme", "water-filling", "--trials", "2", "--out", "r.nc")
    assert "result: r.nc" in run(str(installed / "bin" / "echobeam"), "run", "paper-multi", *light)
    assert (tmp_path / "r.nc").is_file()
    assert run(str(installed / "bin" / "echobeam"), "plot", "r.nc", "--kind", "rate")
