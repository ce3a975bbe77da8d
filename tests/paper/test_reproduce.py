"""`echobeam reproduce` as a user meets it, on the cheapest figures."""

import csv
import json

import numpy as np
import pytest
from click.testing import CliRunner

from echobeam.cli.reproduce import command
from echobeam.faults import InputError
from echobeam.reproduction.figures import approximation

PNG = b"\x89PNG\r\n"


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


def test_a_figure_without_trials_is_drawn_judged_and_not_overwritten(tmp_path):
    out = tmp_path / "deep" / "out"
    said = reproduce("approx", "--out", out)
    assert "reproduced      approximation-minimal" in said
    assert (out / "approx.png").read_bytes().startswith(PNG)
    (claim,) = json.loads((out / "claims.json").read_text())["claims"]
    assert (claim["figure"], claim["verdict"]) == ("approx", "reproduced")
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


@pytest.mark.slow
def test_height_figures_share_their_trials_and_resume_to_the_same_bytes(tmp_path):
    first, second = tmp_path / "first", tmp_path / "second"
    reproduce("t7-1", "t7-2", "--trials", 3, "--out", first, "--quiet")
    # interrupted: half of the blocks are there, no picture
    reproduce("t7-1", "t7-2", "--trials", 3, "--out", second, "--quiet")
    blocks = sorted((second / "blocks").glob("*.npz"))
    for path in (*second.glob("t7*"), *second.glob("claims*"), *blocks[::2]):
        path.unlink()
    reproduce("t7-1", "t7-2", "--trials", 3, "--out", second, "--quiet", "--resume")
    names = [path.name for path in sorted(first.iterdir()) if path.is_file()]
    assert names == ["claims.json", "claims.md", "t7-1.csv", "t7-1.png", "t7-2.csv", "t7-2.png"]
    for name in names:
        assert (first / name).read_bytes() == (second / name).read_bytes(), name
    claims = json.loads((first / "claims.json").read_text())["claims"]
    assert {claim["figure"] for claim in claims} == {"t7-1", "t7-2"}
    rows = read(first / "t7-1.csv")
    assert len(rows) == 6 * 2 * 11
    mean = np.mean([float(row["sum rate (bit/s/Hz)"]) for row in rows[1:11]])
    assert mean == pytest.approx(float(rows[0]["sum rate (bit/s/Hz)"]), rel=1e-6)
