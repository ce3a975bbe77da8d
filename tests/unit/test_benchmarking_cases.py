"""The cases: what they hold, and that recorded problems are those of the run."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.beamforming.design import design_batch
from echobeam.benchmarking import asked, measure, problems
from echobeam.benchmarking.cases import CASES, QUICK, find_cases
from echobeam.benchmarking.methods import METHODS, find_methods
from echobeam.faults import InputError
from echobeam.simulation.run import simulate


def test_an_unknown_case_is_refused_and_all_are_named() -> None:
    with pytest.raises(InputError) as refused:
        find_cases(["test-point", "n30-k2-s2"])
    assert "'n30-k2-s2'" in str(refused.value)
    assert all(name in str(refused.value) for name in CASES)


def test_an_unknown_method_is_refused_and_all_are_named() -> None:
    with pytest.raises(InputError) as refused:
        find_methods(["quick"], reference=False)
    assert all(name in str(refused.value) for name in METHODS)


def test_cases_asked_for_twice_are_run_once_in_the_order_given() -> None:
    found = find_cases(["n8-k1-s1", "test-point", "n8-k1-s1"])
    assert [case.name for case in found] == ["n8-k1-s1", "test-point"]


def test_the_quick_selection_exists() -> None:
    assert set(QUICK) <= set(CASES)


def test_the_reference_is_run_on_single_problems_and_on_others_when_asked_for() -> None:
    usual = {method.name: method for method in find_methods([], reference=False)}
    assert set(METHODS) - set(usual) == {"cvxpy-clarabel"}
    runs = {name for name in QUICK if usual["cvxpy-scs"].suits(CASES[name].make().batch)}
    assert runs == {"test-point"}
    assert {method.name for method in find_methods([], reference=True)} == set(METHODS)
    some = [method.name for method in find_methods(["sdp"], reference=True)]
    assert some == ["sdp", "cvxpy-scs", "cvxpy-clarabel"]


@pytest.mark.parametrize("name", ["n8-k4-s0.1", "n128-k8-s3"])
def test_generated_problems_are_what_their_name_says(name: str) -> None:
    n_tx, count, sigma = (float(part[1:]) for part in name.split("-"))
    first, second = (CASES[name].make().batch for _ in range(2))
    assert first.n_tx == n_tx
    assert first.active.shape == (256, count)
    assert first.active.all()
    assert np.allclose(first.coverage_halfwidths, np.radians(3.0 * sigma))
    assert np.array_equal(first.angles, second.angles)
    assert np.allclose(np.sqrt(first.loss) * np.sin(first.angles), 100.0)
    assert np.abs(np.sqrt(first.loss) * np.cos(first.angles)).max() <= 200.0


def test_hard_problems_have_neighbours_3_to_6_degrees_apart() -> None:
    batch = CASES["hard-n30-k4"].make().batch
    apart = np.abs(np.degrees(np.diff(batch.angles, axis=1)))
    assert apart.min() >= 3.0
    assert apart.max() <= 6.0
    assert batch.power == 1e4
    assert not batch.min_rate.any()


def test_the_known_point_is_as_it_is_stated() -> None:
    batch = problems.test_point().batch
    assert batch.n_tx == 30
    assert np.allclose(np.degrees(batch.angles), [[75.0, 135.0]])
    assert np.allclose(np.degrees(batch.coverage_halfwidths), 3.0)
    assert batch.ripple.tolist() == [2.0, 2.0]
    assert batch.power == 1e4


def test_a_warm_start_is_the_design_of_objects_one_slot_back() -> None:
    drawn = problems.on_the_road(8, 1, 1.0)
    trials = np.arange(3)
    assert drawn.before is not None
    warm = drawn.with_warm_start(np.inf).warm(trials)
    assert warm.warm_start is not None
    moved = np.abs(drawn.batch.loss - 100.0**2) ** 0.5
    back = np.abs(drawn.before.loss - 100.0**2) ** 0.5
    assert np.allclose(np.abs(moved - back), 0.3)
    assert np.array_equal(warm.warm_start, design_batch(drawn.before.taken(trials)).beams)
    assert np.array_equal(warm.angles, drawn.batch.angles[trials])


def test_the_slot_before_is_designed_for_as_many_problems_as_time_allows() -> None:
    drawn = problems.on_the_road(8, 1, 1.0)
    few, all_of_them = (drawn.with_warm_start(seconds).warm_start for seconds in (0.0, np.inf))
    assert few is not None
    assert all_of_them is not None
    assert len(few) == problems.PREPARED_TOGETHER
    assert len(all_of_them) == len(drawn.batch)
    assert np.array_equal(few, all_of_them[: len(few)])
    part = measure.time_method(METHODS["fast-warm"], drawn.with_warm_start(0.0), 1)
    assert part.seconds.size == len(few)


def test_recorded_problems_are_those_that_the_run_solved() -> None:
    """Their designs are the beams that an ordinary run of the scheme stored."""
    slots = asked.asked_in("paper-single", 2)
    run = simulate("paper-single", ["temporal"], trials=2, seed=asked.SEED)
    sent = run["beam"].values[0, ..., 0] + 1j * run["beam"].values[0, ..., 1]
    assert [slot.slot_in_frame for slot in slots] == list(range(2, 11))
    for slot in slots:
        assert np.array_equal(slot.beams, sent[:, slot.slot_in_frame - 1])
        assert np.array_equal(design_batch(slot.batch).beams, slot.beams)
        angles = run["predicted"].values[0, :, slot.slot_in_frame - 1, :, 0]
        assert np.array_equal(slot.batch.angles, angles)


def test_recorded_first_slots_have_no_slot_before_and_later_ones_its_beams(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    few = asked.asked_in("paper-single", 2)
    monkeypatch.setattr(asked, "asked_in", lambda scenario: few)
    assert not asked.first_slots("paper-single").has_warm_start
    later = asked.later_slots("paper-single")
    assert len(later.batch) == 2 * 8
    trial = int(np.flatnonzero(later.batch.angles[:, 0] == few[4].batch.angles[1, 0])[0])
    warm = later.warm(np.array([trial])).warm_start
    assert warm is not None
    assert np.array_equal(warm[0], few[3].beams[1])
