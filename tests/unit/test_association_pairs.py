"""Odds of pairs against SciPy's densities and quantiles, and what makes a pair impossible."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import chi2, multivariate_normal

from echobeam.tracking.association import Pairs, association_probabilities, pairs_of
from echobeam.tracking.association.pairs import LEAST_MISS

YES2, YES3 = np.ones(2, bool), np.ones(3, bool)


def scan(seed: int, per_detection: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Innovations and covariances of two tracks, three detections and two components."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(2, 3 if per_detection else 1, 2, 2))
    cov = root @ np.swapaxes(root, -1, -2) + 0.3 * np.eye(2)
    return 1.5 * rng.normal(size=(2, 3, 2)), cov


@pytest.mark.parametrize("per_detection", [True, False])
@pytest.mark.parametrize("gate", [0.5, 0.9, 0.9999, 1.0])
def test_odds_are_those_of_scipys_densities_inside_its_quantile(
    gate: float, per_detection: bool
) -> None:
    P_D, density = np.array([0.9, 0.6]), np.array([0.1, 2.0, 1e-4])
    for seed in range(20):
        innovation, cov = scan(seed, per_detection)
        pairs = pairs_of(innovation, cov, P_D, density, gate, YES2, YES3)
        for c in range(2):
            assert pairs.missed[c] == pytest.approx(
                np.log(max(1 - P_D[c] * gate, LEAST_MISS)), abs=1e-14
            )
            for d in range(3):
                S, e = cov[c, d if per_detection else 0], innovation[c, d]
                inside = e @ np.linalg.solve(S, e) <= chi2.ppf(gate, 2)
                odds = P_D[c] * multivariate_normal([0, 0], S).pdf(e) / density[d]
                expected = np.log(odds) if inside else -np.inf
                assert pairs.log_odds[c, d] == pytest.approx(expected, rel=1e-12, abs=1e-12)


def test_the_gate_holds_the_stated_share_of_a_tracks_detections() -> None:
    """False alarm below 1e-4: four standard deviations of a binomial share."""
    rng = np.random.default_rng(1)
    innovation = rng.normal(size=(40_000, 1, 1, 3))
    cov = np.broadcast_to(np.eye(3), (40_000, 1, 1, 3, 3))
    yes = np.ones((40_000, 1), bool)
    inside = pairs_of(innovation, cov, 0.9, 1.0, 0.9, yes, yes).log_odds > -np.inf
    assert abs(inside.mean() - 0.9) < 4 * np.sqrt(0.09 / 40_000)


def test_a_certain_detection_can_still_be_missed() -> None:
    """Two tracks with one detection between them: one has it and one does not."""
    one = np.zeros((2, 1, 2)), np.broadcast_to(np.eye(2), (2, 1, 2, 2))
    pairs = pairs_of(*one, 1.0, 1.0, 1.0, YES2, np.ones(1, bool))
    assert np.isfinite(pairs.missed).all()
    np.testing.assert_allclose(association_probabilities(pairs), 0.5, atol=1e-12)


def test_masked_tracks_and_detections_have_no_pairs_whatever_they_contain() -> None:
    innovation, cov = scan(2)
    innovation[1], innovation[:, 2], cov[1] = np.nan, np.inf, np.nan
    tracks, detections = np.array([True, False]), np.array([True, True, False])
    density = np.array([1.0, 1.0, np.nan])
    pairs = pairs_of(innovation, cov, np.array([0.9, np.nan]), density, 1.0, tracks, detections)
    assert np.array_equal(pairs.log_odds > -np.inf, [[True, True, False], [False] * 3])
    assert pairs.missed[1] == 0.0
    alone = pairs_of(innovation[:1, :2], cov[:1, :2], 0.9, 1.0, 1.0, tracks[:1], detections[:2])
    assert np.array_equal(pairs.log_odds[:1, :2], alone.log_odds)


def test_components_that_were_not_measured_count_neither_in_density_nor_in_gate() -> None:
    innovation, cov = scan(3)
    innovation[:, 0, 1], cov[:, 0, 1, 1] = np.nan, np.inf
    both = pairs_of(innovation, cov, 0.9, 1.0, 0.9, YES2, YES3)
    first = pairs_of(innovation[..., :1], cov[..., :1, :1], 0.9, 1.0, 0.9, YES2, YES3)
    assert np.array_equal(both.log_odds[:, 0], first.log_odds[:, 0])


def test_nothing_measured_is_no_pair() -> None:
    cov = np.diag([np.inf, np.inf])[None, None]
    yes = np.ones(1, bool)
    pairs = pairs_of(np.zeros((1, 1, 2)), cov, 0.9, 1.0, 1.0, yes, yes)
    assert pairs.log_odds[0, 0] == -np.inf


@pytest.mark.parametrize("cov", [np.ones((2, 2)), np.zeros((2, 2)), np.full((2, 2), np.nan)])
def test_a_singular_covariance_has_no_density_and_no_pairs(cov: np.ndarray) -> None:
    innovation, good = scan(4)
    both = np.stack([np.broadcast_to(cov, (3, 2, 2)), good[1]])
    pairs = pairs_of(innovation, both, 0.9, 1.0, 1.0, YES2, YES3)
    assert (pairs.log_odds[0] == -np.inf).all()
    assert np.isfinite(pairs.log_odds[1]).all()


def test_trials_of_a_batch_do_not_depend_on_each_other() -> None:
    every = [scan(seed) for seed in range(50)]
    innovation, cov = (np.stack([one[part] for one in every]) for part in range(2))
    yes2, yes3 = np.ones((50, 2), bool), np.ones((50, 3), bool)
    batch = pairs_of(innovation, cov, 0.9, 0.1, 0.99, yes2, yes3)
    for seed, one in enumerate(every):
        alone = pairs_of(*one, 0.9, 0.1, 0.99, YES2, YES3)
        assert np.array_equal(batch.log_odds[seed], alone.log_odds)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"detection_probability": 1.1}, "between 0 and 1"),
        ({"detection_probability": np.nan}, "between 0 and 1"),
        ({"clutter_density": 0.0}, "positive"),
        ({"clutter_density": np.inf}, "positive"),
        ({"gate_probability": 0.0}, "gate"),
        ({"gate_probability": 1.5}, "gate"),
        ({"tracks": YES3}, "masks"),
        ({"covariance": np.eye(3)}, "do not fit"),
        ({"innovation": np.zeros((3, 2))}, "do not fit"),
    ],
)
def test_input_that_cannot_be_used_is_refused(change: dict[str, object], message: str) -> None:
    innovation, cov = scan(5)
    arguments: dict[str, object] = {
        "innovation": innovation,
        "covariance": cov,
        "detection_probability": 0.9,
        "clutter_density": 1.0,
        "gate_probability": 0.9,
        "tracks": YES2,
        "detections": YES3,
    }
    with pytest.raises(ValueError, match=message):
        pairs_of(**(arguments | change))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("log_odds", "missed", "message"),
    [
        (np.full((2, 3), np.nan), np.zeros(2), "numbers"),
        (np.full((2, 3), np.inf), np.zeros(2), "numbers"),
        (np.zeros((2, 3)), np.full(2, -np.inf), "finite"),
        (np.zeros((2, 3)), np.zeros(3), "do not fit"),
        (np.zeros(3), np.zeros(()), "do not fit"),
    ],
)
def test_pairs_that_are_no_odds_are_refused(
    log_odds: np.ndarray, missed: np.ndarray, message: str
) -> None:
    with pytest.raises(ValueError, match=message):
        association_probabilities(Pairs(log_odds, missed))
