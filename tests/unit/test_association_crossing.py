"""Two crossing objects in clutter: stated means of Stone Soup's trackers, and its JPDA itself.

The stated numbers are those of an independent run of Stone Soup 1.9.1 over the same 60 seeds, with
their standard errors. The first scan, in which tracks are at the truth, counts and is not used.
"""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Any

import numpy as np
import pytest
from scipy.stats import binomtest

from ..crossing import (
    DENSITY,
    P_D,
    P_G,
    SEEDS,
    START_COV,
    Crossing,
    crossing,
    gospa,
    joint,
    multiple_hypotheses,
    nearest_by_distance,
    nearest_by_odds,
    scans,
    swapped,
    truth,
)


@pytest.fixture(scope="module")
def run() -> Crossing:
    return crossing()


def test_global_nearest_neighbour_has_the_stated_error_and_swaps(run: Crossing) -> None:
    means = nearest_by_distance(run)
    each = gospa(means).mean(axis=0)
    assert each.mean() == pytest.approx(0.753, abs=6e-4)  # stated: 0.753 +- 0.106
    assert each.std() / np.sqrt(SEEDS) == pytest.approx(0.106, abs=6e-4)
    assert swapped(means).sum() == 13  # 21.7 %


def test_joint_probabilistic_association_has_the_stated_error_and_swaps(run: Crossing) -> None:
    means, _ = joint(run)
    each = gospa(means).mean(axis=0)
    assert each.mean() == pytest.approx(0.624, abs=6e-4)  # stated: 0.624 +- 0.010
    assert each.std() / np.sqrt(SEEDS) == pytest.approx(0.010, abs=6e-4)
    assert swapped(means).sum() == 3  # 5.0 %


@pytest.mark.slow
def test_a_window_of_hypotheses_swaps_fewer_labels_than_the_nearest_neighbour() -> None:
    """Sign test at 1 % over the seeds in which one of the two swaps, of 200 other seeds."""
    run = crossing(range(SEEDS, SEEDS + 200))
    nearest = swapped(nearest_by_odds(run))
    several = swapped(multiple_hypotheses(run, keep=20, window=8))
    better, worse = (nearest & ~several).sum(), (several & ~nearest).sum()
    assert binomtest(int(better), int(better + worse), alternative="greater").pvalue < 0.01


def test_no_seed_depends_on_the_batch(run: Crossing) -> None:
    """Up to the number of columns, which the fullest scan of a batch decides."""
    batch, _ = joint(run)
    for seed in (0, 7):
        alone, _ = joint(crossing(range(seed, seed + 1)))
        np.testing.assert_allclose(alone[:, 0], batch[:, seed], rtol=1e-9, atol=1e-12)


class Soup:
    """Stone Soup's JPDA over one seed."""

    def __init__(self) -> None:
        pytest.importorskip("stonesoup")
        from stonesoup.dataassociator.probability import JPDA
        from stonesoup.hypothesiser.probability import PDAHypothesiser
        from stonesoup.models.measurement.linear import LinearGaussian
        from stonesoup.models.transition.linear import (
            CombinedLinearGaussianTransitionModel,
            ConstantVelocity,
        )
        from stonesoup.predictor.kalman import KalmanPredictor
        from stonesoup.updater.kalman import KalmanUpdater

        self.motion = CombinedLinearGaussianTransitionModel([ConstantVelocity(0.01)] * 2)
        self.model = LinearGaussian(4, (0, 2), 0.25 * np.eye(2))
        self.updater = KalmanUpdater(self.model)
        # Its odds are P_D N(z) / density and its miss is 1 - P_D P_G, as ours; its gate is closed
        # at the same quantile. Normalising each track's odds to one changes no joint event.
        self.associator = JPDA(
            PDAHypothesiser(
                KalmanPredictor(self.motion),
                self.updater,
                clutter_spatial_density=DENSITY,
                prob_detect=P_D,
                prob_gate=P_G,
            )
        )

    def run(self, seed: int) -> tuple[np.ndarray, list[np.ndarray]]:
        """Return means ``(T, 2, 4)`` and the association probabilities of each scan."""
        from stonesoup.types.detection import Detection
        from stonesoup.types.state import GaussianState
        from stonesoup.types.track import Track

        begin = datetime(2020, 1, 1)
        tracks = [
            Track([GaussianState(state[:, None], START_COV, timestamp=begin)])
            for state in truth()[0]
        ]
        means, probabilities = [truth()[0]], []
        for k, scan in enumerate(scans(seed)[1:], start=1):
            time = begin + timedelta(seconds=k)
            seen = [
                Detection(point[:, None], timestamp=time, measurement_model=self.model)
                for point in scan
            ]
            found = self.associator.associate(set(tracks), set(seen), time)
            rows = [self.append(track, found[track], seen, time) for track in tracks]
            probabilities.append(np.array(rows))
            means.append(np.array([np.ravel(track.state_vector) for track in tracks], dtype=float))
        return np.array(means), probabilities

    def append(self, track: Any, hypotheses: Any, seen: list[Any], time: datetime) -> np.ndarray:
        """Append the moments of a track's hypotheses, and return their probabilities."""
        from stonesoup.functions import gm_reduce_single
        from stonesoup.types.array import StateVectors
        from stonesoup.types.update import GaussianStateUpdate

        row = np.zeros(len(seen) + 1)
        parts, weights = [], []
        for one in hypotheses:
            column = 1 + [d is one.measurement for d in seen].index(True) if one else 0
            row[column] = float(one.probability)
            parts.append(self.updater.update(one) if one else one.prediction)
            weights.append(one.probability)
        mean, cov = gm_reduce_single(
            StateVectors([part.state_vector for part in parts]),
            np.stack([part.covar for part in parts], axis=2),
            np.asarray(weights),
        )
        track.append(GaussianStateUpdate(mean, cov, hypotheses, time))
        return row


@pytest.mark.slow
@pytest.mark.parametrize("seed", [0, 11])
def test_probabilities_are_stone_soups_along_a_whole_run(seed: int) -> None:
    expected, rows = Soup().run(seed)
    means, probabilities = joint(crossing(range(seed, seed + 1)))
    for ours, theirs in zip(probabilities, rows, strict=True):
        np.testing.assert_allclose(ours[0, :, : theirs.shape[1]], theirs, atol=1e-9)
        assert (ours[0, :, theirs.shape[1] :] == 0.0).all()
    np.testing.assert_allclose(means[:, 0], expected, rtol=1e-9, atol=1e-9)
