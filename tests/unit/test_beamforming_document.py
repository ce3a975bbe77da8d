from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from echobeam.beamforming.answer import BeamAnswer
from echobeam.beamforming.certify.certificate import Violation
from echobeam.beamforming.certify.proof import Proof
from echobeam.beamforming.design import design_beams
from echobeam.beamforming.problem import ProblemError
from echobeam.cli.problem_document import answer_document, read_problem
from echobeam.physics.planar import PlanarArray

GOOD: dict[str, Any] = {
    "angles_deg": [75, 135],
    "distances": [103.5, 141.4],
    "coverage_halfwidths_deg": [3, 1.5],
    "ripple": 3,
    "min_rate": [4e-4, 1e-4],
    "power": 1,
    "noise": 2.0,
    "n_tx": 8,
}


def _faults(**changes: Any) -> list[str]:
    document = {key: value for key, value in {**GOOD, **changes}.items() if value != "LEFT OUT"}
    with pytest.raises(ProblemError) as caught:
        read_problem(json.dumps(document), "mine.json")
    lines = str(caught.value).splitlines()
    assert all(line.startswith("mine.json: ") for line in lines)
    return [line.removeprefix("mine.json: ") for line in lines]


def test_a_document_becomes_the_problem_in_radians() -> None:
    extras = {
        "alpha0": 2.0,
        "spacing": 0.4,
        "axis": "horizontal",
        "resolution_deg": 0.2,
        "warm_start_re": [[1.0] * 8, [2] * 8],
        "warm_start_im": [[0.0] * 8, [-1] * 8],
    }
    problem = read_problem(json.dumps({**GOOD, **extras}))
    np.testing.assert_allclose(problem.angles, np.radians([75, 135]), rtol=1e-15)
    np.testing.assert_allclose(problem.coverage_halfwidths, np.radians([3, 1.5]), rtol=1e-15)
    assert problem.ripple.tolist() == [3, 3]
    assert problem.min_rate.tolist() == [4e-4, 1e-4]
    assert (problem.power, problem.noise, problem.n_tx, problem.alpha0) == (1.0, 2.0, 8, 2.0)
    assert (problem.array.spacing, problem.array.axis) == (0.4, "horizontal")
    assert problem.resolution == pytest.approx(np.radians(0.2), rel=1e-15)
    assert problem.warm_start is not None
    assert problem.warm_start[1, 3] == 2 - 1j


def test_what_is_left_out_or_null_has_its_default() -> None:
    plain = read_problem(json.dumps(GOOD))
    null = read_problem(json.dumps({**GOOD, "alpha0": None, "warm_start_re": None}))
    for problem in (plain, null):
        assert (problem.alpha0, problem.array.spacing, problem.array.axis) == (1.0, 0.5, "vertical")
        assert problem.warm_start is None
        assert problem.resolution == pytest.approx(np.radians(0.1), rel=1e-15)


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("power", -1, ["-1", "positive"]),
        ("power", 0, ["0", "positive"]),
        ("power", True, ["true", "positive"]),
        ("power", float("nan"), ["NaN", "positive"]),
        ("power", "1 W", ["1 W", "positive"]),
        ("n_tx", 2.5, ["2.5", "whole"]),
        ("n_tx", 0, ["0", "whole"]),
        ("angles_deg", "75", ["75", "list"]),
        ("angles_deg", [75, None], ["null", "list"]),
        ("distances", [100, 0], ["[100, 0]", "positive"]),
        ("distances", [100], ["[100]", "1 values", "expected 2"]),
        ("coverage_halfwidths_deg", [3, 91], ["91", "90"]),
        ("coverage_halfwidths_deg", "wide", ["wide", "list"]),
        ("ripple", -0.1, ["-0.1", "at least 0"]),
        ("min_rate", [1, 2, 3], ["3 values", "expected 2"]),
        ("axis", "up", ["up", "vertical", "horizontal"]),
        ("resolution_deg", 0, ["0", "positive"]),
        ("noise", "LEFT OUT", ["missing", "positive"]),
        ("nois", 1, ["no such key", "noise"]),
    ],
)
def test_each_fault_names_file_key_value_and_what_is_accepted(
    key: str, value: Any, said: list[str]
) -> None:
    faults = _faults(**{key: value})
    assert len(faults) == 1
    assert faults[0].startswith(f"{key}: ")
    assert all(word in faults[0] for word in said)


def test_all_faults_are_told_at_once() -> None:
    faults = _faults(power=-1, noise="LEFT OUT", colour="red", distances=[1], n_tx=0.5)
    assert {fault.split(":")[0] for fault in faults} == {
        "power",
        "noise",
        "colour",
        "distances",
        "n_tx",
    }


def test_half_a_warm_start_and_one_of_a_wrong_size_are_refused() -> None:
    assert "warm_start_im" in _faults(warm_start_re=[[1.0] * 8] * 2)[0]
    short = _faults(warm_start_re=[[1.0] * 8] * 2, warm_start_im=[[1.0] * 7] * 2)
    assert "2 lists of 8 numbers" in short[0]


@pytest.mark.parametrize(
    "text", ["", "{", "[1, 2]", "null", '"x"', "[" * 100_000, "{'a': 1}", "1" * 5000]
)
def test_text_that_is_no_json_object_is_refused_by_name(text: str) -> None:
    with pytest.raises(ProblemError, match=r"mine\.json: "):
        read_problem(text, "mine.json")


def test_a_key_given_twice_is_refused() -> None:
    with pytest.raises(ProblemError, match="n_tx: given twice"):
        read_problem('{"n_tx": 3, "n_tx": 4}', "mine.json")


def test_the_answer_is_strict_json_with_the_promised_keys() -> None:
    document = answer_document(design_beams(read_problem(json.dumps({**GOOD, "min_rate": 0}))))
    text = json.dumps(document, allow_nan=False)
    assert json.loads(text) == document
    assert list(document) == [
        "beams_re", "beams_im", "rates", "objective", "upper_bound", "gap", "status", "outcome",
        "message", "max_violation", "seconds", "iterations",
    ]  # fmt: skip
    assert list(document["max_violation"]) == ["power", "rate", "coverage"]
    assert np.array(document["beams_re"]).shape == np.array(document["beams_im"]).shape == (2, 8)
    assert document["status"] == "optimal"
    assert document["upper_bound"] >= document["objective"]


def test_what_json_has_no_number_for_is_null() -> None:
    answer = BeamAnswer(
        beams=np.full((1, 2), np.nan + 0j),
        objective=0.0,
        proof=Proof(np.inf),
        outcome="violated",
        message="nothing",
        rates=np.array([np.nan]),
        max_violation=Violation(np.inf, 0.0, np.inf),
        seconds=0.1,
        iterations=3,
    )
    document = answer_document(answer)
    json.dumps(document, allow_nan=False)
    assert document["upper_bound"] is None
    assert document["gap"] is None
    assert document["rates"] == [None]
    assert document["beams_re"] == [[None, None]]
    assert document["max_violation"] == {"power": None, "rate": 0.0, "coverage": None}


def test_no_objects_are_a_problem_with_an_answer() -> None:
    empty = {
        **GOOD,
        "angles_deg": [],
        "distances": [],
        "coverage_halfwidths_deg": [],
        "min_rate": 0,
    }
    document = answer_document(design_beams(read_problem(json.dumps(empty))))
    assert document["beams_re"] == document["rates"] == []
    assert document["objective"] == 0.0


PLANAR: dict[str, Any] = {
    "array": {"rows": 4, "columns": 2, "polarisations": 2},
    "angles": [[0.1, 0.2], [-0.3, 0.4]],
    "distances": ["0.1 km", 141.4],
    "coverage_halfwidths": [[[0.01, 0], [0, 0.01]], [[0.01, 0.002], [0.002, 0.02]]],
    "ripple": 3,
    "min_rate": 0,
    "power": 1,
    "noise": 1,
    "resolution": 0.02,
}


def test_quantities_may_have_units() -> None:
    units = {"angles_deg": ["75 deg", "2.2 rad"], "distances": ["103.5 m", "0.1414 km"]}
    problem = read_problem(json.dumps({**GOOD, **units}))
    np.testing.assert_allclose(problem.angles, [np.radians(75), 2.2], rtol=1e-15)
    np.testing.assert_allclose(problem.distances, [103.5, 141.4], rtol=1e-12)


def test_a_planar_document_becomes_a_problem_in_direction_cosines() -> None:
    problem = read_problem(json.dumps(PLANAR))
    assert problem.array == PlanarArray(4, 2, 0.5, 2)
    assert problem.n_tx == 16
    np.testing.assert_array_equal(problem.angles, PLANAR["angles"])
    np.testing.assert_array_equal(problem.coverage_halfwidths, PLANAR["coverage_halfwidths"])
    document = answer_document(design_beams(problem))
    assert np.array(document["beams_re"]).shape == (2, 16)
    assert document["status"] == "optimal"


@pytest.mark.parametrize(
    ("key", "value", "said"),
    [
        ("array", {"rows": 0, "columns": 2}, "rows"),
        ("array", "8x8", "8x8"),
        ("angles", [[0.1, 0.2, 0.3], [0, 0]], "pairs"),
        ("angles", [["10 deg", 0], [0, 0]], "pairs"),
        ("coverage_halfwidths", [[[0.01, 0]], [[0.01, 0]]], "matrices"),
        ("coverage_halfwidths", [[[0.01, 0], [0, -1]]] * 2, "positive definite"),
        ("n_tx", 8, "no such key"),
        ("angles", [[3, 0.2], [0, 0]], "u^2 + v^2"),
    ],
)
def test_faults_of_a_planar_document_name_key_and_value(key: str, value: Any, said: str) -> None:
    with pytest.raises(ProblemError) as caught:
        read_problem(json.dumps({**PLANAR, key: value}), "mine.json")
    assert str(caught.value).startswith(f"mine.json: {key}")
    assert said in str(caught.value)


def test_a_byte_order_mark_is_read_over() -> None:
    assert read_problem("\ufeff" + json.dumps(GOOD)).n_tx == 8


def test_one_value_stands_for_all_objects_and_one_angle_is_one_object() -> None:
    once = {"distances": "100 m", "coverage_halfwidths_deg": 3, "min_rate": 0}
    problem = read_problem(json.dumps({**GOOD, **once}))
    assert problem.distances.tolist() == [100.0, 100.0]
    np.testing.assert_allclose(problem.coverage_halfwidths, np.radians([3, 3]), rtol=1e-15)
    alone = read_problem(json.dumps({**GOOD, **once, "angles_deg": "75 deg"}))
    assert alone.n_objects == 1
    assert "expected 1" in _faults(angles_deg=75)[0]
    planar = {"angles": [0.1, 0.2], "coverage_halfwidths": [[0.01, 0], [0, 0.02]], "distances": 9}
    problem = read_problem(json.dumps({**PLANAR, **planar}))
    assert problem.coverage_halfwidths.tolist() == [[[0.01, 0], [0, 0.02]]]
    problem = read_problem(json.dumps({**PLANAR, **planar, "angles": [[0, 0], [0.1, 0.5]]}))
    np.testing.assert_array_equal(problem.coverage_halfwidths[0], problem.coverage_halfwidths[1])


def test_a_linear_array_may_be_given_whole() -> None:
    parts = {"n_tx": 8, "spacing": 0.4, "axis": "horizontal"}
    stated = read_problem(json.dumps({**GOOD, **parts}))
    whole = {key: value for key, value in GOOD.items() if key != "n_tx"}
    array = {"n": 8, "spacing": 0.4, "axis": "horizontal"}
    problem = read_problem(json.dumps({**whole, "array": array}))
    assert problem.array == stated.array
    np.testing.assert_array_equal(problem.angles, stated.angles)
    assert "n_tx: no such key" in _faults(array=array)[0]
