"""The scripts in `examples` run as they stand, and write what they say they write."""

from __future__ import annotations

import csv
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


@pytest.fixture
def run(tmp_path: Path):
    """Run an example in an empty directory and return what it prints."""

    def run(name: str, *arguments: str) -> str:
        done = subprocess.run(
            [sys.executable, str(ROOT / "examples" / f"{name}.py"), *arguments],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(ROOT / "src")},
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    return run


def is_png(path: Path) -> bool:
    return path.read_bytes().startswith(b"\x89PNG")


@pytest.mark.slow
def test_a_sweep_becomes_a_figure(run, tmp_path: Path) -> None:
    assert "genie" in run("sweep_to_figure", "2")
    assert (tmp_path / "antennas.pdf").read_bytes().startswith(b"%PDF")
    assert is_png(tmp_path / "antennas.png")
    with (tmp_path / "antennas.csv").open(encoding="utf-8", newline="") as file:
        assert len(list(csv.reader(file))) > 3 * 7
    with xr.open_dataset(tmp_path / "antennas.nc") as grid:
        np.testing.assert_array_equal(grid["array.n_rx"], grid["array.n_tx"])
        genie = grid["frame_rate_mean"].sel(scheme="genie")
        # a matched beam at small SNR: the rate is proportional to the number of antennas
        np.testing.assert_allclose(genie / genie["array.n_tx"], float(genie[0]) / 8, rtol=0.01)


@pytest.mark.slow
def test_a_scheme_of_ones_own_is_examined_and_compared(run, tmp_path: Path) -> None:
    printed = run("own_scheme", "2")
    for scheme in ("zoom", "temporal", "water-filling", "pilot"):
        assert re.search(rf"^{scheme} +0\.00\d", printed, re.MULTILINE)
    assert is_png(tmp_path / "own_scheme.png")


@pytest.mark.slow
def test_a_trace_becomes_a_map(run, tmp_path: Path) -> None:
    rows = [f"{t},a,{-20 + 20 * t},0\n{t},b,{40 - 10 * t},3\n" for t in range(4)]
    (tmp_path / "two.csv").write_text("t,id,x,y\n" + "".join(rows), encoding="utf-8")
    run("trace_to_map", "1", "2", "two.csv")
    assert is_png(tmp_path / "trace_to_map.png")
    with xr.open_dataset(tmp_path / "traffic.nc") as result:
        assert list(result["scheme"].values) == ["temporal", "pilot"]
        assert float(result["time"][-1]) == pytest.approx(1.95)
        travelled = result["position"].sel(axis="x").isel(trial=0, slot=[0, -1]).diff("slot")
        np.testing.assert_allclose(sorted(travelled[0].values)[:2], [-19.5, 39.0])


@pytest.mark.slow
def test_beams_are_designed_and_proved(run, tmp_path: Path) -> None:
    printed = run("beams_alone")
    found = re.match(r"optimal: ([\d.]+) bit/s/Hz, no design exceeds ([\d.]+)\n", printed)
    assert found
    assert float(found[1]) <= float(found[2]) <= 1.0001 * float(found[1])
    assert float(printed.split()[-1]) < 1e-6
    assert is_png(tmp_path / "beams_alone.png")


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_an_example_is_short_and_shown_with_its_picture(path: Path) -> None:
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 50
    page = (ROOT / "docs" / "examples.md").read_text(encoding="utf-8")
    (picture,) = re.findall(r"\w+\.png(?=\")", path.read_text(encoding="utf-8"))
    assert f'--8<-- "examples/{path.name}"' in page
    assert f"(images/{picture})" in page
