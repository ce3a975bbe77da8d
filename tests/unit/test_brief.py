"""Texts of values: short whatever they hold, and harmless in a notebook."""

import re
from dataclasses import fields, is_dataclass

import numpy as np
import pytest

import echobeam as eb
from echobeam.brief import WIDTH, Brief, html_table, shortened
from echobeam.schemes.configure import system_of


def many(*shape):
    return np.zeros((200, 3, *shape))


SCENARIO = eb.load_scenario("paper-multi")
TRACKS = eb.Tracks(many(3), many(3, 3), many().astype(np.int8), many().astype(int))
UAV = eb.UavState(np.zeros(3), np.ones(3))
SENT = eb.Transmission(many(30) + 0j, many(30), np.zeros((200, 30)))
VALUES = [
    SCENARIO,
    TRACKS,
    UAV,
    SENT,
    eb.GaussianState(many(3), many(3, 3), many() > 0),
    eb.Detections(many(3), np.full((200, 3, 3), np.inf), many() > 0, many().astype(int)),
    eb.Decision(SENT, many().astype(int), many() > 0, np.zeros(200, np.int8), many(), many() > 0),
    eb.View(2, UAV, UAV, system_of(SCENARIO), many().astype(int), None, np.zeros, SENT, TRACKS),
    eb.BeamProblem([1.0] * 9, [9.0] * 9, [0.0] * 9, 3, 0, 1, 1, 64, warm_start=np.ones((9, 64))),
]


@pytest.mark.parametrize("value", VALUES, ids=lambda value: type(value).__name__)
def test_a_text_has_one_to_six_lines_and_names_its_class(value):
    lines = repr(value).splitlines()
    assert 1 <= len(lines) <= 6
    assert type(value).__name__ in lines[0]
    if not isinstance(value, eb.Scenario):
        assert max(map(len, lines)) <= WIDTH + 40  # one long item may stand alone


def test_shapes_ranges_and_small_arrays_are_shown():
    text = repr(TRACKS)
    assert "mean=<(200, 3, 3) float64 0 to 0>" in text
    assert shortened(np.array([1.23456, np.nan])) == "[1.235, nan]"
    assert shortened(np.full((5, 5), np.nan)) == "<(5, 5) float64 none finite>"
    assert shortened(np.array([np.nan, *range(9)])) == "<(10,) float64 0 to 8, others not finite>"
    assert shortened(np.float64(0.1234567)) == "0.123457"
    assert shortened(eb.Mode.PILOT) == "PILOT"
    assert len(shortened("x" * 1000)) < 60


def test_an_answer_is_short_and_showing_it_proves_nothing():
    problem = eb.BeamProblem([1.3, 2.3], [100, 140], [0.05, 0.05], 3, 0, 1, 1, 64)
    answer = eb.design_beams(problem)
    assert "upper_bound=Proof(not asked for yet)" in repr(answer)
    assert not answer.proof.known
    assert len(repr(answer).splitlines()) <= 6
    assert f"objective={answer.objective:.6g}" in repr(answer)
    assert answer.upper_bound >= answer.objective
    assert f"upper_bound={answer.upper_bound:.6g}" in repr(answer)
    assert "<table>" in answer._repr_html_()


def test_tables_of_a_notebook_are_escaped():
    wicked = SCENARIO.model_copy(update={"description": "<script>alert(1)</script>"})
    assert "<script>" not in wicked._repr_html_()
    assert "&lt;script&gt;" in wicked._repr_html_()
    assert html_table("a < b", {"x & y": "<i>"}).count("<i>") == 0
    (record, *_) = eb.slots("paper-single", scheme="omni")
    assert "directional" in repr(record) or "omni" in repr(record)
    assert record._repr_html_().startswith("<table>")
    assert len(record._repr_html_()) < 3000


def test_every_public_value_with_arrays_is_brief():
    found = [getattr(eb, name) for name in eb.__all__]
    values = [each for each in found if isinstance(each, type) and is_dataclass(each)]
    held = re.compile(r"(Complex|Bool|Int|Mode)?Array( \| None)?")
    arrays = [c for c in values if any(held.fullmatch(str(f.type)) for f in fields(c))]
    assert len(arrays) >= 10
    for each in arrays:
        assert issubclass(each, Brief) or each is eb.SlotRecord, each
