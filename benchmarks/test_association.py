"""Cost of association: microseconds per scan in a batch, and against Stone Soup's JPDA.

`make bench` prints it; correctness stands beside the time.
"""

from datetime import datetime
from time import perf_counter

import numpy as np
import pytest

from echobeam.tracking.association import (
    association_probabilities,
    first_hypotheses,
    grow,
    k_best,
    nearest,
    pairs_of,
)

SCANS, P_D, P_G, DENSITY = 1000, 0.9, 0.9999, 3 / 1200


def scans(n_tracks, n_detections, seed=0):
    """Return positions of tracks and detections ``(B, ., 2)`` and the cov of innovations.

    Tracks are a metre or so apart, so that they compete; the first detections are theirs.
    """
    rng = np.random.default_rng(seed)
    track = rng.normal(size=(SCANS, n_tracks, 2)) * np.sqrt(n_tracks)
    detection = rng.random((SCANS, n_detections, 2)) * [60, 20] - [30, 10]
    shared = min(n_tracks, n_detections)
    detection[:, :shared] = track[:, :shared] + 0.7 * rng.normal(size=(SCANS, shared, 2))
    return track, detection, np.broadcast_to(0.5 * np.eye(2), (SCANS, n_tracks, 1, 2, 2))


def odds(track, detection, cov):
    innovation = detection[:, None, :, :] - track[:, :, None, :]
    there = np.ones(track.shape[:-1], bool), np.ones(detection.shape[:-1], bool)
    return pairs_of(innovation, cov, P_D, DENSITY, P_G, *there)


def per_scan(benchmark):
    benchmark.extra_info["us_per_scan"] = round(1e6 * benchmark.stats["median"] / SCANS, 3)


def soup_probabilities(track, detection, cov):
    """Return the JPDA of Stone Soup for one scan, and the seconds that it takes."""
    from stonesoup.dataassociator.probability import JPDA
    from stonesoup.hypothesiser.probability import PDAHypothesiser
    from stonesoup.models.measurement.linear import LinearGaussian
    from stonesoup.models.transition.linear import (
        CombinedLinearGaussianTransitionModel,
        RandomWalk,
    )
    from stonesoup.predictor.kalman import KalmanPredictor
    from stonesoup.types.detection import Detection
    from stonesoup.types.state import GaussianState
    from stonesoup.types.track import Track
    from stonesoup.updater.kalman import KalmanUpdater

    now = datetime(2020, 1, 1)
    model = LinearGaussian(2, (0, 1), 0.25 * np.eye(2))
    motion = CombinedLinearGaussianTransitionModel([RandomWalk(0.0)] * 2)
    known = {"clutter_spatial_density": DENSITY, "prob_detect": P_D, "prob_gate": P_G}
    jpda = JPDA(PDAHypothesiser(KalmanPredictor(motion), KalmanUpdater(model), **known))
    prior = cov[0, 0] - 0.25 * np.eye(2)
    tracks = [Track([GaussianState(point[:, None], prior, timestamp=now)]) for point in track]
    seen = [Detection(z[:, None], timestamp=now, measurement_model=model) for z in detection]
    begin = perf_counter()
    found = jpda.associate(set(tracks), set(seen), now)
    seconds = perf_counter() - begin
    result = np.zeros((len(tracks), len(seen) + 1))
    for row, one in zip(result, tracks, strict=True):
        for hypothesis in found[one]:
            column = (
                1 + [z is hypothesis.measurement for z in seen].index(True) if hypothesis else 0
            )
            row[column] = float(hypothesis.probability)
    return result, seconds


def test_joint_probabilities_against_stone_soup(benchmark):
    """Odds and probabilities of 1000 scans of two tracks and five detections; fifty of theirs."""
    pytest.importorskip("stonesoup")
    track, detection, cov = scans(2, 5)
    found = benchmark(lambda: association_probabilities(odds(track, detection, cov)))
    seconds = []
    for scan in range(50):
        expected, taken = soup_probabilities(track[scan], detection[scan], cov[scan])
        np.testing.assert_allclose(found[scan], expected, atol=1e-9)
        seconds.append(taken)
    per_scan(benchmark)
    ratio = np.median(seconds) / (benchmark.stats["median"] / SCANS)
    benchmark.extra_info["times_stone_soup"] = round(ratio)
    assert ratio > 100


@pytest.mark.parametrize("size", [(2, 5), (4, 10), (8, 12), (16, 16)])
@pytest.mark.parametrize("method", ["joint", "nearest", "k_best"])
def test_association_of_prepared_odds(benchmark, method, size):
    """Correctness: sums of one; the nearest is the first of the ten best."""
    pairs = odds(*scans(*size))
    if method == "joint":
        found = benchmark(association_probabilities, pairs)
        np.testing.assert_allclose(found.sum(axis=-1), 1.0, rtol=1e-12)
        assert (found[..., 1:].sum(axis=-2) <= 1 + 1e-4).all()
    elif method == "nearest":
        found = benchmark(nearest, pairs)
        assert np.array_equal(found[:50], k_best(type(pairs)(*(p[:50] for p in pairs)), 1)[0][:, 0])
    else:
        assignment, weight = benchmark.pedantic(k_best, (pairs, 10), rounds=1)
        assert (np.diff(weight[np.isfinite(weight).all(axis=1)]) <= 1e-9).all()
        assert np.array_equal(assignment[:, 0], nearest(pairs))
    per_scan(benchmark)


def test_twenty_hypotheses(benchmark):
    """One scan under twenty hypotheses each; correctness: weights of sum one."""
    pairs = odds(*scans(2, 5))
    each = type(pairs)(*(np.repeat(part[:, None], 20, axis=1) for part in pairs))
    start = grow(first_hypotheses((SCANS,), 2, 20, 3), each, 20, 3).hypotheses
    grown = benchmark(grow, start, each, 20, 3)
    np.testing.assert_allclose(np.exp(grown.hypotheses.log_weight).sum(axis=-1), 1.0, rtol=1e-9)
    per_scan(benchmark)
