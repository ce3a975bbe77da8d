"""Global nearest neighbour: the one joint event with the largest weight.

Blackman and Popoli, Design and Analysis of Modern Tracking Systems, 1999, section 6.4.
"""

from __future__ import annotations

import numpy as np

from echobeam.tracking.association.pairs import Pairs, flattened
from echobeam.values import NOBODY, IntArray


def nearest(pairs: Pairs) -> IntArray:
    """Return the detection of each track in the most probable joint event, ``(..., C)``.

    `NOBODY` is a miss; so is a tie between a detection and a miss. Where the best detections of
    all tracks differ they are the answer; SciPy's assignment (Crouse, On implementing 2D
    rectangular assignment algorithms, IEEE Trans. AES 52(4), 2016) is for the other scans.

    Parameters
    ----------
    pairs
        Of a scan.
    """
    log_odds, missed, lead = flattened(pairs)
    n_tracks, n_detections = log_odds.shape[1:]
    gain = np.maximum(log_odds - missed[..., None], 0.0)
    if not gain.size:
        return np.full((*lead, n_tracks), NOBODY)
    best = gain.argmax(axis=-1)
    useful = np.take_along_axis(gain, best[..., None], axis=-1)[..., 0] > 0.0
    result = np.where(useful, best, NOBODY)
    taken = np.where(useful, best, n_detections + np.arange(n_tracks))
    taken.sort(axis=-1)
    contested = (taken[:, 1:] == taken[:, :-1]).any(axis=-1)
    if contested.any():
        from scipy.optimize import linear_sum_assignment

        problems, which = np.unique(gain[contested], axis=0, return_inverse=True)
        answers = np.full((len(problems), n_tracks), NOBODY)
        for problem, answer in zip(problems, answers, strict=True):
            track, detection = linear_sum_assignment(problem, maximize=True)
            answer[track] = np.where(problem[track, detection] > 0.0, detection, NOBODY)
        result[contested] = answers[which.reshape(-1)]
    return result.reshape(*lead, n_tracks)
