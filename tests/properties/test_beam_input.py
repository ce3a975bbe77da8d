"""Any input to beam design has a clear error or a defined answer; nothing else may happen."""

from __future__ import annotations

import json
import math
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from hypothesis import strategies as st

from echobeam.beamforming.design import design_batch, design_beams
from echobeam.beamforming.problem import BeamProblem, ProblemError
from echobeam.cli.beam import command

DEG = np.pi / 180.0

ODD = st.sampled_from([math.nan, math.inf, -math.inf, 0.0, -0.0, -1.0, 1e-300, 1e300, 5e-324])
LISTS = ("angles", "distances", "coverage_halfwidths", "ripple", "min_rate")
NUMBERS = ("power", "noise", "alpha0", "spacing", "resolution", "n_tx")


SAME = ("distances", "ripple", "min_rate", "power", "noise", "n_tx")


@st.composite
def sane(draw: st.DrawFn, most_objects: int = 4) -> dict[str, Any]:
    """Return arguments in their ranges: no objects, more than antennas, half planes, corners."""
    n_objects = draw(st.integers(0, most_objects))

    def vector(values: st.SearchStrategy[float]) -> list[float]:
        return draw(st.lists(values, min_size=n_objects, max_size=n_objects))

    widths = st.sampled_from([0.0, 1e-9, 0.5, 10.0, 45.0, 90.0]) | st.floats(0.0, 90.0)
    angles = st.sampled_from([0.0, 60.0, 90.0, 120.0, 180.0]) | st.floats(0.0, 180.0)
    return {
        "angles": [a * DEG for a in vector(angles)],
        "distances": vector(st.floats(1e-2, 1e5)),
        "coverage_halfwidths": [w * DEG for w in vector(widths)],
        "ripple": vector(st.sampled_from([0.0, 1e-4, 1.0, 8.0])),
        "min_rate": draw(st.sampled_from([0.0, 1e-3, 50.0])),
        "power": 10.0 ** draw(st.integers(-9, 9)),
        "noise": 1.0,
        "n_tx": draw(st.integers(1, 6)),
        "resolution": draw(st.sampled_from([1.0, 5.0])) * DEG,
    }  # fmt: skip


@settings(max_examples=25)
@given(sane())
@pytest.mark.slow
def test_what_is_in_range_has_a_feasible_answer(arguments: dict[str, Any]) -> None:
    problem = BeamProblem(**arguments)
    answer = design_beams(problem)
    _is_defined(problem, answer)
    together = design_batch(problem.batch())
    assert together.fallback.tolist() == [answer.status == "fallback"]
    assert abs(together.objective[0] - answer.objective) <= 1e-9 * answer.objective


def _is_defined(problem: BeamProblem, answer: Any) -> None:
    assert np.all(np.isfinite(answer.beams))
    assert answer.beams.shape == (problem.n_objects, problem.n_tx)
    assert answer.max_violation.power <= 1e-9
    assert answer.max_violation.coverage <= 1e-6
    assert 0.0 <= answer.objective <= answer.upper_bound
    assert answer.status == "optimal" or answer.message


@settings(max_examples=8)
@given(sane(most_objects=2))
def test_certifying_is_defined_too_and_never_below(arguments: dict[str, Any]) -> None:
    problem = BeamProblem(**{**arguments, "n_tx": min(4, arguments["n_tx"])})
    answer = design_beams(problem, certify=True, gap=0.5)
    _is_defined(problem, answer)
    if answer.status == "optimal":
        assert answer.upper_bound >= design_beams(problem, method="sdp").objective * (1 - 1e-6)


@settings(max_examples=80)
@given(sane(), st.data())
@pytest.mark.slow
def test_what_is_out_of_range_is_refused_by_name_or_answered(
    arguments: dict[str, Any], data: st.DataObject
) -> None:
    name = data.draw(st.sampled_from(LISTS + NUMBERS))
    odd = ODD | st.just("three") | st.none() | st.just([[1.0]]) | st.just([1.0] * 7)
    value = data.draw(odd)
    spoilt: Any = value
    if name in LISTS and isinstance(value, float) and arguments["angles"]:
        spoilt = [value] * len(arguments["angles"])
    try:
        problem = BeamProblem(**{**arguments, name: spoilt})
        answer = design_beams(problem)
    except ProblemError as error:
        assert any(field in str(error) for field in (*LISTS, *NUMBERS))  # noqa: PT017
        return
    # What an odd value leaves possible is a defined answer; extreme ones need not be proved.
    assert np.all(np.isfinite(answer.beams))
    assert answer.status == "optimal" or answer.message


JSON_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(-3, 200) | st.floats() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner),
    max_leaves=5,
)


@settings(max_examples=60)
@given(sane(), st.data())
@pytest.mark.slow
def test_the_command_line_answers_or_refuses_any_document(
    arguments: dict[str, Any], data: st.DataObject
) -> None:
    document = {
        "angles_deg": [a / DEG for a in arguments["angles"]],
        "coverage_halfwidths_deg": [min(90.0, w / DEG) for w in arguments["coverage_halfwidths"]],
        "resolution_deg": 1.0,
        **{key: arguments[key] for key in SAME},
    }
    for key in data.draw(st.lists(st.sampled_from([*document, "odd"]), max_size=2)):
        document[key] = data.draw(JSON_VALUES)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "problem.json"
        path.write_text(json.dumps(document), encoding="utf-8")
        result = CliRunner().invoke(command, [str(path)])
    if result.exit_code == 0:
        assert json.loads(result.stdout)["status"] in ("optimal", "fallback", "infeasible")
    else:
        assert isinstance(result.exception, ProblemError), result.exception
        assert str(path) in str(result.exception) or "resolution" in str(result.exception)
