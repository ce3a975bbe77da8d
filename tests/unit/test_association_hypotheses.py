"""Windowed hypotheses against all histories one by one, and against plain lists of hypotheses."""

from __future__ import annotations

from itertools import product
from math import exp, log

import numpy as np
import pytest

from echobeam.tracking.association import (
    Hypotheses,
    Pairs,
    association_probabilities,
    first_hypotheses,
    grow,
    marginal,
)
from echobeam.values import Array

from ..joint_events import log_weight, possible_events, random_pairs

Event = tuple[int, ...]
History = tuple[Event, ...]


def of_all(pairs: Pairs, keep: int) -> Pairs:
    """Return the same pairs under each hypothesis."""
    return Pairs(
        np.repeat(pairs.log_odds[..., None, :, :], keep, axis=-3),
        np.repeat(pairs.missed[..., None, :], keep, axis=-2),
    )


def listed(hypotheses: Hypotheses) -> dict[History, float]:
    """Return the weights of one trial's hypotheses by their histories."""
    found = {}
    for weight, history in zip(hypotheses.log_weight, hypotheses.history, strict=True):
        if weight > -np.inf:
            found[tuple(tuple(event) for event in history.tolist())] = float(np.exp(weight))
    return found


def test_without_limits_all_histories_have_their_weights() -> None:
    """Two tracks, two detections, three scans: 343 histories, weights products of the scans'."""
    rng = np.random.default_rng(1)
    scans = [random_pairs(rng, (), 2, 2, 1.0) for _ in range(3)]
    hypotheses = first_hypotheses((), 2, 343, 3)
    for scan in scans:
        hypotheses = grow(hypotheses, of_all(scan, 343), 343, 3).hypotheses
    every = [possible_events(*scan) for scan in scans]
    expected = {h: exp(sum(e[x] for e, x in zip(every, h, strict=True))) for h in product(*every)}
    total = sum(expected.values())
    found = listed(hypotheses)
    assert len(found) == len(expected) == 343
    for history, weight in expected.items():
        assert found[history] == pytest.approx(weight / total, rel=1e-9)
    assert (np.diff(hypotheses.log_weight) <= 0).all()


def test_marginals_of_all_hypotheses_are_the_association_probabilities() -> None:
    pairs = random_pairs(np.random.default_rng(2), (6,), 3, 3, 0.7)
    hypotheses = grow(first_hypotheses((6,), 3, 40, 1), of_all(pairs, 40), 40, 1).hypotheses
    np.testing.assert_allclose(
        marginal(hypotheses, 3), association_probabilities(pairs), atol=1e-12
    )


def odds_after(history: History, scan: int, n_tracks: int, n_detections: int) -> Pairs:
    """Return pairs that depend on all that a hypothesis says, as a filter's would."""
    key = [scan, *(detection + 1 for event in history for detection in event)]
    return random_pairs(np.random.default_rng(key), (), n_tracks, n_detections, 0.8)


def grown_in_lists(
    before: dict[History, float], scan: int, keep: int, window: int, shape: tuple[int, int]
) -> dict[History, float]:
    """Return hypotheses after a scan, by the definition: children, keep, merge, prune."""
    children: list[tuple[float, History]] = []
    for history, weight in before.items():
        pairs = odds_after(history, scan, *shape)
        for event, value in possible_events(*pairs).items():
            children.append((log(weight) + value, (*history, event)))
    children = sorted(children, reverse=True)[:keep]
    merged: dict[History, list[float]] = {}
    oldest: dict[History, Event] = {}
    for value, history in children:
        merged.setdefault(history[-window:], []).append(exp(value))
        oldest.setdefault(history[-window:], history[-window - 1])
    sums = {history: sum(values) for history, values in merged.items()}
    best = max(sums, key=lambda history: sums[history])
    left = {history: s for history, s in sums.items() if oldest[history] == oldest[best]}
    return {history: s / sum(left.values()) for history, s in left.items()}


@pytest.mark.parametrize(("keep", "window"), [(5, 1), (12, 2), (30, 3), (1, 2)])
@pytest.mark.parametrize("shape", [(2, 2), (1, 3), (3, 2)])
def test_hypotheses_are_those_of_plain_lists(
    keep: int, window: int, shape: tuple[int, int]
) -> None:
    n_tracks, _ = shape
    hypotheses = first_hypotheses((), n_tracks, keep, window)
    expected = {((-1,) * n_tracks,) * window: 1.0}
    for scan in range(7):
        histories = [tuple(map(tuple, h)) for h in hypotheses.history.tolist()]
        each = [odds_after(history, scan, *shape) for history in histories]
        pairs = Pairs(*(np.stack([one[part] for one in each]) for part in range(2)))
        hypotheses = grow(hypotheses, pairs, keep, window).hypotheses
        expected = grown_in_lists(expected, scan, keep, window, shape)
        found = listed(hypotheses)
        assert found.keys() == expected.keys()
        for history, weight in expected.items():
            assert found[history] == pytest.approx(weight, rel=1e-9)


def test_parents_and_assignments_lead_to_the_histories() -> None:
    rng = np.random.default_rng(3)
    hypotheses = first_hypotheses((8,), 2, 10, 3)
    for _ in range(6):
        before = hypotheses
        pairs = random_pairs(rng, (8, 10), 2, 3, 0.7)
        hypotheses, parent, assignment = grow(before, pairs, 10, 3)
        trials = np.arange(8)[:, None]
        alive = hypotheses.alive
        assert np.array_equal(hypotheses.history[:, :, -1], assignment)
        kept = before.history[trials, parent, 1:]
        assert np.array_equal(hypotheses.history[:, :, :-1][alive], kept[alive])
        assert before.alive[trials, parent][alive].all()
        assert (parent[~alive] == 0).all()
        assert (assignment[~alive] == -1).all()
        np.testing.assert_allclose(np.exp(hypotheses.log_weight).sum(axis=-1), 1.0, rtol=1e-12)
        assert (np.diff(alive.astype(int), axis=-1) <= 0).all()


def test_after_pruning_all_agree_on_what_left_the_window() -> None:
    """The decision of N scans ago is one; those of later scans may differ."""
    rng = np.random.default_rng(4)
    hypotheses, beyond = first_hypotheses((30,), 2, 20, 2), 0
    for _ in range(8):
        before = hypotheses
        hypotheses, parent, _ = grow(before, random_pairs(rng, (30, 20), 2, 3, 0.9, 1.0), 20, 2)
        decided = before.history[np.arange(30)[:, None], parent, 0]
        agrees = (decided == decided[:, :1]).all(axis=-1)
        assert agrees[hypotheses.alive].all()
        beyond += np.count_nonzero((hypotheses.history[:, 1:] != hypotheses.history[:, :1]).any())
    assert beyond


def test_trials_of_a_batch_do_not_depend_on_each_other_nor_on_unused_hypotheses() -> None:
    rng = np.random.default_rng(5)
    batch = first_hypotheses((5,), 2, 8, 2)
    alone = [first_hypotheses((), 2, 8, 2) for _ in range(5)]
    for _ in range(4):
        pairs = random_pairs(rng, (5, 8), 2, 3, 0.7)
        pairs.log_odds[~batch.alive] = np.nan
        pairs.missed[~batch.alive] = np.nan
        batch = grow(batch, pairs, 8, 2).hypotheses
        for trial in range(5):
            own = Pairs(pairs.log_odds[trial], pairs.missed[trial])
            alone[trial] = grow(alone[trial], own, 8, 2).hypotheses
            assert np.array_equal(batch.log_weight[trial], alone[trial].log_weight)
            assert np.array_equal(batch.history[trial], alone[trial].history)


def test_one_hypothesis_is_the_nearest_neighbour_of_each_scan() -> None:
    pairs = random_pairs(np.random.default_rng(6), (20,), 3, 4, 0.7)
    grown = grow(first_hypotheses((20,), 3, 1, 4), of_all(pairs, 1), 1, 4)
    for one in range(20):
        event = tuple(grown.assignment[one, 0].tolist())
        best = max(possible_events(pairs.log_odds[one], pairs.missed[one]).values())
        assert log_weight(event, pairs.log_odds[one], pairs.missed[one]) == pytest.approx(best)
    assert (grown.hypotheses.log_weight == 0.0).all()


def bad(log_weight: Array, columns: int) -> None:
    history = np.full((*log_weight.shape, 1, 2), -1)
    pairs = Pairs(np.zeros((*log_weight.shape, columns, 3)), np.zeros((*log_weight.shape, columns)))
    grow(Hypotheses(log_weight, history), pairs, 2, 1)


def test_input_that_cannot_be_used_is_refused() -> None:
    with pytest.raises(ValueError, match="do not fit"):
        bad(np.zeros(2), 3)
    with pytest.raises(ValueError, match="finite weight"):
        bad(np.full(2, -np.inf), 2)
    with pytest.raises(ValueError, match="at least 1"):
        first_hypotheses((), 2, 0, 1)
    with pytest.raises(ValueError, match="at least 1"):
        grow(first_hypotheses((), 2, 1, 1), Pairs(np.zeros((1, 2, 3)), np.zeros((1, 2))), 1, 0)
