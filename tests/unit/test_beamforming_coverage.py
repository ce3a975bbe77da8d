from __future__ import annotations

import numpy as np
import pytest

from echobeam.beamforming.coverage import coverage_grid, coverage_steps, sparse_cover
from echobeam.physics.array import LinearArray

DEG = np.pi / 180.0


@pytest.mark.parametrize(
    ("halfwidth", "steps"),
    [(0.0, 0), (0.05, 1), (0.1, 1), (0.1001, 2), (0.3, 3), (2.99, 30), (3.0, 30), (3.00001, 31)],
)
def test_grid_is_rounded_outward_and_whole_multiples_are_not(halfwidth: float, steps: int) -> None:
    assert coverage_steps(np.array(halfwidth * DEG), 0.1 * DEG) == steps


def test_a_multiple_that_rounding_has_spoilt_by_less_than_1e_9_is_whole() -> None:
    resolution = 0.1 * DEG
    assert coverage_steps(np.array(3 * resolution * (1 + 2e-10)), resolution) == 3
    assert coverage_steps(np.array(3 * resolution * (1 + 1e-8)), resolution) == 4


def test_grid_angles_are_centre_plus_multiples_and_the_mask_tells_whose() -> None:
    angles = np.array([60.0, 90.0]) * DEG
    grid, mask = coverage_grid(angles, np.array([0.25, 0.1]) * DEG, 0.1 * DEG)
    np.testing.assert_allclose(
        grid[0] / DEG, [59.7, 59.8, 59.9, 60.0, 60.1, 60.2, 60.3], rtol=0, atol=1e-12
    )
    np.testing.assert_allclose(grid[1, mask[1]] / DEG, [89.9, 90.0, 90.1], rtol=0, atol=1e-12)
    assert mask.sum(axis=1).tolist() == [7, 3]
    assert np.all(grid[1, ~mask[1]] == angles[1])


def test_batches_have_the_grids_of_their_members() -> None:
    angles = np.array([[1.0, 1.2], [0.7, 2.0]])
    halfwidths = np.array([[0.02, 0.05], [0.0, 0.11]])
    grid, mask = coverage_grid(angles, halfwidths, 0.01)
    for t in range(2):
        for k in range(2):
            alone, _ = coverage_grid(angles[t, k], halfwidths[t, k], 0.01)
            np.testing.assert_array_equal(grid[t, k, mask[t, k]], alone)


def test_sparse_cover_keeps_ends_and_turning_point_and_leaves_no_wide_gap() -> None:
    grid, mask = coverage_grid(np.array([1.4]), np.array([0.5]), 0.1 * DEG)
    phases = LinearArray(1).phase(grid)
    chosen = sparse_cover(phases, mask, 30)
    assert chosen[0, 0]
    assert chosen[0, -1]
    assert chosen[0, np.argmax(phases[0])]
    assert not np.any(chosen & ~mask)
    gaps = np.abs(np.diff(phases[0, chosen[0]]))
    finest = np.abs(np.diff(phases[0])).max()
    assert gaps.max() <= 2 * np.pi / (4 * 30) + finest
    assert chosen.sum() < mask.sum() / 4


def test_no_objects_have_an_empty_grid() -> None:
    grid, mask = coverage_grid(np.zeros(0), np.zeros(0), 0.1)
    assert grid.shape == mask.shape == (0, 1)
