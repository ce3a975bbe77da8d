"""Places that no vehicle can have reached: sentinels, teleports, ids that come again."""

import numpy as np
import pytest

from echobeam.traces import road_between

from ..drives import FORMATS, INVALID, Row, as_csv, as_xml, drive, packed, read, with_columns

OTHER = drive("other", 15.0, x=-60.0, y=3.2)


def jumping(by, after=10, **options):
    """A car that is put elsewhere between two samples."""
    rows = drive("a", 20.0, **options)
    return rows[:after] + with_columns(rows[after:], x=lambda x: x + by)


@pytest.mark.parametrize("write", FORMATS.values(), ids=FORMATS)
@pytest.mark.parametrize("where", [[0], [7], [7, 8], [20]], ids=str)
def test_samples_without_a_position_are_dropped_and_told(tmp_path, write, where):
    rows = drive("a", 20.0)
    for k in where:
        rows[k] = Row(rows[k].t, "a", f"{INVALID:.2f}", f"{INVALID:.2f}", f"{INVALID:.2f}")
    found = read(tmp_path, write([*OTHER, *rows]))
    np.testing.assert_allclose(found.velocity("a"), 20.0, rtol=1e-9)
    np.testing.assert_allclose(found.velocity("other"), 15.0, rtol=1e-9)
    gone = 0.5 * np.array(where)
    assert not (np.abs(found.times("a")[:, None] - gone) < 0.45).any()
    assert found.velocity("other").size == 101
    (note,) = found.notes
    assert f"{len(where)} sample" in note
    assert "without a position (SUMO's -1073741824) dropped, first of vehicle 'a' in line" in note


def test_the_note_has_the_line(tmp_path):
    rows = drive("a", 20.0)
    rows[7] = Row(rows[7].t, "a", f"{INVALID}", "0")
    assert "in line 9" in read(tmp_path, as_csv(rows)).notes[0]


@pytest.mark.parametrize("write", [as_csv, as_xml, packed(as_xml)])
@pytest.mark.parametrize("by", [-300.0, -60.0, -30.0, 15.0, 60.0, 420.0, 5e4])
@pytest.mark.parametrize("speeds", [True, False])
def test_a_teleport_is_no_motion(tmp_path, write, by, speeds):
    rows = [*OTHER, *jumping(by)]
    rows = rows if speeds else with_columns(rows, speed="")
    found = read(tmp_path, write(rows))
    np.testing.assert_allclose(found.velocity("a"), 20.0, rtol=1e-9)
    assert not ((found.times("a") > 4.55) & (found.times("a") < 4.95)).any()
    assert found.velocity("a").size == 97
    (note,) = found.notes
    assert "1 jump of 1 vehicle that no vehicle can drive, first of 'a' in line" in note
    assert "the vehicle is absent in between" in note


def test_a_teleport_is_a_break_also_between_two_slots(tmp_path):
    found = read(tmp_path, as_csv([*OTHER, *jumping(200.0)]), slot=1.0)
    times = found.times("a", slot=1.0)
    assert times.tolist() == [0, 1, 2, 3, 4, 6, 7, 8, 9, 10]
    np.testing.assert_allclose(found.velocity("a"), 20.0)


@pytest.mark.parametrize("by", [-9.0, 8.0])
def test_short_jumps_are_told_from_motion_by_the_speeds(tmp_path, by):
    found = read(tmp_path, as_csv([*OTHER, *jumping(by)]))
    np.testing.assert_allclose(found.velocity("a"), 20.0, rtol=1e-9)
    assert any("jump" in note for note in found.notes)


@pytest.mark.parametrize("k", [0, 1, 7, 19, 20])
@pytest.mark.parametrize("place", [60.0, -9999.0, 1e7])
def test_a_sample_at_an_absurd_place_is_left_out(tmp_path, k, place):
    rows = drive("a", 20.0)
    rows[k] = Row(rows[k].t, "a", f"{place + float(rows[k].x)}", "0", "20")
    found = read(tmp_path, as_csv([*OTHER, *with_columns(rows, speed="")]))
    np.testing.assert_allclose(found.velocity("a"), 20.0, rtol=1e-9)
    np.testing.assert_allclose(found.velocity("other"), 15.0, rtol=1e-9)
    assert found.notes


def test_absurd_places_do_not_move_the_origin(tmp_path):
    rows = drive("a", 20.0)
    rows[7] = Row(rows[7].t, "a", "1e7", "0", "20")
    found = read(tmp_path, as_csv(rows))
    # From -100 m to 100 m: the origin is in the middle.
    assert found.motion.position[0, 0] == pytest.approx(-100.0)


@pytest.mark.parametrize("far", [-9999.0, 1e6])
def test_absurd_places_beside_the_road_do_not_turn_it(tmp_path, far):
    rows = drive("a", 20.0)
    rows[7] = Row(rows[7].t, "a", f"{far}", f"{far}", "20")
    found = read(tmp_path, as_csv([*OTHER, *rows]))
    np.testing.assert_allclose(found.velocity("a"), 20.0, rtol=1e-9)
    np.testing.assert_allclose(found.velocity("other"), 15.0, rtol=1e-9)


@pytest.mark.parametrize("back", [40.0, 100.0, 2000.0])
@pytest.mark.parametrize("pause", [1, 3, 20])
def test_an_id_that_comes_again_elsewhere_is_another_motion(tmp_path, back, pause):
    first, again = drive("a", 20.0, n=8), drive("a", 20.0, n=10, x=40.0 - back)
    again = with_columns(again, t=lambda t: t + 3.5 + 0.5 * pause)
    found = read(tmp_path, as_csv([*OTHER, *first, *again]), seconds=18.0)
    if pause == 1 or back == 2000.0:
        np.testing.assert_allclose(found.velocity("a"), 20.0, rtol=1e-9)
        assert any("1 jump of 1 vehicle" in note for note in found.notes)
    assert found.velocity("other").size == 101


@pytest.mark.parametrize(
    ("velocity", "a", "step", "n"),
    [(40.0, -9.0, 1.0, 5), (0.0, 4.5, 1.0, 12), (40.0, -9.0, 0.1, 40), (40.0, -9.0, 2.0, 3)],
)
@pytest.mark.parametrize("speeds", [True, False])
def test_hard_braking_and_starting_are_motion(tmp_path, velocity, a, step, n, speeds):
    drives = drive("a", velocity, n=n, step=step, a=a)
    end, last = float(drives[-1].x), float(drives[-1].speed)
    after = [
        Row(f"{(n - 1 + k) * step:.3f}", "a", f"{end + last * k * step:.2f}", "0", f"{last:.2f}")
        for k in range(1, 10)
    ]
    rows = [*drives, *after]
    rows = rows if speeds else with_columns(rows, speed="")
    found = read(tmp_path, as_csv(rows), seconds=(n + 8) * step)
    assert not any("jump" in note for note in found.notes)
    assert found.times("a").size == round((n + 8) * step / 0.1) + 1


def test_noisy_positions_are_no_jumps(tmp_path):
    rng = np.random.default_rng(6)
    rows = [
        Row(r.t, r.id, f"{float(r.x) + rng.normal(0, 0.6):.2f}", f"{rng.normal(0, 0.6):.2f}")
        for r in drive("a", 15.0, n=101, step=1.0)
    ]
    found = read(tmp_path, as_csv(rows), seconds=100.0)
    assert not found.notes
    assert found.times("a").size == 1001


@pytest.mark.parametrize("step", [0.025, 0.1, 0.5, 1.0])
def test_a_change_of_two_lanes_in_a_step_is_motion(tmp_path, step):
    rows = drive("a", 10.0, step=step, n=round(12 / step))
    rows[8:] = with_columns(rows[8:], y=lambda y: y + 4.8)
    along = road_between((0.0, 0.0), (1.0, 0.0))
    found = read(tmp_path, as_csv([*OTHER, *rows]), road=along, slot=0.5)
    assert found.notes == []
    np.testing.assert_allclose(found.velocity("a"), 10.0, rtol=1e-9)
