"""A trace file as the motion of the vehicles served."""

import gzip
import importlib.resources
import importlib.util
import math
import re
import tracemalloc
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest

from echobeam.traces import TraceError, load_motion, road_between
from echobeam.traces.source import read_samples
from echobeam.traces.survey import survey_trace

SHIPPED = importlib.resources.files("echobeam.scenario") / "presets/traffic-trace.xml.gz"
SLOTS = 0.01 * np.arange(101)


@pytest.fixture
def steady(tmp_path):
    """One car at 10 m/s along x from 100 m, another the other way; t from 5 s to 9 s."""
    path = tmp_path / "steady.csv"
    lines = ["t,id,x,y,speed"]
    for t in range(5):
        lines += [f"{5 + t},east,{100 + 10 * t},2,10", f"{5 + t},west,{140 - 10 * t},5,10"]
    path.write_text("\n".join(lines))
    return path


def load(path, times=SLOTS, **options):
    return load_motion(path, times, **{"uav_x": 0.0, "max_objects": 2, "range_m": 100.0} | options)


def test_origin_is_the_middle_of_the_traces_extent_and_slot_1_its_first_time(steady):
    motion = load(steady)
    assert motion.names == ("east", "west")
    np.testing.assert_array_equal(motion.identity, np.tile([0, 1], (101, 1)))
    np.testing.assert_allclose(motion.position[:, 0], -20 + 10 * SLOTS, atol=1e-12)
    np.testing.assert_allclose(motion.position[:, 1], 20 - 10 * SLOTS, atol=1e-12)
    np.testing.assert_allclose(motion.velocity, np.tile([10.0, -10.0], (101, 1)), atol=1e-12)


def test_origin_and_start_may_be_given(steady):
    motion = load(steady, origin=100.0, start=6.5)
    np.testing.assert_allclose(motion.position[:, 0], 15 + 10 * SLOTS, atol=1e-12)


def test_only_differences_of_slot_times_count(steady):
    late = load(steady, times=SLOTS + 1000)
    np.testing.assert_allclose(late.position, load(steady).position, atol=1e-9)


def test_slots_before_and_after_the_trace_are_empty(steady):
    motion = load(steady, times=np.arange(0.0, 10.0), start=2.0)
    assert motion.present.all(axis=1).tolist() == [False] * 3 + [True] * 5 + [False] * 2


def test_given_road_sets_direction_zero_and_who_is_on_it(steady):
    road = road_between((200.0, 0.0), (0.0, 0.0), half_width=3.0)
    motion = load(steady, road=road, origin=0.0)
    assert motion.names == ("east",)
    np.testing.assert_allclose(motion.position[:, 0], 100 - 10 * SLOTS, atol=1e-12)
    np.testing.assert_allclose(motion.velocity[:, 0], -10.0)
    assert not motion.present[:, 1].any()


def test_vehicles_with_one_sample_are_dropped_and_counted(steady):
    with steady.open("a") as file:
        file.write("\n7,once,120,2,10\n7,twice,120,2,10\n7.5,twice,125,2,10\n6,alone,0,2,1\n")
    motion = load(steady, times=np.arange(0, 4, 0.1), max_objects=9)
    assert motion.dropped == 2
    seen = {motion.names[i] for i in np.unique(motion.identity[motion.present])}
    assert seen == {"east", "west", "twice"}


def test_moving_uav_serves_those_who_are_near_at_the_slot(steady):
    options = {"uav_x": [-20, -20, 0, 20, 20], "range_m": 0.5, "max_objects": 1}
    motion = load(steady, times=np.arange(5.0), **options)
    assert motion.identity[:, 0].tolist() == [0, -1, 0, -1, 0]
    np.testing.assert_allclose(motion.position[::2, 0], [-20, 0, 20], atol=1e-12)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"times": []}, "times"),
        ({"times": [0.0, math.nan]}, "times"),
        ({"times": [0.0, 0.0]}, "times must increase"),
        ({"uav_x": math.nan}, "uav_x"),
        ({"max_objects": -1}, "max_objects"),
        ({"max_objects": 1.5}, "max_objects"),
        ({"range_m": 0.0}, "range_m"),
        ({"range_m": math.inf}, "range_m"),
        ({"origin": math.nan}, "origin"),
        ({"start": math.inf}, "start"),
    ],
)
def test_arguments_that_make_no_sense_are_refused(steady, options, message):
    with pytest.raises(ValueError, match=message):
        load(steady, **options)


@pytest.mark.parametrize("start", [-100.0, 9.5])
def test_slots_that_miss_the_trace_are_refused(steady, start):
    with pytest.raises(TraceError, match=r"steady\.csv: the slots run from .* trace from 5 s to 9"):
        load(steady, start=start)


def test_shipped_trace_is_small_and_serves_vehicles_that_enter_stop_and_leave():
    assert Path(str(SHIPPED)).stat().st_size < 100_000
    times = 0.01 * np.arange(6000)
    motion = load(SHIPPED, times, max_objects=4)
    assert motion.present.any(axis=1).all()
    spells = np.count_nonzero(np.diff(motion.identity, axis=0), axis=0)
    assert (spells >= 4).all()
    assert np.nanmin(motion.velocity) == 0.0
    assert 15 < np.nanmax(motion.velocity) < 25
    served = {motion.names[i].split(".")[0] for i in np.unique(motion.identity[motion.present])}
    assert served == {"car", "truck", "joins", "leaves", "stops"}


def test_shipped_trace_moves_smoothly_and_through_its_samples():
    times = 0.01 * np.arange(6000)
    along_x = road_between((0.0, 0.0), (1.0, 0.0))
    motion = load(SHIPPED, times, max_objects=4, road=along_x, origin=0.0, uav_x=300.0)
    same = (motion.identity[1:] == motion.identity[:-1]) & motion.present[1:]
    change = np.abs(np.diff(motion.velocity, axis=0)[same])
    assert change.max() < 0.1  # 10 m/s^2: no vehicle brakes harder
    moved = np.diff(motion.position, axis=0)[same]
    middle = ((motion.velocity[1:] + motion.velocity[:-1]) / 2)[same]
    np.testing.assert_allclose(moved, 0.01 * middle, atol=1e-4)
    text = gzip.decompress(Path(str(SHIPPED)).read_bytes()).decode()
    step = re.search(r'time="75\.000">(.*?)</timestep>', text, re.DOTALL)[1]
    given = {
        found[1]: (float(found[2]), float(found[3]))
        for found in re.finditer(r'id="(.*?)" x="(.*?)" .* speed="(.*?)"', step)
    }
    for column in np.flatnonzero(motion.present[1500]):
        x, speed = given[motion.names[motion.identity[1500, column]]]
        assert motion.position[1500, column] == pytest.approx(x, abs=1e-9)
        assert motion.velocity[1500, column] == pytest.approx(speed, abs=1e-9)


def test_road_fitted_to_the_shipped_trace_is_the_one_that_sumo_built():
    survey = survey_trace(SHIPPED, read_samples(SHIPPED))
    assert survey.road.heading == pytest.approx(0.0, abs=1e-3)
    assert survey.extent == pytest.approx((0.0, 600.0), abs=10.0)


@pytest.mark.slow
def test_shipped_trace_is_what_its_command_makes():
    pytest.importorskip("sumo")
    shipped = gzip.decompress(Path(str(SHIPPED)).read_bytes())
    made_by = re.search(rb"SUMO (\S+),", shipped)[1].decode()
    if version("eclipse-sumo") != made_by:
        pytest.skip(f"the trace was made by SUMO {made_by}")
    script = Path(__file__).parents[2] / "benchmarks/make_traffic_trace.py"
    spec = importlib.util.spec_from_file_location("make_traffic_trace", script)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.make_trace() == shipped


@pytest.mark.slow
def test_memory_goes_with_the_window_and_not_with_the_length_of_the_trace(tmp_path):
    peaks = []
    for minutes in (2, 8):
        path = tmp_path / f"{minutes}.csv.gz"
        with gzip.open(path, "wt", compresslevel=1) as file:
            file.write("t,id,x,y,speed\n")
            for step in range(120 * minutes):
                for car in range(30):
                    x = (50.0 * car + 10.0 * step) % 1500
                    file.write(f"{step / 2},c{car}.{int((50 * car + 10 * step) // 1500)},")
                    file.write(f"{x:.2f},0.00,20.00\n")
        tracemalloc.start()
        motion = load(path, start=40.0)
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert motion.present.all()
    # What grows is the memory of vehicles, 30 new ones per 75 s, and not that of samples.
    vehicles, samples = 30 * 6 * 60 / 75, 30 * 6 * 60 * 2
    assert peaks[1] - peaks[0] < 5000 * vehicles
    assert peaks[1] - peaks[0] < 32 * samples
