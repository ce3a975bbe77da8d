"""Picture files: whole or not at all, readable, and the same bytes for the same picture."""

from __future__ import annotations

import json
import xml.etree.ElementTree as ElementTree

import matplotlib as mpl
import numpy as np
import pandas
import pytest
from PIL import Image

from echobeam.faults import InputError
from echobeam.plots.drawing import Picture, draw
from echobeam.plots.saving import file_format, picture_formats, write

from .plot_dataset import build_result
from .plot_figures import figure_of


@pytest.fixture(scope="module")
def result():
    return build_result(trials=3)


def test_a_png_is_a_picture_for_a_column_at_300_dots_per_inch(result, tmp_path):
    path = write(figure_of("rate", result), tmp_path / "a.png")
    with Image.open(path) as image:
        image.load()
        assert image.size[0] == 1050
        assert image.info["dpi"] == pytest.approx((300, 300), abs=0.1)


@pytest.mark.slow
def test_a_pdf_is_a_pdf_with_real_fonts(result, tmp_path):
    data = write(figure_of("rate", result), tmp_path / "a.pdf").read_bytes()
    assert data.startswith(b"%PDF-")
    assert data.rstrip().endswith(b"%%EOF")
    assert b"/Type3" not in data, "journals refuse Type 3 fonts"


def test_an_svg_is_xml(result, tmp_path):
    root = ElementTree.parse(write(figure_of("rate", result), tmp_path / "a.SVG")).getroot()
    assert root.tag == "{http://www.w3.org/2000/svg}svg"


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["png", "pdf", "svg"])
def test_the_same_picture_is_the_same_file(result, tmp_path, suffix):
    one = write(figure_of("rate", result), tmp_path / f"one.{suffix}").read_bytes()
    with mpl.rc_context({"font.size": 20.0, "savefig.dpi": 50.0, "svg.hashsalt": "other"}):
        two = write(figure_of("rate", result), tmp_path / f"two.{suffix}").read_bytes()
    assert one == two


def test_a_failure_leaves_the_old_picture_and_nothing_else(result, tmp_path, monkeypatch):
    path = tmp_path / "a.png"
    path.write_bytes(b"old")

    def fail(figure, partial, **_):
        partial.write_bytes(b"half")
        raise OSError("disk full")

    monkeypatch.setattr(Picture, "savefig", fail)
    with pytest.raises(OSError, match="disk full"):
        write(figure_of("rate", result), path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_picture_replaces_an_older_one(result, tmp_path):
    path = tmp_path / "a.png"
    path.write_bytes(b"old")
    write(figure_of("rate", result), path)
    assert path.read_bytes().startswith(b"\x89PNG")
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", ["a.jpg", "a", "a.nc", "a.png.txt"])
def test_other_suffixes_are_refused_with_what_is_accepted(result, tmp_path, name):
    with pytest.raises(InputError, match=r"accepted: \.png, \.pdf, \.svg, \.csv, \.json"):
        write(figure_of("rate", result), tmp_path / name)
    with pytest.raises(InputError, match="accepted: png, pdf, svg"):
        picture_formats(["png", "csv"])
    assert not list(tmp_path.iterdir())


def test_suffixes_come_with_and_without_a_dot_in_any_case():
    assert [file_format(s) for s in (".png", "PDF", ".Csv")] == ["png", "pdf", "csv"]


def test_a_picture_for_a_paper_has_no_captions_inside(result):
    data = figure_of("rate", result)
    assert draw(data).get_suptitle() == f"{data.title}\n{data.setting}"
    assert draw(data, captions=False).get_suptitle() == ""


def test_the_numbers_are_a_tidy_table_and_a_document(result, tmp_path):
    """Read back by pandas and by json: the series of the record, nothing rounded away."""
    data = figure_of("rate", result)
    table = pandas.read_csv(write(data, tmp_path / "a.csv"))
    document = json.loads(write(data, tmp_path / "a.json").read_text(encoding="utf-8"))
    assert list(table.columns) == [
        "panel", "series", "x quantity", "x", "y quantity", "y", "low", "high"
    ]  # fmt: skip
    assert set(table["y quantity"]) == {"Sum rate (bit/s/Hz)"}
    for number, one in enumerate(data.panels[0].series):
        rows = table[table["series"] == one.name]
        np.testing.assert_allclose(rows["x"], one.x)
        np.testing.assert_allclose(rows["y"], one.y, rtol=1e-8)
        np.testing.assert_allclose(rows[["low", "high"]], one.band, rtol=1e-8)
        (written,) = [document["panels"][0]["series"][number]]
        assert written["name"] == one.name
        np.testing.assert_allclose(np.array(written["y"], dtype=float), one.y, rtol=1e-15)
    assert document["setting"] == data.setting
    assert document["panels"][0]["y"] == {"name": "Sum rate", "unit": "bit/s/Hz"}


def test_a_missing_number_is_an_empty_cell_and_null(result, tmp_path):
    gap = result.copy(deep=True)
    gap["estimated"].loc[{"slot": 3, "scheme": "temporal"}] = np.nan
    data = figure_of("tracking", gap)
    table = pandas.read_csv(write(data, tmp_path / "a.csv"))
    angle = table[(table["series"] == "temporal") & (table["y quantity"] == "Angle RMSE (deg)")]
    assert angle["y"].isna().tolist() == [slot == 3 for slot in range(1, 11)]
    series = json.loads(data.json())["panels"][0]["series"]
    (temporal,) = [one for one in series if one["name"] == "temporal"]
    assert temporal["y"][2] is None
