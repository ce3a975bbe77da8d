"""Tables of samples: SUMO's own, and other separators."""

import pytest

from echobeam.traces.source import read_samples

from ..drives import as_csv, as_sumo_csv, as_xml, drive

# As SUMO 1.28 writes it (--fcd-output trace.csv), with a person in the vehicles' columns.
SUMO = """\
timestep_time;vehicle_id;vehicle_x;vehicle_y;vehicle_angle;vehicle_type;vehicle_speed;\
vehicle_pos;vehicle_lane;vehicle_edge;vehicle_slope
0.00;;;;;;;;;;
1.00;a;5.34;-0.06;73.30;car;0.00;5.10;r_2;;0.00
2.00;a;7.84;0.68;73.30;car;2.60;7.70;r_2;;0.00
2.00;p;2.30;-7.66;73.30;DEFAULT_PEDTYPE;0.00;0.00;;r;0.00
3.00;a;12.82;2.18;73.30;car;5.20;12.90;r_2;;0.00
3.00;p;3.33;-7.36;73.30;DEFAULT_PEDTYPE;1.07;1.07;;r;0.00
"""
EXPECTED = [
    (1.0, "a", 5.34, -0.06, 0.0),
    (2.0, "a", 7.84, 0.68, 2.6),
    (3.0, "a", 12.82, 2.18, 5.2),
]


def rows(folder, text):
    path = folder / "trace.csv"
    path.write_text(text)
    return [tuple(sample)[:5] for sample in read_samples(path)]


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text,
        lambda text: text.replace("timestep_", "").replace("vehicle_", ""),
        lambda text: text.replace(";", ","),
        lambda text: text.replace(";", "\t"),
        lambda text: text.replace("\n", "\r\n"),
        lambda text: text.replace("\n", "\r"),
        lambda text: "\ufeff" + text,
        lambda text: "\n\n" + text,
    ],
    ids=["full", "plain", "comma", "tab", "windows", "old mac", "bom", "empty lines"],
)
def test_sumos_own_table_gives_its_vehicles(tmp_path, change):
    path = tmp_path / "trace.csv"
    path.write_bytes(change(SUMO).encode())
    assert [tuple(sample)[:5] for sample in read_samples(path)] == EXPECTED


def test_lines_are_those_of_the_file(tmp_path):
    path = tmp_path / "trace.csv"
    path.write_text("\n" + SUMO)
    assert [sample.line for sample in read_samples(path)] == [4, 5, 7]


def test_sumos_table_and_its_xml_give_the_same(tmp_path):
    drives = [*drive("a", 20.0), *drive("b", 15.0, y=3.2)]
    tables = {write.__name__: rows(tmp_path, write(drives)) for write in (as_sumo_csv, as_xml)}
    assert tables["as_sumo_csv"] == tables["as_xml"]
    assert sorted(tables["as_xml"]) == sorted(rows(tmp_path, as_csv(drives)))


def test_lane_and_edge_of_other_tables_say_nothing_of_persons(tmp_path):
    text = "t,id,x,y,lane,edge\n0,a,1,2,,e\n1,a,3,2,,e\n"
    assert len(rows(tmp_path, text)) == 2
