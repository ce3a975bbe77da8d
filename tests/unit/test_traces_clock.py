"""Times that were rounded when they were written."""

import numpy as np
import pytest

from echobeam.traces.clock import last_digit

from ..drives import FORMATS, Row, as_csv, read


def rounded(step, digits, velocity=20.0, a=0.0, n=None, speeds=True, name="a", first=0):
    """A car whose sample times are printed with a number of digits."""
    rows = []
    for k in range(first, n or round(10 / step) + 1):
        t = k * step
        speed = f"{velocity + a * t:.2f}" if speeds else ""
        x = f"{velocity * t + a * t**2 / 2:.2f}"
        rows.append(Row(f"{t + 1e-9:.{digits}f}", name, x, "0.00", speed))
    return rows


@pytest.mark.parametrize("write", FORMATS.values(), ids=FORMATS)
@pytest.mark.parametrize("speeds", [True, False])
def test_steps_of_25_ms_in_two_digits_are_put_right(tmp_path, write, speeds):
    found = read(tmp_path, write(rounded(0.025, 2, speeds=speeds)), seconds=9.9, start=0.0)
    np.testing.assert_allclose(found.velocity("a"), 20.0, rtol=1e-3)
    assert found.notes == []


@pytest.mark.parametrize(
    ("step", "digits"),
    [(0.025, 2), (1 / 30, 2), (0.125, 2), (0.0125, 3), (1 / 60, 3), (0.25, 1), (1 / 12, 2)],
)
@pytest.mark.parametrize(("velocity", "a"), [(13.9, 0.0), (10.0, 1.5), (30.0, -2.0)])
@pytest.mark.parametrize("speeds", [True, False])
def test_even_steps_are_found_behind_rounded_times(tmp_path, step, digits, velocity, a, speeds):
    rows = rounded(step, digits, velocity, a, speeds=speeds)
    found = read(tmp_path, as_csv(rows), seconds=9.0)
    times = found.times("a")
    # The run as a whole may be off by half the last digit.
    slack = np.abs(a) * 10.0**-digits
    expected = velocity + a * times
    assert np.abs(found.velocity("a") - expected).max() <= 0.01 * expected.min() + slack


@pytest.mark.parametrize("step", [0.025, 0.5])
def test_nobody_may_be_near(tmp_path, step):
    found = read(tmp_path, as_csv(rounded(step, 2)), seconds=5.0, range_m=10.0, origin=1e4)
    assert not found.motion.present.any()


def test_samples_may_be_missing(tmp_path):
    rows = rounded(0.025, 2)
    kept = [row for k, row in enumerate(rows) if k not in (3, 30, 31, 90, 150, 151)]
    found = read(tmp_path, as_csv(kept), seconds=9.9)
    np.testing.assert_allclose(found.velocity("a"), 20.0, rtol=2e-3)


def test_vehicles_may_come_and_go_and_be_listed_one_by_one(tmp_path):
    rows = [
        *rounded(0.025, 2, name="a", first=101, n=300),
        *rounded(0.025, 2, 15.0, name="b", first=30, n=200),
        *rounded(0.025, 2, 25.0, name="c", first=77, n=400),
    ]
    found = read(tmp_path, as_csv(rows))
    for name, velocity in zip("abc", (20.0, 15.0, 25.0), strict=True):
        np.testing.assert_allclose(found.velocity(name), velocity, rtol=0.005)


def test_whole_seconds_with_samples_missing_stay_what_they_are(tmp_path):
    times = (0, 1, 2, 4, 5, 6, 7, 9, 10)
    rows = [Row(f"{t}", "a", f"{20 * t}", "0", "20") for t in times]
    found = read(tmp_path, as_csv(rows))
    np.testing.assert_allclose(found.velocity("a"), 20.0, rtol=1e-9)


def test_times_that_jitter_by_themselves_stay_what_they_are(tmp_path):
    rng = np.random.default_rng(8)
    t = np.cumsum(rng.choice([0.02, 0.03], 400))
    rows = [Row(f"{each:.2f}", "a", f"{20 * each:.4f}", "0") for each in t]
    found = read(tmp_path, as_csv(rows), seconds=9.0)
    np.testing.assert_allclose(found.velocity("a"), 20.0, rtol=1e-3)


@pytest.mark.parametrize("velocity", [5.0, 13.9, 33.3])
@pytest.mark.parametrize("step", [0.02, 0.04, 0.1])
def test_rounded_positions_of_many_samples_do_not_shake_the_velocity(tmp_path, velocity, step):
    rows = rounded(step, 2, velocity, speeds=False)
    found = read(tmp_path, as_csv(rows), seconds=9.9)
    np.testing.assert_allclose(found.velocity("a"), velocity, rtol=0.01)


@pytest.mark.parametrize(
    ("value", "digits"), [(3.0, 0), (0.1 + 0.2, 1), (1.25, 2), (1.7e9 + 0.125, 3), (1 / 3, 6)]
)
def test_last_digit_of_a_number(value, digits):
    assert last_digit(value, 0) == digits
