"""Trace files as streams of samples."""

import gzip
import importlib.resources
import math
import tracemalloc

import pytest

from echobeam.traces.source import read_samples

FCD = """<?xml version="1.0" encoding="UTF-8"?>
<!-- a comment -->
<fcd-export>
    <timestep time="0.00"/>
    <timestep time="0.50">
        <vehicle id="a" x="1.0" y="-1.6" angle="90.00" type="car" speed="13.5" lane="e_0"/>
        <person id="p" x="9" y="9" speed="1"/>
        <vehicle id="b &amp; c" x="2" y="0"/>
    </timestep>
    <timestep time="1.00">
        <vehicle id="a" x="7.75" y="-1.6" speed="13.5"/>
    </timestep>
</fcd-export>
"""


def rows(path):
    return [tuple(sample)[:5] for sample in read_samples(path)]


def test_fcd_gives_vehicles_with_the_time_of_their_step_and_nothing_else(tmp_path):
    path = tmp_path / "trace.xml"
    path.write_text(FCD)
    first, second, third = rows(path)
    assert first == (0.5, "a", 1.0, -1.6, 13.5)
    assert second[:4] == (0.5, "b & c", 2.0, 0.0)
    assert math.isnan(second[4])
    assert third == (1.0, "a", 7.75, -1.6, 13.5)


def test_fcd_samples_know_their_lines(tmp_path):
    path = tmp_path / "trace.xml"
    path.write_text(FCD)
    lines = FCD.splitlines()
    for sample in read_samples(path):
        assert f'x="{sample.x:g}' in lines[sample.line - 1]


@pytest.mark.parametrize(
    "text",
    [
        "t,id,x,y,speed\n0,a,1,2,3\n1,a,4,2,3.5\n",
        "t,id,x,y,speed\r\n0,a,1,2,3\r\n1,a,4,2,3.5",
        '\ufeff"t","id","x","y","speed"\n0,"a",1,2,3\n\n1,"a",4,2,3.5\n\n',
        "lane,speed,y, x ,id,t,colour\ne_0,3,2,1,a,0,red\ne_0,3.5,2,4,a,1,red\n",
    ],
    ids=["plain", "windows", "quoted", "any order"],
)
def test_csv_in_every_dress_gives_the_same_samples(tmp_path, text):
    path = tmp_path / "trace.csv"
    path.write_bytes(text.encode())
    assert rows(path) == [(0.0, "a", 1.0, 2.0, 3.0), (1.0, "a", 4.0, 2.0, 3.5)]


def test_quoted_ids_may_hold_commas_and_quotes(tmp_path):
    path = tmp_path / "trace.csv"
    path.write_text('t,id,x,y\n0,"a,""b""",1,2\n')
    assert rows(path)[0][1] == 'a,"b"'


@pytest.mark.parametrize("header", ["t,id,x,y", "t,id,x,y,speed"])
def test_speed_may_be_missing_as_a_column_or_in_a_row(tmp_path, header):
    path = tmp_path / "trace.csv"
    path.write_text(f"{header}\n0,a,1,2{',' * (header.count(',') - 3)}\n")
    assert math.isnan(rows(path)[0][4])


@pytest.mark.parametrize("name", ["trace.xml.gz", "trace.csv", "trace"])
def test_packing_and_format_are_told_by_content_not_by_suffix(tmp_path, name):
    plain, packed = tmp_path / "plain", tmp_path / name
    plain.write_text(FCD)
    packed.write_bytes(gzip.compress(FCD.encode()))
    assert str(rows(packed)) == str(rows(plain))


def test_vehicles_may_come_one_after_the_other_in_csv(tmp_path):
    path = tmp_path / "trace.csv"
    path.write_text("t,id,x,y\n0,a,0,0\n1,a,1,0\n0,b,5,0\n1,b,6,0\n")
    assert [row[:2] for row in rows(path)] == [(0, "a"), (1, "a"), (0, "b"), (1, "b")]


def test_shipped_trace_reads_as_in_sumos_own_parser():
    parse = pytest.importorskip("sumolib").xml.parse
    shipped = importlib.resources.files("echobeam.scenario") / "presets/traffic-trace.xml.gz"
    theirs = [
        (float(step.time), each.id, float(each.x), float(each.y), float(each.speed))
        for step in parse(str(shipped), "timestep")
        for each in step.vehicle or []
    ]
    assert len(theirs) > 1000
    assert rows(shipped) == theirs


def _write_fcd(path, steps):
    with path.open("w") as file:
        file.write("<fcd-export>\n")
        for step in range(steps):
            file.write(f'<timestep time="{step / 2}">\n')
            for each in range(20):
                file.write(f'<vehicle id="v{each}" x="{step}" y="{each}" speed="2.00"/>\n')
            file.write("</timestep>\n")
        file.write("</fcd-export>\n")


def _write_csv(path, steps):
    with path.open("w") as file:
        file.write("t,id,x,y,speed\n")
        for step in range(steps):
            for each in range(20):
                file.write(f"{step / 2},v{each},{step},{each},2.00\n")


@pytest.mark.slow
@pytest.mark.parametrize("write", [_write_fcd, _write_csv])
def test_memory_of_reading_does_not_grow_with_the_file(tmp_path, write):
    path = tmp_path / "trace"
    peaks = []
    for steps in (500, 5000):
        write(path, steps)
        tracemalloc.start()
        assert sum(1 for _ in read_samples(path)) == 20 * steps
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert path.stat().st_size > 2_000_000
    assert peaks[1] < 1.2 * peaks[0]
    assert peaks[1] < 1_500_000
