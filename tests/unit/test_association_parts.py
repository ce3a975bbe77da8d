"""Clusters against SciPy's graph components, and prices against linear programmes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment, linprog
from scipy.sparse.csgraph import connected_components

from echobeam.tracking.association.clusters import clusters_of
from echobeam.tracking.association.prices import price_range

from ..joint_events import random_pairs


def components(possible: np.ndarray) -> set[tuple[tuple[int, ...], tuple[int, ...]]]:
    """Return tracks and detections of each component with at least one pair."""
    n_tracks = len(possible)
    graph = np.block(
        [
            [np.zeros((n_tracks, n_tracks), bool), possible],
            [possible.T, np.zeros((possible.shape[1],) * 2, bool)],
        ]
    )
    _, label = connected_components(graph, directed=False)
    found = set()
    for one in np.unique(label):
        nodes = np.flatnonzero(label == one)
        if len(nodes) > 1:
            tracks, detections = nodes[nodes < n_tracks], nodes[nodes >= n_tracks] - n_tracks
            found.add((tuple(tracks.tolist()), tuple(detections.tolist())))
    return found


@pytest.mark.parametrize("shape", [(1, 1), (4, 6), (16, 16), (9, 3), (0, 3), (3, 0)])
@pytest.mark.parametrize("share", [0.0, 0.05, 0.15, 0.6])
def test_clusters_are_the_components_of_the_graph(shape: tuple[int, int], share: float) -> None:
    possible = np.random.default_rng(1).random((40, *shape)) < share
    found: list[set[tuple[tuple[int, ...], tuple[int, ...]]]] = [set() for _ in range(40)]
    values = np.arange(possible.size, dtype=float).reshape(possible.shape)
    for clusters in clusters_of(possible):
        parts = clusters.pick(values)
        for scan, tracks, detections, part in zip(*clusters, parts, strict=True):
            one = tuple(tracks.tolist()), tuple(detections.tolist())
            assert one not in found[scan]
            found[scan].add(one)
            assert np.array_equal(part, values[scan][np.ix_(tracks, detections)])
    assert found == [components(scan) for scan in possible]


@pytest.mark.parametrize("share", [0.3, 1.0])
@pytest.mark.parametrize("shape", [(4, 4), (3, 6), (6, 3), (1, 5)])
def test_prices_are_the_ends_of_all_dual_solutions(shape: tuple[int, int], share: float) -> None:
    """Linear programmes: u, v >= 0, u_c + v_d >= gain, sum of both = best; least and most v."""
    pairs = random_pairs(np.random.default_rng(2), (8,), *shape, share)
    least, greatest = price_range(*pairs)
    n_tracks, n_detections = shape
    for one in range(8):
        gain = pairs.log_odds[one] - pairs.missed[one][:, None]
        useful = np.maximum(gain, 0.0)
        best = useful[linear_sum_assignment(useful, maximize=True)].sum()
        rows, limits = [], []
        for c, d in zip(*np.nonzero(gain > -np.inf), strict=True):
            rows.append(np.concatenate([-np.eye(n_tracks)[c], -np.eye(n_detections)[d]]))
            limits.append(-gain[c, d])
        rows.append(np.ones(n_tracks + n_detections))
        limits.append(best + 1e-9)
        aim = np.concatenate([np.zeros(n_tracks), np.ones(n_detections)])
        for sign, found in ((1, least[one]), (-1, greatest[one])):
            end = linprog(sign * aim, rows, limits)
            np.testing.assert_allclose(end.x[n_tracks:], found, atol=1e-6)


def test_no_pairs_have_no_prices() -> None:
    for shape in ((3, 0), (0, 3), (2, 2)):
        least, greatest = price_range(np.full((5, *shape), -np.inf), np.zeros((5, shape[0])))
        assert least.shape == greatest.shape == (5, shape[1])
        assert not least.any()
        assert not greatest.any()
