"""Picture files: whole or not at all, readable, and the same bytes for the same picture."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree

import matplotlib as mpl
import pytest
from PIL import Image

from echobeam.faults import InputError
from echobeam.plots import rate, save
from echobeam.plots.saving import picture_format

from .plot_dataset import build_result


@pytest.fixture(scope="module")
def result():
    return build_result(trials=3)


def test_a_png_is_a_picture_for_a_column_at_300_dots_per_inch(result, tmp_path):
    path = save(rate.draw(result), tmp_path / "a.png")
    with Image.open(path) as image:
        image.load()
        assert image.size[0] == 1050
        assert image.info["dpi"] == pytest.approx((300, 300), abs=0.1)


@pytest.mark.slow
def test_a_pdf_is_a_pdf_with_real_fonts(result, tmp_path):
    data = save(rate.draw(result), tmp_path / "a.pdf").read_bytes()
    assert data.startswith(b"%PDF-")
    assert data.rstrip().endswith(b"%%EOF")
    assert b"/Type3" not in data, "journals refuse Type 3 fonts"


def test_an_svg_is_xml(result, tmp_path):
    root = ElementTree.parse(save(rate.draw(result), tmp_path / "a.SVG")).getroot()
    assert root.tag == "{http://www.w3.org/2000/svg}svg"


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["png", "pdf", "svg"])
def test_the_same_picture_is_the_same_file(result, tmp_path, suffix):
    one = save(rate.draw(result), tmp_path / f"one.{suffix}").read_bytes()
    with mpl.rc_context({"font.size": 20.0, "savefig.dpi": 50.0, "svg.hashsalt": "other"}):
        two = save(rate.draw(result), tmp_path / f"two.{suffix}").read_bytes()
    assert one == two


def test_a_failure_leaves_the_old_picture_and_nothing_else(result, tmp_path, monkeypatch):
    path = tmp_path / "a.png"
    path.write_bytes(b"old")
    figure = rate.draw(result)

    def fail(partial, **_):
        partial.write_bytes(b"half")
        raise OSError("disk full")

    monkeypatch.setattr(figure, "savefig", fail)
    with pytest.raises(OSError, match="disk full"):
        save(figure, path)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_picture_replaces_an_older_one(result, tmp_path):
    path = tmp_path / "a.png"
    path.write_bytes(b"old")
    save(rate.draw(result), path)
    assert path.read_bytes().startswith(b"\x89PNG")
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("name", ["a.jpg", "a", "a.nc", "a.png.txt"])
def test_other_suffixes_are_refused_with_what_is_accepted(result, tmp_path, name):
    with pytest.raises(InputError, match=r"accepted: \.png, \.pdf, \.svg"):
        save(rate.draw(result), tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_suffixes_come_with_and_without_a_dot_in_any_case():
    assert [picture_format(s) for s in (".png", "PDF", ".Svg")] == ["png", "pdf", "svg"]
