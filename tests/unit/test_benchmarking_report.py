"""Tiny benchmarks: records, correctness from something independent, strict JSON, the door."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner

from echobeam.beamforming.problem import ProblemBatch
from echobeam.benchmarking import cases, measure, report
from echobeam.benchmarking.cases import Case
from echobeam.benchmarking.judgement import judge
from echobeam.benchmarking.measure import CaseResult, Timed, run_case
from echobeam.benchmarking.methods import METHODS, Designed, Method, find_methods
from echobeam.benchmarking.problems import CaseProblems
from echobeam.cli.bench import command
from echobeam.faults import InputError
from echobeam.values import ComplexArray

from ..problems import problem_batch

KEYS = [
    "case",
    "method",
    "n_tx",
    "objects",
    "seconds_median",
    "seconds_p99",
    "objective",
    "violation",
    "gap",
]


def tiny_batch(n_objects: int = 1, count: int = 3, min_rate: float = 0.0) -> ProblemBatch:
    angles = np.radians(50.0 + 60.0 * np.arange(n_objects) + np.arange(count)[:, None])
    return problem_batch(
        angles=angles,
        distances=100.0 / np.sin(angles),
        coverage_halfwidths=np.full(angles.shape, np.radians(2.0)),
        active=np.ones(angles.shape, dtype=bool),
        ripple=np.full(n_objects, 1.0),
        min_rate=np.full(n_objects, min_rate),
        power=1e4,
        noise=1.0,
        n_tx=6,
        resolution=np.radians(0.5),
    )


def tiny(batch: ProblemBatch | None = None) -> Case:
    problems = CaseProblems(tiny_batch() if batch is None else batch)
    return Case("tiny", "six antennas", lambda: problems)


def steering(theta: float) -> ComplexArray:
    return np.exp(1j * np.pi * np.sin(theta) * np.arange(6))


def test_a_record_has_the_keys_of_the_interface_and_is_strict_json() -> None:
    result = run_case(tiny(), find_methods(["fast", "fast-single", "sdp"], reference=False), 1)
    for document in json.loads(json.dumps(report.documents([result]), allow_nan=False)):
        assert list(document) == KEYS
        assert document["case"] == "tiny"
        assert (document["n_tx"], document["objects"]) == (6, 1)
        assert 0.0 < document["seconds_median"] <= document["seconds_p99"]
        assert 0.0 <= document["gap"] < 1e-4
        assert 0.0 <= document["violation"] <= 1e-6


def test_all_methods_reach_what_one_object_and_no_coverage_allow() -> None:
    """The matched beam: log2(1 + P_T N / (sigma^2 d^2)), known without any solver."""
    batch = tiny_batch()
    free = CaseProblems(
        problem_batch(
            **{name: getattr(batch, name) for name in ("angles", "active", "min_rate")}
            | {"coverage_halfwidths": np.zeros((3, 1)), "ripple": np.full(1, 6.0)},
            distances=np.sqrt(batch.loss),
            power=1e4,
            noise=1.0,
            n_tx=6,
        )
    )
    case = Case("free", "", lambda: free)
    result = run_case(case, find_methods(["fast", "fast-single", "sdp"], reference=False), 1)
    best = np.log2(1.0 + 1e4 * 6 / batch.loss[:, 0])
    for judged in result.judged:
        count = judged.objective.size
        assert np.allclose(judged.objective, best[:count], rtol=1e-6)


def test_violation_is_what_the_weights_say_whatever_the_method_says() -> None:
    batch = tiny_batch()
    theta = batch.angles[0, 0]
    beams = steering(theta)[None] * np.sqrt(1.5e4 / 6)
    covered = theta + np.radians(0.5) * np.arange(-4, 5)
    gains = np.array([abs(np.vdot(steering(angle), beams[0])) ** 2 for angle in covered])
    power = np.sum(np.abs(beams) ** 2)
    excess = np.max(np.abs(gains - gains[4])) / power - 1.0
    judged = judge(batch, [beams], np.array([False]), np.array([np.nan]))
    assert judged.violation[0] == pytest.approx(max(0.5, excess), rel=1e-9)
    assert judged.objective[0] == pytest.approx(
        np.log2(1.0 + gains[4] / batch.loss[0, 0]), rel=1e-12
    )
    assert np.isnan(judged.gap[0])


def test_a_gap_is_relative_to_the_bound_that_is_given() -> None:
    batch = tiny_batch()
    beams = steering(batch.angles[0, 0])[None] * np.sqrt(1e4 / 6)
    rate = np.log2(1.0 + 6e4 / batch.loss[0, 0])
    judged = judge(batch, [beams, None], np.zeros(2, dtype=bool), np.array([1.25 * rate, 1.0]))
    assert judged.gap[0] == pytest.approx(0.25)
    assert np.isnan(judged.gap[1])
    assert np.isinf(judged.violation[1])


def test_floors_out_of_reach_are_counted_and_power_and_coverage_still_judged() -> None:
    case = tiny(tiny_batch(min_rate=9.0))
    result = run_case(case, find_methods(["fast", "sdp"], reference=False), 1)
    for timed, judged in zip(result.timed, result.judged, strict=True):
        assert timed.fallback.all()
        assert judged.violation.max() <= 1e-6
    assert "floors not met, fallback beams, for" in report.table([result])
    assert [each.gap for each in report.records([result])] == [None, None]


def test_what_failed_is_null_and_not_a_number() -> None:
    failing = Method(
        "failing", "", lambda batch: lambda: Designed([None] * len(batch), np.array([False]))
    )
    result = run_case(tiny(), [failing], 2)
    (document,) = report.documents([result])
    assert document["objective"] is None
    assert document["violation"] is None
    assert document["gap"] is None
    json.dumps(document, allow_nan=False)
    assert "failing" in report.table([result])


def made(case: Case, seconds: dict[str, list[float]], objective: dict[str, list[float]]):
    """Return a result of given times and sum rates."""
    from echobeam.benchmarking.judgement import Judged

    timed = [
        Timed(name, np.array(each), [None] * len(each), np.zeros(len(each), dtype=bool))
        for name, each in seconds.items()
    ]
    judged = [
        Judged(np.array(each), np.zeros(len(each)), np.full(len(each), np.nan))
        for each in objective.values()
    ]
    return CaseResult(case, 64, int(case.name.rpartition("k")[2] or 1), timed, judged, {})


def test_figures_are_those_of_the_problems_that_all_were_given() -> None:
    result = made(
        Case("x-k2", "", tiny().make),
        {"fast": [1.0, 2.0, 30.0], "sdp": [10.0, 40.0]},
        {"fast": [5.0, 6.0, 100.0], "sdp": [5.0, 8.0]},
    )
    fast, sdp = report.records([result])
    assert fast.objective == 5.5
    assert sdp.objective == 6.5
    assert fast.seconds_median == 2.0
    assert fast.seconds_p99 == pytest.approx(np.quantile([1.0, 2.0, 30.0], 0.99))
    assert report.shortfall(result, 0) == pytest.approx(0.25)
    row = next(line.split() for line in report.table([result]).splitlines() if "fast" in line)
    assert float(row[4]) == pytest.approx(25.0 / 1.5, rel=0.01)


def test_growth_is_the_exponent_between_the_least_and_the_largest_k() -> None:
    results = [
        made(Case(f"growth-k{k}", "", tiny().make), {"fast": [1e-3 * k**1.5]}, {"fast": [1.0]})
        for k in (2, 4, 16)
    ]
    assert report.growth(results) == ["  fast: K^1.50 from 2 to 16"]
    assert report.growth(results[:1]) == []


def test_a_method_gets_as_many_problems_as_it_has_time_for(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    monkeypatch.setattr(measure.time, "perf_counter", lambda: clock[0])

    def slow(batch: ProblemBatch, each: float):
        def call() -> Designed:
            clock[0] += each * len(batch)
            return Designed([np.zeros((1, 6))] * len(batch), np.zeros(len(batch), dtype=bool))

        return call

    problems = CaseProblems(tiny_batch(count=40))
    alone = Method("a", "", lambda batch: slow(batch, 0.1))
    assert measure.time_method(alone, problems, 2).seconds.tolist() == pytest.approx([0.1] * 10)
    together = Method("b", "", lambda batch: slow(batch, 0.02), together=256)
    assert measure.time_method(together, problems, 2).seconds.tolist() == pytest.approx([0.02] * 40)
    long = Method("c", "", lambda batch: slow(batch, 100.0))
    assert measure.time_method(long, problems, 5).seconds.tolist() == pytest.approx([100.0])


def test_a_method_that_cannot_run_is_left_out_and_says_why() -> None:
    absent = Method("absent", "", METHODS["sdp"].prepare, requires=lambda: "cvxpy")
    large = Method("large", "", METHODS["sdp"].prepare, most_antennas=4)
    result = run_case(tiny(), [absent, large, METHODS["fast-warm"]], 1)
    assert result.timed == []
    text = report.table([result])
    assert "absent left out: cvxpy is not installed (pip install cvxpy)" in text
    assert "large left out: takes minutes here; --method large runs it" in text
    assert "fast-warm left out: there is no slot before" in text
    assert len(run_case(tiny(), [large], 1, asked=["large"]).timed) == 1


@pytest.mark.slow
@pytest.mark.parametrize("name", ["cvxpy-scs", "cvxpy-clarabel"])
def test_the_full_size_problem_agrees_with_the_reduced_one(name: str) -> None:
    pytest.importorskip("cvxpy")
    case = tiny(tiny_batch(n_objects=2, count=1))
    result = run_case(case, [METHODS["sdp"], METHODS[name]], 1)
    sdp, full = report.records([result])
    assert full.objective == pytest.approx(sdp.objective, rel=1e-4)
    assert full.violation is not None
    assert full.violation <= 1e-6


def test_the_command_prints_records_and_nothing_else(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(cases.CASES, "tiny", tiny())
    arguments = ["--case", "tiny", "--method", "fast", "--repeat", "1"]
    done = CliRunner().invoke(command, [*arguments, "--json", "--quiet"])
    assert done.exit_code == 0, done.output
    (document,) = json.loads(done.stdout)
    assert list(document) == KEYS
    table = CliRunner().invoke(command, [*arguments, "--quiet"]).stdout
    assert report.processor() in table
    assert "tiny: six antennas" in table


def test_the_command_names_all_cases_if_one_is_unknown() -> None:
    done = CliRunner().invoke(command, ["--case", "n31-k2-s1", "--quiet"])
    assert isinstance(done.exception, InputError)
    assert "hard-n30-k2" in str(done.exception)
