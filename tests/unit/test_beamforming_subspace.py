from __future__ import annotations

import numpy as np
import pytest

from echobeam.beamforming.subspace import (
    beam_subspace,
    real_steering,
    to_beams,
    to_coordinates,
)
from echobeam.physics.array import LinearArray


@pytest.mark.parametrize("n_tx", [1, 2, 3, 8, 31])
def test_real_coordinates_keep_every_pattern_and_power(n_tx: int) -> None:
    rng = np.random.default_rng(n_tx)
    beams = rng.normal(size=(4, n_tx)) + 1j * rng.normal(size=(4, n_tx))
    angles = rng.uniform(0, np.pi, 9)
    coordinates = to_coordinates(beams)
    np.testing.assert_allclose(to_beams(coordinates), beams, atol=1e-14)
    np.testing.assert_allclose(
        np.linalg.norm(coordinates, axis=1), np.linalg.norm(beams, axis=1), rtol=1e-14
    )
    real = real_steering(LinearArray(1).phase(angles), n_tx)
    assert real.dtype == float
    np.testing.assert_allclose(
        np.abs(coordinates @ real.T),
        np.abs(beams @ LinearArray(n_tx).steering(angles).conj().T),
        atol=1e-12,
    )
    np.testing.assert_allclose(np.sum(real**2, axis=1), n_tx, rtol=1e-13)


def _wide(n_tx: int = 24) -> tuple[np.ndarray, np.ndarray]:
    phases = np.linspace(1.1, 1.9, 200)
    channels = real_steering(np.array([0.4, 1.5]), n_tx)
    return phases, channels


def test_span_holds_the_cover_and_all_channels_in_few_dimensions() -> None:
    phases, channels = _wide()
    subspace = beam_subspace(channels, phases[0], phases[-1])
    vectors = np.concatenate([real_steering(phases, 24), channels])
    back = subspace.reduce(vectors) @ subspace.basis.T
    assert np.abs(back - vectors).max() < 1e-3
    assert int(subspace.dimension) < 14
    gram = subspace.basis.T @ subspace.basis
    np.testing.assert_allclose(gram, np.eye(len(gram)), atol=1e-12)


def test_last_direction_is_spare_orthogonal_to_all_that_matters() -> None:
    phases, channels = _wide()
    subspace = beam_subspace(channels, phases[0], phases[-1])
    vectors = np.concatenate([real_steering(phases, 24), channels])
    assert np.abs(subspace.reduce(vectors)[:, -1]).max() < 1e-3


def test_lifted_beams_have_exactly_the_reduced_pattern_and_power() -> None:
    phases, channels = _wide()
    subspace = beam_subspace(channels, phases[0], phases[-1])
    rng = np.random.default_rng(0)
    reduced = rng.normal(size=subspace.dimension) + 1j * rng.normal(size=subspace.dimension)
    beam = subspace.lift(reduced)
    assert np.linalg.norm(beam) == pytest.approx(np.linalg.norm(reduced), rel=1e-13)
    cover = real_steering(phases, 24)
    np.testing.assert_allclose(
        np.abs(to_coordinates(beam) @ cover.T),
        np.abs(subspace.reduce(cover) @ reduced),
        rtol=1e-9,
        atol=1e-12,
    )


def test_projection_keeps_power_and_what_the_objects_see() -> None:
    phases, channels = _wide()
    subspace = beam_subspace(channels, phases[0], phases[-1])
    rng = np.random.default_rng(1)
    beam = rng.normal(size=24) + 1j * rng.normal(size=24)
    reduced = subspace.project(beam)
    assert np.linalg.norm(reduced) == pytest.approx(np.linalg.norm(beam), rel=1e-12)
    np.testing.assert_allclose(
        np.abs(subspace.reduce(channels) @ reduced),
        np.abs(channels @ to_coordinates(beam)),
        rtol=1e-4,
    )


def test_members_of_a_batch_span_what_they_span_alone() -> None:
    channels = real_steering(np.array([[0.4, 1.5], [2.0, 2.1]]), 16)
    low, high = np.array([0.3, 1.9]), np.array([0.31, 2.6])
    both = beam_subspace(channels, low, high)
    assert both.dimension[0] < both.dimension[1]
    for t in range(2):
        alone = beam_subspace(channels[t], low[t], high[t])
        used = both.basis[t][:, : both.dimension[t]]
        assert both.dimension[t] == alone.dimension
        # The spare direction is not unique; the span is.
        np.testing.assert_allclose(
            used[:, :-1] @ used[:, :-1].T, alone.basis[:, :-1] @ alone.basis[:, :-1].T, atol=1e-7
        )


def test_whole_space_is_never_exceeded() -> None:
    channels = real_steering(np.linspace(-3, 3, 12), 5)
    subspace = beam_subspace(channels, -3.0, 3.0)
    assert int(subspace.dimension) == 5
