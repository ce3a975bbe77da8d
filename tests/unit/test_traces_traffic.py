"""Traffic before and around the simulator: plan, documents, arguments, and a simulator that fails.

The programs here are shell scripts; the real SUMO is in tests/doors.
"""

import gzip
import time
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from xml.etree import ElementTree

import pytest

from echobeam.commands.traffic_request import Wanted
from echobeam.faults import InputError, RunError
from echobeam.traces.source import read_samples
from echobeam.traces.traffic import documents, simulator
from echobeam.traces.traffic.making import make_trace
from echobeam.traces.traffic.plan import CAR, GAP, Plan, entries
from echobeam.traces.traffic.simulator import Simulator, find_simulator

PLAN = Plan(40, 1000.0, 20.0, 2, 30_000, 100, seed=0)
TWO_WAY = replace(PLAN, vehicles=61, both_directions=True)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("plan", [PLAN, TWO_WAY, replace(PLAN, lanes=3, length=300.0, vehicles=20)])
def test_vehicles_enter_apart_in_time_and_on_the_road(plan, seed):
    plan = replace(plan, seed=seed)
    found = entries(plan)
    assert len({one.name for one in found}) == len(found) == plan.vehicles
    assert sorted(one.name for one in found) == [one.name for one in found]
    for road in range(plan.roads):
        for lane in range(plan.lanes):
            there = [e.position for e in found if (e.road, e.lane) == (road, lane)]
            assert all(front - back >= CAR + GAP - 1e-3 for front, back in pairwise(there))
            assert all(0 < position < plan.length - plan.shortest for position in there)
        later = [e.time for e in found if e.road == road and e.lane is None]
        assert later == sorted(later)
        assert all(t % plan.step == 0 and t < plan.duration - 4 * plan.step for t in later)


def test_density_is_steady():
    """A steady flow q has q L / v vehicles on the road, and q T more in a time T."""
    found = entries(replace(PLAN, vehicles=80))
    on_road = sum(one.time == 0 and one.lane is not None for one in found)
    assert on_road == 80 * (1000 / 20) / (1000 / 20 + 30)


def test_medium_traffic_has_fifteen_vehicles_on_a_kilometre_of_a_lane():
    assert PLAN.usual == round(15 * 2 * (50 + 30) / 50)
    assert replace(PLAN, both_directions=True).usual == 2 * PLAN.usual


@pytest.mark.parametrize("speed", [1.0, 10.0, 50.0])
def test_medium_traffic_fits(speed):
    plan = replace(PLAN, speed=speed)
    assert 1 <= plan.usual < plan.fullest


def test_seed_decides():
    assert entries(PLAN) == entries(replace(PLAN))
    assert entries(PLAN) != entries(replace(PLAN, seed=1))
    assert entries(replace(PLAN, seed=2**63 - 1))


def test_documents_say_what_was_planned():
    nodes = ElementTree.fromstring(documents.nodes(TWO_WAY))
    assert {node.get("id"): float(node.get("x")) for node in nodes} == {"west": -500, "east": 500}
    edges = ElementTree.fromstring(documents.edges(TWO_WAY))
    assert [(e.get("from"), e.get("to")) for e in edges] == [("west", "east"), ("east", "west")]
    assert {(e.get("numLanes"), e.get("speed")) for e in edges} == {("2", "20.000")}
    assert len(ElementTree.fromstring(documents.edges(PLAN))) == 1
    planned = entries(TWO_WAY)
    routes = ElementTree.fromstring(documents.routes(TWO_WAY, planned))
    assert "normc" in routes.find("vType").get("speedFactor")
    written = [
        (v.get("id"), v.get("route") == "westbound", v.get("departLane"),
         float(v.get("depart")), float(v.get("departPos")))
        for v in routes.iter("vehicle")
    ]  # fmt: skip
    assert written == [
        (e.name, e.road == 1, "best" if e.lane is None else str(e.lane),
         e.time / 1e3, e.position)
        for e in planned
    ]  # fmt: skip


CROSSING = replace(PLAN, vehicles=400, duration=400_000, length=300.0, kind="intersection")


def test_vehicles_of_an_intersection_come_from_all_sides_and_turn_as_planned():
    planned = entries(CROSSING)
    assert {entry.road for entry in planned} == {0, 1, 2, 3}
    assert all(0.0 <= entry.position <= 150.0 for entry in planned)
    counts = [sum(entry.turn == turn for entry in planned) for turn in range(3)]
    for count, share in zip(counts, (0.25, 0.5, 0.25), strict=True):  # four standard deviations
        assert abs(count - 400 * share) < 4.0 * (400 * share * (1.0 - share)) ** 0.5


def test_ways_through_an_intersection_turn_to_the_side_that_they_name():
    nodes = ElementTree.fromstring(documents.nodes(CROSSING))
    place = {node.get("id"): (float(node.get("x")), float(node.get("y"))) for node in nodes}
    assert [node.get("id") for node in nodes if node.get("type")] == ["middle"]
    ends = {
        edge.get("id"): (place[edge.get("from")], place[edge.get("to")])
        for edge in ElementTree.fromstring(documents.edges(CROSSING))
    }
    heading = {
        name: ((b[0] - a[0]) / 150.0, (b[1] - a[1]) / 150.0) for name, (a, b) in ends.items()
    }
    routes = ElementTree.fromstring(documents.routes(CROSSING, entries(CROSSING)))
    ways = {route.get("id"): route.get("edges").split() for route in routes.iter("route")}
    assert len(ways) == 12
    for name, (into, on) in ways.items():
        assert ends[into][1] == ends[on][0] == (0.0, 0.0)
        (a, b), (c, d) = heading[into], heading[on]
        turned = {"left": 1.0, "straight": 0.0, "right": -1.0}[name.rpartition("-")[2]]
        assert a * d - b * c == turned
        assert a * c + b * d == 1.0 - abs(turned)
    assert {vehicle.get("route") for vehicle in routes.iter("vehicle")} == set(ways)


# Arguments


def wanted(out=Path("trace.xml"), **changes):
    """Arguments of a user, the defaults with changes."""
    default = {
        "vehicles": None, "length": "1 km", "speed": "20 m/s", "lanes": 2,
        "both_directions": False, "duration": "30 s", "step": "0.1 s", "seed": 0, "force": False,
        "kind": "road",
    }  # fmt: skip
    return Wanted(out, **default | changes)


def test_quantities_are_read_with_units():
    plan = wanted(speed="72 km/h", step="100 ms", length=1000, vehicles=40).plan()
    assert plan == PLAN
    assert wanted().plan().vehicles == PLAN.usual


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"vehicles": 0}, ["vehicles: 0", "whole number from 1"]),
        ({"vehicles": 2.5}, ["vehicles: 2.5", "whole number from 1"]),
        ({"vehicles": 1000}, ["vehicles: 1000 do not fit", "at most 93", "1000 m", "--lanes"]),
        ({"lanes": -1}, ["lanes: -1", "from 1 to 10"]),
        ({"length": "0 m"}, ["length: '0 m'", "above 0"]),
        ({"length": "5 m"}, ["length: '5 m'", "at least 11.2 m", "0.1 s"]),
        ({"length": "5 s"}, ["length", "unknown unit 's'"]),
        ({"speed": "-3 m/s"}, ["speed: '-3 m/s'", "from 1 to 50 m/s"]),
        ({"speed": float("nan")}, ["speed", "not finite"]),
        ({"duration": "0 s"}, ["duration: '0 s'", "above 0"]),
        ({"duration": "1 s", "step": "0.5 s"}, ["step: '0.5 s'", "a tenth of the duration, 0.1 s"]),
        ({"step": "0 s"}, ["step: '0 s'", "from 0.001 to 1 s"]),
        ({"step": "2.5 ms"}, ["step: '2.5 ms'", "whole milliseconds"]),
        ({"step": True}, ["step", "True"]),
        ({"seed": -1}, ["seed: -1"]),
        ({"kind": "roundabout"}, ["kind: 'roundabout'", "road, intersection"]),
        ({"kind": "intersection", "both_directions": True}, ["both_directions: always so"]),
        ({"kind": "intersection", "length": "20 m"}, ["length: '20 m'", "at least 22.4 m"]),
        (
            {"kind": "intersection", "vehicles": 1000},
            ["vehicles: 1000 do not fit", "at an intersection of roads of 1000 m", "--duration"],
        ),
        ({"out": Path("trace.csv")}, ["trace.csv", ".xml or .xml.gz"]),
        ({"out": Path(".xml")}, [".xml", "file name"]),
    ],
)
def test_what_no_road_can_have_is_refused(tmp_path, monkeypatch, changes, words):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError) as error:
        wanted(**changes).plan()
    for word in words:
        assert word in str(error.value)
    assert "\n" not in str(error.value)


def test_all_faults_are_reported_together(tmp_path):
    (tmp_path / "old.xml").touch()
    with pytest.raises(InputError) as error:
        wanted(tmp_path / "old.xml", vehicles=-1, lanes=0, speed="x", step="9 s", seed=-1).plan()
    assert str(error.value).startswith("6 errors in the input\n")
    for word in ("exists already", "vehicles: -1", "lanes: 0", "speed: 'x'", "step: '9 s'", "seed"):
        assert word in str(error.value)


# Simulator


def programs(folder, sumo, netconvert="exit 0"):
    """Return a simulator of two shell scripts."""
    (folder / "bin").mkdir()
    for name, script in (("sumo", sumo), ("netconvert", netconvert)):
        (folder / "bin" / name).write_text(f"#!/bin/sh\n{script}\n")
        (folder / "bin" / name).chmod(0o755)
    return Simulator(folder, "0.0")


def make(folder, sumo, netconvert="exit 0", vehicles=2, packed=False):
    plan = replace(PLAN, vehicles=vehicles)
    path = folder / "trace"
    return make_trace(plan, programs(folder, sumo, netconvert), path, packed, lambda *_: None)


PRINTED = """cat <<END
<?xml version="1.0" encoding="UTF-8"?>

<!-- generated on 2026-01-01T00:00:00 by Eclipse SUMO
<a-file value="/home/someone"/>
-->

<fcd-export>
    <timestep time="0.000">
        <vehicle id="a" x="-20.5" y="-1.6" type="car" speed="10.0" lane="r_0"/>
    </timestep>
    <timestep time="0.100">
        <vehicle id="a" x="-19.4" y="-1.6" type="car" speed="12.0" lane="r_0"/>
        <vehicle id="b" x="7.0" y="-1.6" type="car" speed="20.0" lane="r_0"/>
    </timestep>
</fcd-export>
END"""


@pytest.mark.parametrize("packed", [False, True])
def test_trace_is_counted_and_has_no_date_and_no_path(tmp_path, packed):
    tally = make(tmp_path, PRINTED, packed=packed)
    assert (tally.names, tally.steps, tally.samples, tally.most) == ({b"a", b"b"}, 2, 3, 2)
    assert (tally.low, tally.high, tally.slowest, tally.fastest) == (-20.5, 7.0, 10.0, 20.0)
    assert tally.speeds == 42.0
    written = (tmp_path / "trace").read_bytes()
    if packed:
        assert written[4:8] == bytes(4)  # the time in the header of gzip
        written = gzip.decompress(written)
    assert b"2026-01-01" not in written
    assert b"someone" not in written
    assert b"seed 0" in written
    ElementTree.fromstring(written)
    assert [each.x for each in read_samples(tmp_path / "trace")] == [-20.5, -19.4, 7.0]


def test_vehicles_that_found_no_gap_are_told(tmp_path):
    with pytest.raises(InputError, match=r"only 2 of 3 found a gap .* fewer --vehicles"):
        make(tmp_path, PRINTED, vehicles=3)


@pytest.mark.parametrize(
    ("sumo", "netconvert", "words"),
    [
        (
            "for i in 1 2 3 4 5 6 7; do echo line $i >&2; done; exit 3",
            "exit 0",
            ["SUMO's sumo failed (status 3)", "  line 3\n", "  line 7"],
        ),
        ("exit 0", "echo no such node >&2; exit 1", ["netconvert failed", "no such node"]),
        ("exit 0", "exit 0", ["output is cut off"]),
        ("echo '<fcd-export>'", "exit 0", ["output is cut off"]),
        ("kill -9 $$", "exit 0", ["SUMO's sumo failed (status -9)"]),
    ],
)
def test_failure_of_the_simulator_is_one_message(tmp_path, sumo, netconvert, words):
    with pytest.raises(RunError) as error:
        make(tmp_path, sumo, netconvert)
    for word in words:
        assert word in str(error.value)
    assert "line 2" not in str(error.value)


@pytest.mark.parametrize("script", ["exec sleep 60", "echo stuck >&2; exec 1>&-; exec sleep 60"])
def test_silence_of_the_simulator_has_an_end(tmp_path, monkeypatch, script):
    monkeypatch.setattr(simulator, "PATIENCE", 0.3)
    begun = time.monotonic()
    with pytest.raises(RunError, match=r"it did nothing for 0\.3 s"):
        make(tmp_path, script)
    assert time.monotonic() - begun < 20


def test_programs_that_are_not_there_are_told(tmp_path):
    with pytest.raises(RunError, match="netconvert cannot be started"):
        make_trace(PLAN, Simulator(tmp_path, "0"), tmp_path / "trace", False, lambda *_: None)


def test_without_sumo_the_extra_is_named(monkeypatch):
    monkeypatch.setattr(simulator, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r'pip install "echobeam\[sumo\]"'):
        find_simulator()
