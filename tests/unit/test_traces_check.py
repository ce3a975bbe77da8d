"""Traces whose speeds, times and positions contradict each other."""

import re

import numpy as np
import pytest

from ..drives import (
    FORMATS,
    Row,
    as_csv,
    as_xml,
    drive,
    packed,
    read,
    refusal,
    with_columns,
)

TWO = [*drive("a", 20.0), *drive("b", 15.0, x=-60.0, y=3.2)]
TURNING = [*drive("a", 5.0, a=1.5), *drive("b", 30.0, x=-60.0, y=3.2, a=-2.0)]


def times(factor):
    return lambda value: factor * value


@pytest.mark.parametrize("write", FORMATS.values(), ids=FORMATS)
def test_what_agrees_is_read_as_it_is(tmp_path, write):
    found = read(tmp_path, write(TURNING))
    assert found.notes == []
    np.testing.assert_allclose(found.velocity("a"), 5 + 1.5 * found.times("a"), atol=0.03)
    np.testing.assert_allclose(found.velocity("b"), 30 - 2 * found.times("b"), atol=0.03)


@pytest.mark.parametrize("rows", [TWO, TURNING], ids=["steady", "accelerating"])
@pytest.mark.parametrize(
    ("column", "factor", "cause"),
    [
        ("speed", 3.6, "are the speeds in km/h?"),
        ("speed", 2.23694, "are the speeds in miles per hour?"),
        ("speed", 1.94384, "are the speeds in knots?"),
        ("x", 3.28084, "are the positions in feet?"),
        ("x", 100.0, "are the positions in cm?"),
        ("x", 1000.0, "are the positions in mm?"),
        ("x", 1e-3, "or the positions in km?"),
        ("t", 1000.0, "are the times in ms"),
        ("t", 1e6, "are the times in microseconds?"),
        ("t", 1 / 60, "are the times in minutes?"),
        ("t", 1 / 3600, "are the times in hours?"),
    ],
)
def test_wrong_units_are_refused_with_their_name(tmp_path, rows, column, factor, cause):
    content = as_csv(with_columns(rows, **{column: times(factor)}))
    message = refusal(tmp_path, content)
    assert cause in message
    assert re.match(r", line \d+: vehicle '[ab]' moves ", message)


@pytest.mark.parametrize("write", FORMATS.values(), ids=FORMATS)
def test_wrong_units_are_refused_in_every_format(tmp_path, write):
    message = refusal(tmp_path, write(with_columns(TWO, speed=times(3.6))))
    assert "moves 20 m/s by its positions, but 72 m/s by its speed, 3.6 times as much" in message
    assert "(2 of 2 vehicles" in message


@pytest.mark.parametrize("rate", [10, 25, 30])
def test_numbers_of_frames_for_times_are_refused(tmp_path, rate):
    rows = drive("a", 20.0, n=10 * rate, step=1 / rate)
    numbered = [Row(str(k), r.id, r.x, r.y, r.speed) for k, r in enumerate(rows)]
    assert f"numbers of frames, {rate} a second?" in refusal(tmp_path, as_csv(numbered))


@pytest.mark.parametrize("write", [as_csv, as_xml, packed(as_xml)])
@pytest.mark.parametrize(("longitude", "latitude"), [(11.5, 48.1), (-122.3, 37.9), (151.2, -33.9)])
@pytest.mark.parametrize("speed", ["20.00", ""], ids=["speeds", "no speeds"])
def test_degrees_are_refused(tmp_path, write, longitude, latitude, speed):
    metre = 1 / (111_320 * np.cos(np.deg2rad(latitude)))
    rows = [
        Row(f"{k}", "a", f"{longitude + 20 * k * metre:.7f}", f"{latitude}", speed)
        for k in range(11)
    ]
    message = refusal(tmp_path, write(rows))
    assert "are x, y degrees instead of metres (SUMO's --fcd-output.geo)?" in message
    assert "vehicle 'a'" in message


@pytest.mark.parametrize(
    ("change", "cause"),
    [
        ({"t": times(1000.0)}, "are the times in ms"),
        ({"x": times(1e-3)}, "or the positions in km?"),
        ({"t": times(1 / 60)}, "faster than any road vehicle"),
    ],
)
def test_without_speeds_the_pace_tells(tmp_path, change, cause):
    assert cause in refusal(tmp_path, as_csv(with_columns(TWO, speed="", **change)))


def test_frames_without_speeds_are_refused(tmp_path):
    rows = [Row(str(k), "a", f"{0.8 * k:.2f}", "0", "") for k in range(200)]
    assert "are the times numbers of frames?" in refusal(tmp_path, as_csv(rows))


def test_feet_without_speeds_are_asked_about(tmp_path):
    rows = with_columns([*drive("a", 30.0), *drive("b", 25.0, y=3.2)], speed="", x=times(3.28084))
    (note,) = read(tmp_path, as_csv(rows)).notes
    assert "are the positions in feet instead of metres?" in note


def test_one_vehicle_among_many_is_named(tmp_path):
    rows = [*drive("a", 20.0), *with_columns(drive("b", 15.0), speed=times(3.6))]
    message = refusal(tmp_path, as_csv(rows))
    assert message.startswith(", line 23: vehicle 'b' moves 15 m/s")
    assert "(1 of 2 vehicles" in message


@pytest.mark.parametrize("factor", [1.02, 0.96, 1.04])
def test_speeds_a_little_off_give_way_to_positions(tmp_path, factor):
    found = read(tmp_path, as_csv(with_columns(TWO, speed=times(factor))))
    np.testing.assert_allclose(found.velocity("a"), 20.0, rtol=0.002)
    np.testing.assert_allclose(found.velocity("b"), 15.0, rtol=0.002)
    (note,) = found.notes
    assert "the speeds of 2 vehicles of 2 differ from those of the positions" in note
    assert f"({factor - 1:+.1%})" in note


def test_an_unlikely_number_in_every_row_may_be_a_mark(tmp_path):
    message = refusal(tmp_path, as_csv(with_columns(TWO, speed="999")))
    assert "is 999, which is in every row, a mark for an unknown speed?" in message


@pytest.mark.parametrize("velocity", [101.0, 120.0, 200.0, 9e8])
@pytest.mark.parametrize("step", [0.1, 1.0])
def test_what_is_faster_than_any_vehicle_is_refused(tmp_path, velocity, step):
    message = refusal(tmp_path, as_csv(drive("a", velocity, n=5, step=step)))
    limit = "faster than light" if velocity > 3e8 else "faster than any road vehicle (100 m/s)"
    assert limit in message
    assert message.startswith((", line 2: vehicle 'a' moves", ", line 3: vehicle 'a' moves"))


def test_the_fastest_train_is_not_refused(tmp_path):
    found = read(tmp_path, as_csv(drive("a", 97.0)))
    np.testing.assert_allclose(found.velocity("a"), 97.0, rtol=1e-3)


def test_one_id_for_two_vehicles_at_once_is_refused(tmp_path):
    rows = [Row(f"{k}", "a", f"{20 * k + 300 * (k % 2)}", "0", "20") for k in range(11)]
    assert "is the id that of one vehicle?" in refusal(tmp_path, as_csv(rows))


@pytest.mark.parametrize("jitter", [0.0, 0.02])
def test_parked_vehicles_are_read(tmp_path, jitter):
    rows = [
        Row(f"{k}", name, f"{10 * place + jitter * (k % 2)}", "0", "0")
        for k in range(11)
        for place, name in enumerate("abc")
    ]
    found = read(tmp_path, as_csv(rows))
    assert found.notes == []
    assert np.abs(found.velocity("b")).max() <= 2 * jitter
