"""Speeds of a trace: of which time, in rows of which some are marks, and of which sign."""

import numpy as np
import pytest

from ..drives import (
    FORMATS,
    INVALID,
    Row,
    as_csv,
    as_sumo_csv,
    as_xml,
    drive,
    packed,
    read,
    with_columns,
)


def stepped(step, acceleration, mean_of, top=20.0, seconds=20.0):
    """A car that starts from rest, in a simulator with speeds that are constant in a step."""
    x, v, rows = 0.0, 0.0, []
    for k in range(round(seconds / step) + 1):
        faster = min(v + acceleration * step, top)
        speed = v if mean_of == "before" else faster
        rows.append(Row(f"{k * step:.2f}", "a", f"{x:.2f}", "0.00", f"{speed:.2f}"))
        v = faster
        x += v * step
    return rows


@pytest.mark.parametrize("write", FORMATS.values(), ids=FORMATS)
def test_speeds_of_sumos_default_are_means_over_the_step_before(tmp_path, write):
    found = read(tmp_path, write(stepped(1.0, 2.6, "before")), slot=0.5, seconds=3.0, start=0.0)
    np.testing.assert_allclose(found.velocity("a")[:6], [1.3, 2.6, 3.9, 5.2, 6.5, 7.8], rtol=1e-9)
    assert found.notes == []


@pytest.mark.parametrize("mean_of", ["before", "after"])
@pytest.mark.parametrize("step", [0.1, 0.25, 0.5, 1.0, 2.0])
@pytest.mark.parametrize("acceleration", [1.0, 2.6])
def test_stepped_speeds_give_the_acceleration_that_was_driven(
    tmp_path, mean_of, step, acceleration
):
    rows = stepped(step, acceleration, mean_of, top=1e3, seconds=12.0)
    found = read(tmp_path, as_csv(rows))
    # The positions of constant acceleration from half a step before the first one.
    begun = step if mean_of == "before" else 0.0
    expected = acceleration * (found.times("a") + step / 2)
    later = found.times("a") > 2.0 + begun
    np.testing.assert_allclose(found.velocity("a")[later], expected[later], rtol=0.01)


def test_stepped_speeds_of_one_in_five_steps_are_read_rightly_too(tmp_path):
    rows = stepped(0.1, 2.0, "before", top=1e3, seconds=12.0)[::5]
    found = read(tmp_path, as_csv(rows))
    later = found.times("a") > 2.0
    expected = 2.0 * (found.times("a") + 0.05)
    np.testing.assert_allclose(found.velocity("a")[later], expected[later], rtol=0.01)


def test_speeds_at_the_samples_times_are_used(tmp_path):
    # 0 to 8 m/s in 4 s and back, in samples of 4 s: positions alone cannot tell.
    rows = [Row(f"{4 * k}", "a", f"{16 * k}", "0", f"{8 * (k % 2)}") for k in range(11)]
    found = read(tmp_path, as_csv(rows), slot=4.0, seconds=36.0)
    np.testing.assert_allclose(found.velocity("a")[1:], [8 * (k % 2) for k in range(1, 10)])


@pytest.mark.parametrize("mark", ["0", "-1", "-9999", f"{INVALID}"])
@pytest.mark.parametrize("write", FORMATS.values(), ids=FORMATS)
def test_a_mark_in_every_row_is_an_unknown_speed(tmp_path, write, mark):
    rows = [*with_columns(drive("a", 20.0), speed=mark), *drive("b", 15.0, y=3.2)]
    found = read(tmp_path, write(rows))
    np.testing.assert_allclose(found.velocity("a"), 20.0, rtol=1e-9)
    np.testing.assert_allclose(found.velocity("b"), 15.0, rtol=1e-9)
    if mark != f"{INVALID}":
        (note,) = found.notes
        assert f"speed is {mark} in every row of vehicle 'a', which moves (line " in note


@pytest.mark.parametrize("mark", ["0", "-1", "-99"])
@pytest.mark.parametrize("velocity", [8.0, 20.0])
@pytest.mark.parametrize("step", [0.1, 0.5, 1.0])
@pytest.mark.parametrize("where", [[5], [3, 9, 14], [0], [20]], ids=str)
def test_a_mark_in_some_rows_is_an_unknown_speed(tmp_path, mark, velocity, step, where):
    rows = drive("a", velocity, step=step)
    for k in where:
        rows[k : k + 1] = with_columns(rows[k : k + 1], speed=mark)
    found = read(tmp_path, as_csv([*rows, *drive("b", 15.0, step=step, n=21)]), seconds=20 * step)
    np.testing.assert_allclose(found.velocity("a"), velocity, rtol=0.01)


def test_a_vehicle_that_stops_for_a_moment_has_speed_zero_there(tmp_path):
    brake, go = drive("a", 10.0, n=11, a=-2.0), drive("a", 0.0, n=11, x=-75.0, a=2.0)
    later = with_columns(go[1:], t=lambda t: t + 5.0)
    found = read(tmp_path, as_csv([*brake, *later]))
    assert found.notes == []
    np.testing.assert_allclose(found.velocity("a"), 2 * np.abs(found.times("a") - 5.0), atol=0.05)


@pytest.mark.parametrize("write", [as_csv, as_xml, packed(as_csv), as_sumo_csv])
@pytest.mark.parametrize("a", [0.0, -1.0])
def test_signed_speeds_of_two_directions_are_right(tmp_path, write, a):
    # As in highD: 25 samples a second, one direction with negative speeds throughout.
    east = drive("east", 25.0, n=250, step=0.04, a=a)
    west = drive("west", -30.0, n=250, step=0.04, x=200.0, y=10.0, a=-a)
    found = read(tmp_path, write([*east, *west]), seconds=9.0)
    np.testing.assert_allclose(found.velocity("east"), 25 + a * found.times("east"), rtol=0.005)
    np.testing.assert_allclose(found.velocity("west"), -30 - a * found.times("west"), rtol=0.005)
    assert found.notes == []


def test_noisy_positions_do_not_make_good_speeds_useless(tmp_path):
    rng = np.random.default_rng(4)
    rows = drive("a", 20.0, n=41)
    noisy = [Row(r.t, r.id, f"{float(r.x) + rng.normal(0, 0.3):.3f}", r.y, r.speed) for r in rows]
    assert read(tmp_path, as_csv(noisy)).notes == []
