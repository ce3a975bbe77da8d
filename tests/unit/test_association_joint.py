"""Association probabilities against joint events one by one, and belief propagation's error."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from hypothesis import given
from scipy.optimize import linear_sum_assignment
from scipy.stats import binom

from echobeam.tracking.association import Pairs, association_probabilities, belief
from echobeam.tracking.association.belief import believed_probabilities
from echobeam.tracking.association.exact import exact_probabilities
from echobeam.values import Array

from ..joint_events import events, forest, probabilities, random_pairs, small_pairs


@given(small_pairs())
@pytest.mark.slow
def test_probabilities_are_those_of_the_joint_events(pairs: Pairs) -> None:
    found = association_probabilities(pairs)
    np.testing.assert_allclose(found, probabilities(*pairs), rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(found.sum(axis=-1), 1.0, rtol=1e-12)


@pytest.mark.parametrize("shape", [(2, 5), (5, 2), (4, 4), (5, 5), (6, 4), (1, 7), (7, 1)])
def test_a_batch_has_the_probabilities_of_its_scans(shape: tuple[int, int]) -> None:
    pairs = random_pairs(np.random.default_rng(1), (2, 6), *shape)
    found = association_probabilities(pairs)
    for index in np.ndindex(2, 6):
        expected = probabilities(pairs.log_odds[index], pairs.missed[index])
        np.testing.assert_allclose(found[index], expected, atol=1e-12)
        alone = association_probabilities(Pairs(pairs.log_odds[index], pairs.missed[index]))
        assert np.array_equal(found[index], alone)  # no bit depends on the other trials


def misses_exactly(log_odds: Array, missed: Array) -> Array:
    """Probabilities of misses with 60 digits, from sums over subsets in a dictionary.

    Rows are taken in order; a column of its own for a miss is never used up.
    """
    n_tracks = len(missed)
    with mpmath.workdps(60):
        A = [
            [mpmath.exp(x) if np.isfinite(x) else mpmath.mpf(0) for x in row]
            + [mpmath.exp(missed[c]) if i == c else mpmath.mpf(0) for i in range(n_tracks)]
            for c, row in enumerate(log_odds.tolist())
        ]

        def total_weight(skip: int | None) -> mpmath.mpf:
            """Return the sum over all events, or those in which a track is missed."""
            sums = {0: mpmath.mpf(1)}
            for c, row in enumerate(A):
                following: dict[int, mpmath.mpf] = {}
                for used, value in sums.items():
                    for column, entry in enumerate(row):
                        if entry and not used >> column & 1 and (c != skip or column >= miss):
                            key = used | 1 << column if column < miss else used
                            following[key] = following.get(key, 0) + value * entry
                sums = following
            return mpmath.fsum(sums.values())

        miss = log_odds.shape[1]
        total = total_weight(None)
        return np.array([float(total_weight(c) / total) for c in range(n_tracks)])


@pytest.mark.parametrize("spread", [3.0, 30.0, 300.0])
@pytest.mark.slow
def test_larger_scans_agree_with_sixty_digits(spread: float) -> None:
    for seed in range(4):
        pairs = random_pairs(np.random.default_rng(seed), (), 8, 9, 0.5, spread)
        found = association_probabilities(pairs)
        np.testing.assert_allclose(found[:, 0], misses_exactly(*pairs), rtol=1e-9, atol=1e-13)
        np.testing.assert_allclose(found.sum(axis=-1), 1.0, rtol=1e-12)
        assert (found[:, 1:].sum(axis=0) <= 1 + 1e-12).all()


@pytest.mark.parametrize("size", [1e-300, 1e-10, 1.0, 1e10, 1e300])
@pytest.mark.parametrize("method", [exact_probabilities, believed_probabilities])
@pytest.mark.slow
def test_odds_of_any_size_give_numbers(method: object, size: float) -> None:
    log_odds = np.log(size) + np.random.default_rng(2).normal(size=(5, 6, 6))
    for missed in (np.zeros((5, 6)), np.full((5, 6), np.log(1e-300))):
        with np.errstate(all="raise", under="ignore"):
            found = method(log_odds, missed)  # type: ignore[operator]
        assert np.isfinite(found).all()
        np.testing.assert_allclose(found.sum(axis=-1), 1.0, rtol=1e-12)


def test_one_detection_between_two_near_certain_tracks() -> None:
    """Closed form: the odds against each other, though a miss has 1e-300 of the weight."""
    log_odds = np.log(np.array([[1e300], [3e300]]))
    found = association_probabilities(Pairs(log_odds, np.log(np.full(2, 1e-300))))
    np.testing.assert_allclose(found, [[0.75, 0.25], [0.25, 0.75]], rtol=1e-9)


def test_columns_without_a_track_or_a_detection_change_nothing() -> None:
    pairs = random_pairs(np.random.default_rng(3), (20,), 3, 4)
    log_odds = np.full((20, 9, 8), -np.inf)
    log_odds[:, 2:8:2, ::2] = pairs.log_odds
    missed = np.zeros((20, 9))
    missed[:, 2:8:2] = pairs.missed
    wide = association_probabilities(Pairs(log_odds, missed))
    narrow = association_probabilities(pairs)
    np.testing.assert_allclose(wide[:, 2:8:2, 0], narrow[..., 0], atol=1e-14)
    np.testing.assert_allclose(wide[:, 2:8:2, 1::2], narrow[..., 1:], atol=1e-14)
    assert (wide[:, [0, 1, 3, 5, 7, 8], 0] == 1.0).all()


@pytest.mark.parametrize("shape", [(0, 0, 4), (3, 0, 4), (3, 4, 0), (2, 0, 0), (0, 3, 3)])
def test_nothing_to_associate(shape: tuple[int, int, int]) -> None:
    pairs = Pairs(np.zeros(shape), np.zeros(shape[:2]))
    found = association_probabilities(pairs)
    assert found.shape == (*shape[:2], shape[2] + 1)
    assert shape[2] or (found == 1.0).all()


def test_the_order_of_tracks_and_detections_does_not_matter() -> None:
    rng = np.random.default_rng(4)
    pairs = random_pairs(rng, (30,), 7, 8, 0.3)
    tracks, detections = rng.permutation(7), rng.permutation(8)
    moved = Pairs(pairs.log_odds[:, tracks][:, :, detections], pairs.missed[:, tracks])
    columns = np.concatenate([[0], detections + 1])
    expected = association_probabilities(pairs)[:, tracks][:, :, columns]
    np.testing.assert_allclose(association_probabilities(moved), expected, atol=1e-13)


def test_belief_propagation_is_exact_without_cycles() -> None:
    rng = np.random.default_rng(5)
    for _ in range(60):
        pairs = forest(rng, int(rng.integers(1, 6)), int(rng.integers(1, 5)))
        found = association_probabilities(pairs, exact_up_to=0)
        np.testing.assert_allclose(found, probabilities(*pairs), atol=1e-9)


@pytest.mark.parametrize(("spread", "most"), [(1.0, 0.07), (3.0, 0.17)])
@pytest.mark.parametrize("share", [0.3, 1.0])
def test_belief_propagation_is_near_on_loops(share: float, spread: float, most: float) -> None:
    """Errors are below the documented one in 99 % of scans; false alarm 1e-4 (binomial)."""
    pairs = random_pairs(np.random.default_rng(6), (1000,), 6, 6, share, spread)
    exact = association_probabilities(pairs)
    loopy = association_probabilities(pairs, exact_up_to=0)
    error = np.abs(loopy - exact).max(axis=(1, 2))
    assert np.count_nonzero(error > 0.01) >= 1  # there are loops
    assert np.count_nonzero(error > most) <= binom.ppf(1 - 1e-4, 1000, 0.01)
    np.testing.assert_allclose(loopy.sum(axis=-1), 1.0, rtol=1e-12)
    assert (loopy[..., 1:].sum(axis=-2) <= 1 + 1e-8).all()  # detections, at convergence


def bethe(pair: Array, beliefs: Array) -> float:
    """Minus the Bethe free energy of beliefs (Vontobel 2013): a logarithm of the total weight.

    `pair` are odds against a miss. Nodes are the choices of tracks and of detections.
    """
    b, miss = beliefs[:, 1:], beliefs[:, 0]
    empty = 1.0 - b.sum(axis=0)

    def entropy(p: Array) -> float:
        return float(-np.sum(np.where(p > 0, p * np.log(np.where(p > 0, p, 1.0)), 0.0)))

    energy = float(np.sum(b * np.log(pair)))
    # Each edge variable is in two nodes: its entropy counts once less.
    return energy + 2 * entropy(b) + entropy(miss) + entropy(empty) - entropy(b) - entropy(1 - b)


def test_the_total_weight_of_belief_propagation_is_a_lower_bound() -> None:
    """Lelarge, Counting matchings in irregular bipartite graphs and random lifts, SODA 2017."""
    pairs = random_pairs(np.random.default_rng(7), (40,), 4, 4, 1.0)
    loopy = association_probabilities(pairs, exact_up_to=0)
    for log_odds, missed, beliefs in zip(*pairs, loopy, strict=True):
        pair = np.exp(log_odds - missed[:, None])
        total = np.log(
            sum(np.prod([pair[c, d] for c, d in enumerate(e) if d >= 0]) for e in events(4, 4))
        )
        assert total - 1.0 < bethe(pair, beliefs) <= total + 1e-8


@pytest.mark.parametrize("share", [0.3, 1.0])
@pytest.mark.parametrize("spread", [0.1, 3.0, 30.0, 170.0])
@pytest.mark.parametrize("log_miss", [-1.0, -36.0, -300.0])
@pytest.mark.slow
def test_belief_propagation_converges(share: float, spread: float, log_miss: float) -> None:
    """At the fixed point detections belong to one track at most; plain sums of beliefs show it."""
    log_odds = random_pairs(np.random.default_rng(8), (30,), 12, 12, share, spread).log_odds
    found = believed_probabilities(log_odds, np.full((30, 12), log_miss))
    assert np.isfinite(found).all()
    assert (found[..., 1:].sum(axis=-2) <= 1 + 1e-4).all()


def test_belief_propagation_stays_where_it_converged(monkeypatch: pytest.MonkeyPatch) -> None:
    """Odds as radar has them: ten times the iterations, to a tolerance of zero, change nothing."""
    pairs = random_pairs(np.random.default_rng(11), (40,), 12, 12, 0.5, 4.0)
    found = believed_probabilities(*pairs)
    monkeypatch.setattr(belief, "TOLERANCE", 0.0)
    np.testing.assert_allclose(believed_probabilities(*pairs), found, atol=1e-8)


def test_belief_propagation_does_not_depend_on_the_batch() -> None:
    pairs = random_pairs(np.random.default_rng(9), (30,), 6, 6, 0.6, 8.0)
    batch = believed_probabilities(*pairs)
    for one in range(30):
        alone = believed_probabilities(pairs.log_odds[[one]], pairs.missed[[one]])[0]
        assert np.array_equal(batch[one], alone)


def test_dominant_odds_give_the_best_assignment() -> None:
    """With odds of e^200 each, marginals are the indicator of the best joint event."""
    pairs = random_pairs(np.random.default_rng(10), (20,), 12, 12, 1.0)
    found = association_probabilities(Pairs(200.0 * (pairs.log_odds + 20.0), 0 * pairs.missed))
    for scan in range(20):
        _, columns = linear_sum_assignment(pairs.log_odds[scan], maximize=True)
        if found[scan].max(axis=-1).min() > 0.99:  # no near tie
            assert np.array_equal(found[scan].argmax(axis=-1), columns + 1)


def test_a_negative_limit_is_refused() -> None:
    with pytest.raises(ValueError, match="exact_up_to"):
        association_probabilities(Pairs(np.zeros((1, 1)), np.zeros(1)), exact_up_to=-1)
