"""Reduction of a beam to few real coordinates: steering vectors, span, and the spare direction."""

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
from echobeam.physics.planar import AntennaArray, PlanarArray

DISC = np.random.default_rng(0).uniform(-0.5, 0.5, (9, 2))


@pytest.mark.parametrize(
    "array",
    [*map(LinearArray, [1, 2, 3, 8, 31]), PlanarArray(1, 4), PlanarArray(4, 6), PlanarArray(3, 5)],
    ids=str,
)
def test_real_coordinates_keep_every_pattern_and_power(array: AntennaArray) -> None:
    n_tx = array.elements
    rng = np.random.default_rng(n_tx)
    beams = rng.normal(size=(4, n_tx)) + 1j * rng.normal(size=(4, n_tx))
    directions = rng.uniform(0, np.pi, 9) if array.axes == 1 else DISC
    coordinates = to_coordinates(beams)
    np.testing.assert_allclose(to_beams(coordinates), beams, atol=1e-14)
    np.testing.assert_allclose(
        np.linalg.norm(coordinates, axis=1), np.linalg.norm(beams, axis=1), rtol=1e-14
    )
    real = real_steering(array.phases(directions), array.shape)
    assert real.dtype == float
    np.testing.assert_allclose(
        np.abs(coordinates @ real.T),
        np.abs(beams @ array.steering(directions).conj().T),
        atol=1e-12,
    )
    np.testing.assert_allclose(np.sum(real**2, axis=1), n_tx, rtol=1e-13)


def _linear() -> tuple[np.ndarray, np.ndarray]:
    """Objects and a cover of 24 antennas, by the phase between neighbours."""
    cover = real_steering(np.linspace(1.1, 1.9, 200)[:, np.newaxis], (1, 24))
    return real_steering(np.array([[0.4], [1.5]]), (1, 24)), cover


def _planar() -> tuple[np.ndarray, np.ndarray]:
    """Objects and a cover of 7 x 6 elements: a disc, and an object off it."""
    array = PlanarArray(7, 6)
    lattice = np.stack(np.meshgrid(*[np.linspace(-0.1, 0.1, 21)] * 2), axis=-1).reshape(-1, 2)
    disc = lattice[np.sum(lattice**2, axis=1) <= 0.01]
    cover = real_steering(array.phases(disc + np.array([0.2, -0.1])), array.shape)
    return real_steering(array.phases([[0.2, -0.1], [-0.4, 0.3]]), array.shape), cover


COVERS = {"linear": (_linear, 14), "planar": (_planar, 22)}
both = pytest.mark.parametrize("kind", COVERS)


@both
def test_span_holds_the_cover_and_all_channels_in_few_dimensions(kind: str) -> None:
    scene, most = COVERS[kind]
    channels, cover = scene()
    basis = beam_subspace(channels, cover)
    vectors = np.concatenate([cover, channels])
    back = vectors @ basis @ basis.T
    assert np.abs(back - vectors).max() < 1e-3
    assert basis.shape[1] < most
    np.testing.assert_allclose(basis.T @ basis, np.eye(basis.shape[1]), atol=1e-12)


@both
def test_last_direction_is_spare_orthogonal_to_all_that_matters(kind: str) -> None:
    channels, cover = COVERS[kind][0]()
    basis = beam_subspace(channels, cover)
    vectors = np.concatenate([cover, channels])
    assert np.abs(vectors @ basis[:, -1]).max() < 1e-3
    # All others are needed: each of them is heard by something.
    assert np.abs(vectors @ basis[:, :-1]).max(axis=0).min() > 1e-6


@both
def test_beams_have_exactly_the_reduced_pattern_and_power(kind: str) -> None:
    channels, cover = COVERS[kind][0]()
    basis = beam_subspace(channels, cover)
    rng = np.random.default_rng(0)
    reduced = rng.normal(size=basis.shape[1]) + 1j * rng.normal(size=basis.shape[1])
    beam = to_beams(basis @ reduced)
    assert np.linalg.norm(beam) == pytest.approx(np.linalg.norm(reduced), rel=1e-13)
    np.testing.assert_allclose(
        np.abs(to_coordinates(beam) @ cover.T),
        np.abs(cover @ basis @ reduced),
        rtol=1e-9,
        atol=1e-12,
    )


@both
def test_any_beam_is_heard_as_its_part_in_the_span_and_the_rest_of_its_power_can_be_kept(
    kind: str,
) -> None:
    channels, cover = COVERS[kind][0]()
    basis = beam_subspace(channels, cover)
    n_tx = len(basis)
    rng = np.random.default_rng(1)
    beam = rng.normal(size=n_tx) + 1j * rng.normal(size=n_tx)
    coordinates = to_coordinates(beam)
    reduced = basis.T @ coordinates
    lost = np.linalg.norm(coordinates) ** 2 - np.linalg.norm(reduced[:-1]) ** 2
    reduced[-1] = np.sqrt(lost)
    assert np.linalg.norm(reduced) == pytest.approx(np.linalg.norm(beam), rel=1e-12)
    for vectors in (channels, cover):
        # The span leaves out what is below 1e-5 of its largest singular value.
        np.testing.assert_allclose(
            np.abs(vectors @ basis @ reduced), np.abs(vectors @ coordinates), rtol=1e-4, atol=1e-2
        )


def test_a_cover_counts_alike_however_many_points_it_has() -> None:
    channels, cover = _linear()
    few, many = beam_subspace(channels, cover[::4]), beam_subspace(channels, np.repeat(cover, 9, 0))
    once = beam_subspace(channels, cover)
    assert few.shape == once.shape == many.shape
    # The spare direction is not unique; the span is.
    np.testing.assert_allclose(
        many[:, :-1] @ many[:, :-1].T, once[:, :-1] @ once[:, :-1].T, atol=1e-7
    )


def test_whole_space_is_never_exceeded() -> None:
    channels = real_steering(np.linspace(-3, 3, 12)[:, np.newaxis], (1, 5))
    cover = real_steering(np.linspace(-3, 3, 50)[:, np.newaxis], (1, 5))
    basis = beam_subspace(channels, cover)
    assert basis.shape == (5, 5)
    np.testing.assert_allclose(basis @ basis.T, np.eye(5), atol=1e-12)
