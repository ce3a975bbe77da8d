"""Traces at the command line: exit status, message, and truth of the result."""

import numpy as np
import pytest
import xarray as xr

from ..drives import INVALID, Row, as_csv, as_xml, drive, with_columns
from .test_cli import echobeam, refused

pytestmark = pytest.mark.slow  # the quick selection stays under a minute

SETTINGS = ("frame.frames=40", "frame.slot=100 ms", "frame.slots_per_frame=2")


def run(folder, content, *options):
    """Run a scenario on a trace, as in the documentation."""
    trace, out = folder / "trace", folder / "result.nc"
    trace.write_bytes(content.encode() if isinstance(content, str) else content)
    settings = [part for key in SETTINGS for part in ("--set", key)]
    return echobeam(
        *("run", "traffic", "--trace", trace, "--scheme", "omni", "--trials", 1),
        *(*settings, "--out", out, "--force", *options),
    )


def velocities(folder):
    """True velocities of all that was served, in one array."""
    with xr.open_dataset(folder / "result.nc") as result:
        velocity = result["truth"].sel(state="velocity").values
    return velocity[np.isfinite(velocity)]


def test_what_agrees_is_run_without_a_word(tmp_path):
    done = run(tmp_path, as_csv(drive("a", 20.0)), "--quiet")
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    np.testing.assert_allclose(velocities(tmp_path), 20.0, rtol=1e-9)


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (with_columns(drive("a", 20.0), speed=lambda v: 3.6 * v), ["line 2", "'a'", "km/h"]),
        (with_columns(drive("a", 20.0), t=lambda t: 1e3 * t), ["line 2", "'a'", "ms"]),
        (with_columns(drive("a", 9e8), speed=""), ["line 3", "'a'", "faster than light"]),
    ],
)
def test_what_contradicts_itself_is_refused_with_cause_vehicle_and_line(tmp_path, rows, words):
    refused(run(tmp_path, as_csv(rows)), "trace, line", *words)
    assert not (tmp_path / "result.nc").exists()


def test_what_is_dropped_is_told_once_and_the_rest_is_right(tmp_path):
    rows = drive("a", 20.0)
    rows[7] = Row(rows[7].t, "a", f"{INVALID}", f"{INVALID}", f"{INVALID}")
    done = run(tmp_path, as_xml([*rows, *drive("b", 20.0, x=-60.0, y=3.2)]), "--quiet")
    assert done.returncode == 0
    assert done.stderr.count("\n") == 1
    assert done.stderr.startswith(f"echobeam: {tmp_path / 'trace'}: 1 sample without a position")
    assert "of vehicle 'a' in line" in done.stderr
    np.testing.assert_allclose(velocities(tmp_path), 20.0, rtol=1e-9)


@pytest.mark.parametrize("mark", ["0", "-1"])
def test_marks_are_told_and_the_velocity_is_right(tmp_path, mark):
    done = run(tmp_path, as_csv(with_columns(drive("a", 20.0), speed=mark)))
    assert f"speed is {mark} in every row of vehicle 'a', which moves (line 2" in done.stderr
    np.testing.assert_allclose(velocities(tmp_path), 20.0, rtol=1e-9)


def test_the_reading_of_a_long_trace_is_shown_unless_quiet(tmp_path):
    pad = "." * 500
    rows = as_csv(drive("a", 20.0, n=4000)).splitlines()
    text = "\n".join(f"{row},{pad}" for row in rows)
    assert "reading the trace" in run(tmp_path, text).stderr
    assert "reading the trace" not in run(tmp_path, text, "--quiet").stderr
