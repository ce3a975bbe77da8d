"""The figure of CONTRIBUTING: one short file, found, run, drawn and written like the others."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

import echobeam

from .test_docs import ROOT, blocks

pytestmark = pytest.mark.slow  # the quick selection stays under a minute


def test_a_figure_of_ones_own_is_one_file_of_at_most_thirty_lines(tmp_path: Path) -> None:
    (block,) = blocks((ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8"), "python")
    assert len(block.text.splitlines()) <= 30
    package = tmp_path / "echobeam"
    shutil.copytree(Path(echobeam.__file__).parent, package)
    (tmp_path / Path(block.title).relative_to("src")).write_text(block.text, encoding="utf-8")
    run = "from echobeam.cli.main import main; main()"
    out = tmp_path / "out"
    done = subprocess.run(
        [sys.executable, "-c", run, "reproduce", "power", "--trials", "2", "--out", str(out)],
        cwd=tmp_path,
        env={"PYTHONPATH": str(tmp_path), "PATH": "", "HOME": str(tmp_path)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    document = json.loads((out / "power.json").read_text(encoding="utf-8"))
    assert [one["name"] for one in document["panels"][0]["series"]] == ["temporal", "pilot"]
    assert (out / "power.png").read_bytes().startswith(b"\x89PNG")
