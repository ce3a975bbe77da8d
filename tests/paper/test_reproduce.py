"""`echobeam reproduce` as a user meets it, on the cheapest figures."""

import csv
import errno
import json
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from echobeam.cli.reproduce import command
from echobeam.faults import InputError
from echobeam.plots.drawing import draw
from echobeam.reproduction import mapping, run
from echobeam.reproduction.catalogue import CLAIMS as ALL
from echobeam.reproduction.catalogue import FIGURES
from echobeam.reproduction.figures import approximation

PNG = b"\x89PNG\r\n"


@pytest.fixture(autouse=True)
def nothing_is_cut(monkeypatch):
    """Texts and axes of every picture lie within it."""
    write = run.write

    def write_whole(data, path, *, captions):
        drawing = draw(data, captions=captions)
        drawing.draw_without_rendering()
        box = drawing.get_tightbbox()
        width, height = drawing.get_size_inches()
        outside = max(-box.x0, -box.y0, box.x1 - width, box.y1 - height)
        assert outside < 0.02, f"{path.name}: {outside:.2f} inches are cut"
        write(data, path, captions=captions)

    monkeypatch.setattr(run, "write", write_whole)


def reproduce(*arguments):
    done = CliRunner().invoke(command, [str(one) for one in arguments])
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    assert done.exit_code == 0, done.output
    return done.stdout


def read(path):
    with path.open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_list_names_every_figure():
    lines = reproduce("--list").splitlines()
    assert lines[0].split()[0] == "approx"
    assert any(line.startswith("aa_acr ") for line in lines)


@pytest.mark.slow
def test_a_figure_without_trials_is_drawn_judged_and_not_overwritten(tmp_path):
    out = tmp_path / "deep" / "out"
    said = reproduce("approx", "--out", out)
    assert "reproduced      approximation-minimal" in said
    assert (out / "approx.png").read_bytes().startswith(PNG)
    (claim,) = json.loads((out / "claims.json").read_text())["claims"]
    assert (claim["figure"], claim["verdict"]) == ("approx", "reproduced")
    assert "sensitivity map" not in (out / "claims.md").read_text()
    with pytest.raises(InputError, match=r"approx\.png: exists already.*--force"):
        reproduce("approx", "--out", out)
    reproduce("approx", "--out", out, "--force", "--quiet")


def test_the_approximation_is_checked_against_plain_geometry():
    """Positions in the plane, with no formula of the evolution model."""
    exact = approximation.states("exact")
    slot, height = 0.05, 60.0
    seconds = slot * np.arange(len(exact))
    apart = height / np.tan(np.radians(45.0)) + (30.0 + 15.0) * seconds
    np.testing.assert_allclose(exact[:, 0], np.arctan2(height, apart), atol=1e-12)
    np.testing.assert_allclose(exact[:, 1], np.hypot(height, apart), rtol=1e-12)


def test_unknown_ids_and_impossible_places_are_refused(tmp_path):
    with pytest.raises(InputError, match="no such figure: t2; there are approx"):
        reproduce("t2", "--out", tmp_path)
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="file: cannot be made"):
        reproduce("approx", "--out", tmp_path / "file")
    with pytest.raises(InputError, match="below: cannot be made: Not a directory"):
        reproduce("approx", "--out", tmp_path / "file" / "below")


@pytest.mark.parametrize("figure", ["approx", "t4"], ids=["without trials", "with trials"])
def test_a_folder_that_cannot_be_written_to_is_refused_before_any_work(
    tmp_path, monkeypatch, figure
):
    touch = Path.touch

    def refuse(path, *arguments, **further):
        if path.parent == tmp_path:
            raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
        touch(path, *arguments, **further)

    monkeypatch.setattr(Path, "touch", refuse)
    with pytest.raises(InputError, match=": cannot be written to: Permission denied") as refused:
        reproduce(figure, "--out", tmp_path)
    assert str(refused.value).startswith(str(tmp_path))
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self").is_dir(), reason="no /proc here")
def test_a_place_that_is_no_folder_to_write_to_exits_with_2_and_one_line():
    command = [sys.executable, "-c", "from echobeam.cli.main import main; main()"]
    done = subprocess.run(
        [*command, "reproduce", "approx", "--out", "/proc"], capture_output=True, text=True
    )
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1
    assert "/proc: cannot be written to" in done.stderr


@pytest.mark.slow
def test_height_figures_share_their_trials_and_resume_to_the_same_bytes(tmp_path):
    first, second = tmp_path / "first", tmp_path / "second"
    reproduce("t7-1", "t7-2", "--trials", 2, "--out", first, "--quiet")
    # interrupted: half of the blocks are there, no picture
    shutil.copytree(first, second)
    blocks = sorted((second / "blocks").glob("*.npz"))
    for path in (*second.glob("t7*"), *second.glob("claims*"), *blocks[::2]):
        path.unlink()
    reproduce("t7-1", "t7-2", "--trials", 2, "--out", second, "--quiet", "--resume")
    names = [path.name for path in sorted(first.iterdir()) if path.is_file()]
    figures = [f"{one}.{suffix}" for one in ("t7-1", "t7-2") for suffix in ("csv", "json", "png")]
    assert names == ["claims.json", "claims.md", *figures]
    for name in names:
        assert (first / name).read_bytes() == (second / name).read_bytes(), name
    claims = json.loads((first / "claims.json").read_text())["claims"]
    assert {claim["figure"] for claim in claims} == {"t7-1", "t7-2"}
    rows = [row for row in read(first / "t7-1.csv") if row["series"] == "proposed (temporal)"]
    assert len(rows) == 3 * 10 + 6  # a frame at each of three heights, and six heights
    mean = np.mean([float(row["y"]) for row in rows[:10]])
    assert mean == pytest.approx(float(rows[31]["y"]), rel=1e-6)


@pytest.mark.slow
def test_the_map_is_drawn_and_written_of_every_claim_that_hangs_on_open_values(
    tmp_path, monkeypatch
):
    """Under a reading of each kind: more power, no floor, another scheme, beams that fall back."""
    some = ("P_T = 2", "min_rate 0", "pilot held on a needle beam", "exact CRB")
    few = tuple(one for one in mapping.VARIATIONS if one.label in some)
    assert len(few) == len(some)
    monkeypatch.setattr(mapping, "VARIATIONS", few)
    figure = replace(FIGURES["sensitivity"], points=mapping.setups())
    monkeypatch.setitem(FIGURES, "sensitivity", figure)
    reproduce("sensitivity", "--trials", 2, "--out", tmp_path, "--quiet")
    document = json.loads((tmp_path / "claims.json").read_text())
    rows = document["sensitivity"]
    claims = [one.id for one in ALL if one.figure in ("t1", "test2-1", "t6", "t7-1", "t7-2")]
    assert list(dict.fromkeys(row["id"] for row in rows)) == claims
    assert {row["reading"] for row in rows} == {"default reading", *some}
    page = (tmp_path / "claims.md").read_text()
    section = page.split("## Sensitivity of the claims")[1]
    assert all(f"\n| {claim} | " in section for claim in claims)
    assert "sensitivity map shows" in page
    assert (tmp_path / "sensitivity.png").read_bytes().startswith(PNG)
    assert document["claims"] == []


@pytest.mark.slow
def test_what_a_killed_process_left_of_a_picture_goes_away(tmp_path: Path) -> None:
    leftover = tmp_path / ".approx.png.1.tmp"
    leftover.write_bytes(b"half a picture")
    reproduce("approx", "--out", tmp_path, "--quiet")
    assert not leftover.exists()
    assert (tmp_path / "approx.png").exists()


@pytest.mark.parametrize(
    ("setting", "words"),
    [
        ("uav.height=80 m", r"--set uav\.height: the figures set uav\.height"),
        ("uav={}", r"--set uav: the figures set uav\.height"),
        ("array.n_tx.0=1", r"the figures set array\.n_tx"),
        ("schemes=['omni']", r"the figures set schemes"),
        ("radar.target=car", r"radar\.target: 'car' is not accepted; expected 'constant'"),
        ("radar.target", r"expected KEY=VALUE"),
    ],
)
def test_a_setting_that_a_figure_sets_or_that_is_wrong_is_refused(tmp_path, setting, words):
    with pytest.raises(InputError, match=words):
        reproduce("t7-1", "--set", setting, "--out", tmp_path / "out")
    assert not (tmp_path / "out" / "claims.json").exists()


@pytest.mark.slow
def test_claims_under_another_setting_say_so(tmp_path):
    """Twice the power in slot 1, where all of it is omnidirectional: log2(1 + 2 / d^2), Eq. (7)."""
    setting = "radio.power=2"
    reproduce("t7-1", "--trials", "2", "--set", setting, "--out", tmp_path, "--quiet")
    document = json.loads((tmp_path / "claims.json").read_text())
    assert document["set"] == [setting]
    assert (
        f"**Not the paper's setting**: all points were run with `{setting}`."
        in (tmp_path / "claims.md").read_text()
    )
    rows = read(tmp_path / "t7-1.csv")
    first = [float(row["y"]) for row in rows if "100 m" in row["panel"] and float(row["x"]) == 1]
    np.testing.assert_allclose(first, np.log2(1.0 + 2.0 / (2.0 * 100.0**2)), rtol=1e-6)
