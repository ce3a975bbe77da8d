"""Damaged and nonsensical traces: one clear message each, that names file and place."""

import gzip
import os
import zlib

import numpy as np
import pytest

from echobeam.traces import TraceError, load_motion

XML = """<fcd-export>
<timestep time="0"><vehicle id="a" x="0" y="0" speed="10"/></timestep>
<timestep time="1"><vehicle id="a" x="10" y="0" speed="10"/></timestep>
<timestep time="2"><vehicle id="a" x="20" y="0" speed="10"/></timestep>
</fcd-export>
"""
CSV = "t,id,x,y,speed\n0,a,0,0,10\n1,a,10,0,10\n2,a,20,0,10\n"
BOMB = """<?xml version="1.0"?>
<!DOCTYPE bomb [
<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;&a;&a;&a;&a;&a;&a;">
<!ENTITY c "&b;&b;&b;&b;&b;&b;&b;&b;&b;&b;">
]>
""" + XML.replace('id="a"', 'id="&c;"')


def message(path):
    with pytest.raises(TraceError) as caught:
        load_motion(path, [0.0, 1.0], uav_x=0.0, max_objects=2, range_m=50.0)
    text = str(caught.value)
    assert text.startswith(str(path))
    assert "\n" not in text
    return text.removeprefix(str(path))


def message_of(tmp_path, content, name="trace"):
    path = tmp_path / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return message(path)


@pytest.mark.parametrize("content", [XML, CSV])
def test_the_examples_are_sound_before_they_are_damaged(tmp_path, content):
    path = tmp_path / "trace"
    path.write_text(content)
    motion = load_motion(path, [0.0, 1.0], uav_x=0.0, max_objects=2, range_m=50.0)
    np.testing.assert_allclose(motion.position[:, 0], [-10.0, 0.0])


def test_missing_file(tmp_path):
    assert "No such file" in message(tmp_path / "nowhere.xml")


def test_directory(tmp_path):
    assert "directory" in message(tmp_path)


def test_pipe_is_refused_instead_of_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe")
    assert "a file that can be read twice" in message(tmp_path / "pipe")


@pytest.mark.parametrize("content", [b"", gzip.compress(b"", mtime=0)])
def test_empty_file(tmp_path, content):
    text = message_of(tmp_path, content)
    assert "empty" in text
    assert "SUMO FCD XML" in text


@pytest.mark.parametrize(
    "content",
    ["<fcd-export/>", "t,id,x,y\n", '<fcd-export><timestep time="0"/></fcd-export>'],
)
def test_trace_without_vehicles(tmp_path, content):
    assert "no vehicle; accepted is" in message_of(tmp_path, content)


@pytest.mark.parametrize(
    "content",
    [
        "t,id,x,y\n0,a,1,1\n",
        "t,id,x,y\n0,a,1,1\n1,b,1,1\n",
        '<fcd-export><timestep time="0"><vehicle id="a" x="0" y="0"/></timestep></fcd-export>',
    ],
)
def test_trace_with_single_points_only(tmp_path, content):
    text = message_of(tmp_path, content)
    assert "one sample of each" in text
    assert "at least two samples" in text


@pytest.mark.parametrize("cut", [30, 80, 100, 150, len(XML) - 5])
def test_cut_off_xml(tmp_path, cut):
    text = message_of(tmp_path, XML[:cut])
    assert text.startswith(", line ")
    assert "cut off before </fcd-export>" in text


def test_damaged_xml(tmp_path):
    assert ", line 3: damaged XML" in message_of(tmp_path, XML.replace('"10" y', '"10 y', 1))


def test_text_after_the_end_of_xml(tmp_path):
    assert "damaged XML" in message_of(tmp_path, XML + XML)


@pytest.mark.parametrize("content", [XML, CSV])
def test_cut_off_gzip_is_found_wherever_it_is_cut(tmp_path, content):
    packed = gzip.compress(content.encode(), mtime=0)
    for cut in range(11, len(packed)):
        assert "gzip data" in message_of(tmp_path, packed[:cut])


def _varied(rows):
    return CSV + "".join(f"{t / 7:.9f},b,{t / 3:.9f},0,10\n" for t in range(rows))


@pytest.mark.parametrize("share", [0.3, 0.5, 0.999])
@pytest.mark.slow
def test_cut_off_gzip_says_how_far_it_came(tmp_path, share):
    packed = gzip.compress(_varied(20_000).encode())
    cut = packed[: int(share * len(packed))]
    text = message_of(tmp_path, cut)
    line = int(text.rsplit(" ", 1)[1])
    assert line == zlib.decompressobj(31).decompress(cut).count(b"\n")
    assert 1000 < line < 20_004


def test_gzip_cut_near_its_end_says_so(tmp_path):
    packed = gzip.compress(CSV.encode(), mtime=0)
    assert "cut off after line 4" in message_of(tmp_path, packed[:-5])


def test_damaged_gzip(tmp_path):
    packed = bytearray(gzip.compress(CSV.encode(), mtime=0))
    packed[-6] ^= 0xFF
    assert "damaged gzip data" in message_of(tmp_path, bytes(packed))


def test_cut_off_last_row(tmp_path):
    assert ", line 4: 3 fields (cut off?); accepted are 5" in message_of(tmp_path, CSV[:-8])


@pytest.mark.parametrize(
    ("content", "place"),
    [
        (CSV.replace("1,a,10,0,10", "{},a,10,0,10"), ", line 3: t = "),
        (CSV.replace("1,a,10,0,10", "1,a,{},0,10"), ", line 3: x = "),
        (CSV.replace("1,a,10,0,10", "1,a,10,{},10"), ", line 3: y = "),
        (CSV.replace("1,a,10,0,10", "1,a,10,0,{}"), ", line 3: speed = "),
        (XML.replace('time="1"', 'time="{}"'), ", line 3: time = "),
        (XML.replace('x="10"', 'x="{}"'), ", line 3: x = "),
        (XML.replace('y="0" speed="10"', 'y="{}"'), ", line 2: y = "),
        (XML.replace('speed="10"', 'speed="{}"'), ", line 2: speed = "),
    ],
)
@pytest.mark.parametrize(
    "value", ["fast", "nan", "inf", "-Infinity", "1e999", "1e300", "1_0", "0x1F", "1,5"]
)
def test_values_that_are_no_finite_numbers(tmp_path, content, place, value):
    quoted = f'"{value}"' if content.startswith("t,") and "," in value else value
    text = message_of(tmp_path, content.replace("{}", quoted))
    assert text.startswith(f"{place}'{value}'; accepted is a finite number")


@pytest.mark.parametrize("column", ["t", "x", "y"])
def test_empty_values(tmp_path, column):
    row = ",".join("" if name == column else "1" for name in ("t", "id", "x", "y"))
    content = f"t,id,x,y\n{row}\n"
    assert f", line 2: {column} = ''" in message_of(tmp_path, content)


@pytest.mark.parametrize("content", [CSV.replace("1,a", "1,"), XML.replace('id="a"', 'id=""')])
def test_empty_id(tmp_path, content):
    assert "non-empty id" in message_of(tmp_path, content)


def test_time_steps_going_backwards(tmp_path):
    text = message_of(tmp_path, XML.replace('time="2"', 'time="0.5"'))
    assert text.startswith(", line 4: timestep 0.5 goes back in time, after 1;")


def test_time_of_a_vehicle_going_backwards(tmp_path):
    text = message_of(tmp_path, CSV.replace("2,a", "0.5,a"))
    assert text.startswith(", line 4: t = 0.5 of vehicle 'a' goes back in time, after 1.0;")


@pytest.mark.parametrize(
    ("content", "place"),
    [
        (CSV.replace("2,a", "1.0,a"), ", line 4: second sample of vehicle 'a' at t = 1.0"),
        (XML.replace('time="2"', 'time="1"'), ", line 4: second sample of vehicle 'a' at t = 1.0"),
        (CSV.replace("2,a", "1.0000001,a"), ", line 4: second sample of vehicle 'a' at t = 1.0"),
    ],
)
def test_two_samples_of_a_vehicle_at_one_time(tmp_path, content, place):
    text = message_of(tmp_path, content)
    assert text.startswith(place)
    assert "accepted is one per vehicle and time" in text


@pytest.mark.parametrize("column", ["t", "id", "x", "y"])
def test_missing_columns(tmp_path, column):
    text = message_of(tmp_path, CSV.replace(column, "other", 1))
    assert text.startswith(f", line 1: no column {column} in the header")
    assert "accepted is a header with t, id, x, y" in text


def test_doubled_column(tmp_path):
    assert "column x more than once" in message_of(tmp_path, "t,id,x,x,y\n")


@pytest.mark.parametrize("attribute", ["id", "x", "y"])
def test_missing_attributes(tmp_path, attribute):
    text = message_of(tmp_path, XML.replace(f' {attribute}="', f' no{attribute}="'))
    assert text.startswith(f", line 2: <vehicle> without {attribute}; accepted is")


def test_time_step_without_time(tmp_path):
    text = message_of(tmp_path, XML.replace("time=", "at="))
    assert text.startswith(", line 2: <timestep> without time")


def test_vehicle_outside_a_time_step(tmp_path):
    text = message_of(tmp_path, '<fcd-export><vehicle id="a" x="0" y="0"/></fcd-export>')
    assert "<vehicle> outside a <timestep>" in text


@pytest.mark.parametrize("content", ["<routes/>", "<vehicle/>", "<timestep/>", "<html></html>"])
def test_other_xml(tmp_path, content):
    assert "is not a SUMO FCD export; accepted is <fcd-export>" in message_of(tmp_path, content)


@pytest.mark.parametrize(
    "content",
    ["hello\n", "a,b,c\n1,2,3\n", "{}", b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", b"\0" * 100, "\n\n"],
)
@pytest.mark.parametrize("name", ["trace.xml", "trace.csv", "trace"])
def test_unknown_formats(tmp_path, content, name):
    text = message_of(tmp_path, content, name)
    assert "unknown format, begins with" in text
    assert "accepted are SUMO FCD XML and CSV with the header t,id,x,y" in text


@pytest.mark.parametrize("content", [XML, CSV], ids=["xml", "csv"])
@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-le", "utf-16-be"])
def test_text_of_two_bytes_a_letter_is_named(tmp_path, content, encoding):
    assert "not UTF-8 text (UTF-16?)" in message_of(tmp_path, content.encode(encoding))
    assert "holds zero bytes" in message_of(tmp_path, CSV[:20] + "\0" + CSV[20:])


def test_an_encoding_that_nobody_knows(tmp_path):
    content = '<?xml version="1.0" encoding="klingon"?>\n' + XML
    assert ", line 1: unknown encoding: klingon; accepted is UTF-8" in message_of(tmp_path, content)


@pytest.mark.parametrize("document", [BOMB, '<!DOCTYPE f SYSTEM "file:///etc/passwd">' + XML])
def test_document_types_are_refused_before_any_entity_expands(tmp_path, document):
    assert "document type" in message_of(tmp_path, document)


def test_entities_without_a_document_type_are_damage(tmp_path):
    assert "damaged XML" in message_of(tmp_path, XML.replace('"a"', '"&b;"'))


def test_quotes_that_do_not_close(tmp_path):
    assert "damaged row" in message_of(tmp_path, CSV.replace("1,a", '1,"a'))


@pytest.mark.parametrize("line", [1, 2, 42, 3000])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_text_that_is_not_utf_8_has_its_line(tmp_path, line, end):
    rows = ["t,id,x,y", *(f"{t},a,{20 * t},0" for t in range(4000))]
    rows[line - 1] = rows[line - 1].replace("a", "M\xfcller").replace("id", "id,\xfc")
    text = message_of(tmp_path, end.join(rows).encode("latin-1"))
    assert text.startswith(f", line {line}: not readable as text (byte 0xfc); accepted is UTF-8")


def test_a_line_without_end_is_refused(tmp_path):
    assert "a line of more than" in message_of(tmp_path, CSV + "9" * 3_000_000)


def test_damage_outside_the_slots_is_found_too(tmp_path):
    rows = "".join(f"{t},a,{t},0,1\n" for t in range(3, 300))
    assert ", line 302: x = 'end'" in message_of(tmp_path, CSV + rows + "300,a,end,0,1\n")
