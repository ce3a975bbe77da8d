"""The planar array against its elements, one by one."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

import echobeam as eb
from echobeam.physics.array import ArrayError, LinearArray
from echobeam.physics.planar import PlanarArray

SIZES = [(1, 1), (1, 5), (5, 1), (2, 3), (4, 4), (3, 7)]
DIRECTIONS = [(0.0, 0.0), (0.3, -0.4), (-0.7, 0.1), (0.0, 1.0), (-1.0, 0.0)]


def _element(array: PlanarArray, number: int, u: float, v: float) -> complex:
    """Response of one element: number i columns + j stands i steps along u and j along v."""
    i, j = number // array.columns, number % array.columns
    phase = 2.0 * np.pi * array.spacing * (i * u + j * v)
    return complex(np.cos(phase), np.sin(phase))


def _random(rng: np.random.Generator, *shape: int) -> np.ndarray:
    return np.asarray(rng.normal(size=shape) + 1j * rng.normal(size=shape))


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("spacing", [0.5, 0.37])
def test_steering_is_the_phase_of_every_element(size: tuple[int, int], spacing: float) -> None:
    array = PlanarArray(*size, spacing)
    found = array.steering(DIRECTIONS)
    assert found.shape == (len(DIRECTIONS), size[0] * size[1])
    for row, (u, v) in zip(found, DIRECTIONS, strict=True):
        expected = [_element(array, number, u, v) for number in range(array.elements)]
        np.testing.assert_allclose(row, expected, atol=1e-12)


def test_a_row_follows_v_and_a_column_follows_u() -> None:
    array = PlanarArray(3, 4)
    steered = array.steering([0.2, 0.5]).reshape(3, 4)
    np.testing.assert_allclose(steered[:, 1:] / steered[:, :-1], np.exp(1j * np.pi * 0.5))
    np.testing.assert_allclose(steered[1:] / steered[:-1], np.exp(1j * np.pi * 0.2))


def test_phases_are_the_steps_between_rows_and_between_columns() -> None:
    found = PlanarArray(3, 4, 0.25).phases([[0.2, -0.6], [1.0, 0.0]])
    np.testing.assert_allclose(found, 0.5 * np.pi * np.array([[0.2, -0.6], [1.0, 0.0]]))


@pytest.mark.parametrize("size", SIZES)
def test_pattern_of_one_polarisation_is_that_of_the_steering_vectors(
    size: tuple[int, int],
) -> None:
    array, rng = PlanarArray(*size, 0.45), np.random.default_rng(0)
    beam = _random(rng, array.elements)
    found = array.pattern(beam, np.array(DIRECTIONS))
    for power, (u, v) in zip(found, DIRECTIONS, strict=True):
        response = sum(
            _element(array, number, u, v).conjugate() * beam[number]
            for number in range(array.elements)
        )
        assert power == pytest.approx(abs(response) ** 2, rel=1e-10)


def test_pattern_of_two_polarisations_is_the_sum_of_theirs_one_after_the_other() -> None:
    one, both = PlanarArray(3, 4), PlanarArray(3, 4, polarisations=2)
    beam = _random(np.random.default_rng(1), 24)
    found = both.pattern(beam, np.array(DIRECTIONS))
    first = one.pattern(beam[:12], np.array(DIRECTIONS))
    second = one.pattern(beam[12:], np.array(DIRECTIONS))
    np.testing.assert_allclose(found, first + second, rtol=1e-12)
    steered = one.steering(DIRECTIONS).conj()
    expected = np.abs(steered @ beam[:12]) ** 2 + np.abs(steered @ beam[12:]) ** 2
    np.testing.assert_allclose(found, expected, rtol=1e-12)


@pytest.mark.parametrize("polarisations", [1, 2])
def test_patterns_of_many_beams_are_those_of_each(polarisations: int) -> None:
    array, rng = PlanarArray(2, 5, polarisations=polarisations), np.random.default_rng(2)
    beams = _random(rng, 3, 4, array.n)
    directions = rng.uniform(-0.6, 0.6, (3, 4, 7, 2))
    found = array.pattern(beams, directions)
    assert found.shape == (3, 4, 7)
    for t in range(3):
        for k in range(4):
            alone = array.pattern(beams[t, k], directions[t, k])
            np.testing.assert_allclose(found[t, k], alone, rtol=1e-12)


def test_no_beam_of_unit_power_has_more_gain_than_the_elements() -> None:
    for polarisations in (1, 2):
        array = PlanarArray(4, 3, polarisations=polarisations)
        matched = np.tile(array.steering([0.3, 0.2]), polarisations)
        matched /= np.linalg.norm(matched)
        gain = array.pattern(matched, np.array([[0.3, 0.2]]))
        np.testing.assert_allclose(gain, array.elements, rtol=1e-12)


@pytest.mark.parametrize("n", [1, 2, 7, 16])
@pytest.mark.parametrize("spacing", [0.5, 0.8])
def test_an_array_of_one_row_is_a_linear_array_with_v_the_sine(n: int, spacing: float) -> None:
    planar, linear = PlanarArray(1, n, spacing), LinearArray(n, spacing)
    angles = np.linspace(-1.4, 1.4, 9)
    for u in (0.0, 0.3):  # one row tells nothing about u
        directions = np.stack([np.full(9, u), np.sin(angles)], axis=-1)
        np.testing.assert_allclose(planar.steering(directions), linear.steering(angles), atol=1e-12)
        beam = _random(np.random.default_rng(n), n)
        np.testing.assert_allclose(
            planar.pattern(beam, directions), linear.pattern(beam, angles), rtol=1e-9, atol=1e-12
        )
    assert planar.shape == linear.shape
    assert planar.elements == linear.elements == planar.n == linear.n
    np.testing.assert_allclose(planar.phases(directions)[:, 1:], linear.phases(angles))


def test_an_array_of_one_column_is_a_linear_array_with_u_the_sine() -> None:
    angles = np.linspace(-1.4, 1.4, 9)
    directions = np.stack([np.sin(angles), np.full(9, 0.4)], axis=-1)
    np.testing.assert_allclose(
        PlanarArray(6, 1).steering(directions), LinearArray(6).steering(angles), atol=1e-12
    )


def test_turning_the_array_swaps_rows_and_columns() -> None:
    rng = np.random.default_rng(3)
    direction = rng.uniform(-0.7, 0.7, 2)
    steered = PlanarArray(3, 5).steering(direction).reshape(3, 5)
    turned = PlanarArray(5, 3).steering(direction[::-1]).reshape(5, 3)
    np.testing.assert_allclose(turned, steered.T, atol=1e-12)


@pytest.mark.parametrize("polarisations", [1, 2])
def test_sizes_are_those_of_elements_and_weights(polarisations: int) -> None:
    array = PlanarArray(3, 5, polarisations=polarisations)
    assert array.shape == (3, 5)
    assert array.elements == 15
    assert array.n == 15 * polarisations
    assert array.axes == 2


@pytest.mark.parametrize(
    ("values", "named"),
    [
        ({"rows": 0}, "rows"),
        ({"rows": 2.0}, "rows"),
        ({"rows": True}, "rows"),
        ({"rows": "4"}, "rows"),
        ({"columns": -3}, "columns"),
        ({"columns": None}, "columns"),
        ({"spacing": 0.0}, "spacing"),
        ({"spacing": -0.5}, "spacing"),
        ({"spacing": float("nan")}, "spacing"),
        ({"spacing": float("inf")}, "spacing"),
        ({"spacing": "half"}, "spacing"),
        ({"spacing": True}, "spacing"),
        ({"polarisations": 0}, "polarisations"),
        ({"polarisations": 3}, "polarisations"),
        ({"polarisations": True}, "polarisations"),
        ({"polarisations": 2.0}, "polarisations"),
        ({"polarisations": "2"}, "polarisations"),
    ],
)
def test_an_array_that_cannot_be_built_is_refused(values: dict[str, Any], named: str) -> None:
    with pytest.raises(ArrayError, match=named) as refused:
        PlanarArray(**{"rows": 4, "columns": 4, **values})
    assert ";" not in str(refused.value)


def test_all_faults_are_named_at_once() -> None:
    with pytest.raises(ArrayError) as refused:
        PlanarArray(0, -1, 0.0, 3)
    for name in ("rows", "columns", "spacing", "polarisations"):
        assert name in str(refused.value)
    assert isinstance(refused.value, ValueError)


def test_whole_numbers_of_numpy_are_taken() -> None:
    assert PlanarArray(np.int64(4), np.int32(3)).elements == 12  # type: ignore[arg-type]


def test_arrays_are_values() -> None:
    array = PlanarArray(4, 3, 0.4, 2)
    again = pickle.loads(pickle.dumps(array))
    assert again == array
    assert hash(again) == hash(array) == hash(PlanarArray(4, 3, 0.4, 2))
    others = [PlanarArray(3, 4, 0.4, 2), PlanarArray(4, 3, 0.5, 2), PlanarArray(4, 3, 0.4)]
    assert len({array, again, *others}) == 4
    with pytest.raises(AttributeError):
        array.rows = 5  # type: ignore[misc]
    assert eb.PlanarArray is PlanarArray
