"""Steering vectors against complex step, explicit phases and the folding of the sine."""

from __future__ import annotations

import cmath
import math
import pickle

import numpy as np
import pytest

from echobeam.faults import InputError
from echobeam.physics.angles import exact_cosine, exact_sine
from echobeam.physics.array import ArrayError, LinearArray

ANGLES = np.radians([0.0, 10.0, 45.0, 75.0, 90.0, 135.0, 180.0])


@pytest.mark.parametrize(("axis", "project"), [("vertical", math.sin), ("horizontal", math.cos)])
@pytest.mark.parametrize("spacing", [0.5, 0.3])
def test_steering_vector_is_the_phase_of_each_antennas_extra_path(axis, project, spacing):
    a = LinearArray(6, spacing, axis).steering(ANGLES)
    expected = [
        [cmath.exp(2j * math.pi * spacing * m * project(angle)) for m in range(6)]
        for angle in ANGLES
    ]
    np.testing.assert_allclose(a, expected, rtol=0, atol=1e-14)


@pytest.mark.parametrize(("axis", "project"), [("vertical", np.sin), ("horizontal", np.cos)])
def test_derivative_agrees_with_complex_step(axis, project):
    step, positions = 1e-30, np.arange(8)
    phase = 2 * np.pi * 0.4 * positions * project(ANGLES + 1j * step)[:, None]
    by_parts = np.imag(np.cos(phase)) / step + 1j * np.imag(np.sin(phase)) / step
    derivative = LinearArray(8, 0.4, axis).derivative(ANGLES)
    np.testing.assert_allclose(derivative, by_parts, rtol=1e-13, atol=1e-13)


def test_far_field_begins_where_the_edge_lags_a_sixteenth_of_a_wavelength():
    # a spherical wave from R arrives D^2 / (8 R) later at the edge than at the middle
    array, wavelength = LinearArray(256, 0.5), 299792458 / 28e9
    half = (256 - 1) * 0.5 * wavelength / 2
    start = array.far_field(wavelength)
    assert start == pytest.approx(348, abs=1)
    assert math.hypot(start, half) - start == pytest.approx(wavelength / 16, rel=1e-4)
    assert LinearArray(1).far_field(wavelength) == 0


def test_vertical_array_cannot_tell_ahead_from_behind():
    np.testing.assert_allclose(
        LinearArray(30).steering(ANGLES), LinearArray(30).steering(np.pi - ANGLES), atol=1e-13
    )


def test_horizontal_array_can_tell_ahead_from_behind():
    a = LinearArray(30, axis="horizontal").steering(math.radians(75))
    b = LinearArray(30, axis="horizontal").steering(math.radians(105))
    assert abs(np.vdot(a, b)) / 30 < 0.1


def test_asymptotic_orthogonality_is_as_weak_as_a_dirichlet_kernel_says():
    # |sin(N x) / (N sin x)|, x = pi spacing (sin t1 - sin t2): 0.0305 and 0.126 at N = 30
    for first, second, rounded in [(75, 135, 0.0305), (45, 120, 0.126)]:
        a, b = LinearArray(30).steering(np.radians([first, second]))
        x = math.pi * 0.5 * (math.sin(math.radians(first)) - math.sin(math.radians(second)))
        kernel = abs(math.sin(30 * x) / (30 * math.sin(x)))
        assert abs(np.vdot(a, b)) / 30 == pytest.approx(kernel, rel=1e-12)
        assert kernel == pytest.approx(rounded, abs=5e-4)


def test_slope_is_exactly_zero_where_the_array_is_blind():
    assert LinearArray(1).slope(np.pi / 2) == 0.0
    assert LinearArray(1, axis="horizontal").slope(np.pi) == 0.0
    assert np.all(LinearArray(5).derivative(np.pi / 2) == 0.0)
    assert LinearArray(1).slope(np.pi / 2 - 1e-15) > 0.0


def test_exact_functions_are_sine_and_cosine_elsewhere():
    np.testing.assert_array_equal(exact_cosine(ANGLES[:4]), np.cos(ANGLES[:4]))
    np.testing.assert_array_equal(exact_sine(ANGLES[:6]), np.sin(ANGLES[:6]))
    assert exact_cosine(-np.pi / 2) == 0.0
    assert exact_sine(-np.pi) == 0.0


def test_single_antenna_sees_every_direction_alike():
    np.testing.assert_array_equal(LinearArray(1).steering(ANGLES), np.ones((7, 1)))
    np.testing.assert_array_equal(LinearArray(1).derivative(ANGLES), np.zeros((7, 1)))


def test_absent_object_gives_nan_and_leaves_the_others():
    theta = np.array([0.3, np.nan, 1.2])
    a = LinearArray(4).steering(theta)
    assert np.isnan(a[1]).all()
    np.testing.assert_array_equal(a[[0, 2]], LinearArray(4).steering(theta[[0, 2]]))


def test_no_objects_and_any_leading_axes():
    assert LinearArray(4).steering(np.zeros((3, 0))).shape == (3, 0, 4)
    assert LinearArray(4).derivative(np.zeros((2, 3, 5))).shape == (2, 3, 5, 4)
    assert LinearArray(1).frequency(0.3).shape == ()


@pytest.mark.parametrize("axis", ["vertical", "horizontal"])
@pytest.mark.parametrize("n", [1, 2, 3, 16, 17, 30, 128])
def test_response_is_the_product_with_the_steering_vector(n, axis):
    rng = np.random.default_rng(n)
    beams = rng.standard_normal((2, 3, n)) + 1j * rng.standard_normal((2, 3, n))
    theta = rng.uniform(-np.pi, np.pi, (2, 3, 5))
    steering = LinearArray(n, 0.7, axis).steering(theta)
    expected = np.einsum("...jn,...n->...j", np.conj(steering), beams)
    response = LinearArray(n, 0.7, axis).response(beams, theta)
    np.testing.assert_allclose(response, expected, rtol=0, atol=1e-13 * n)


def test_response_is_not_a_number_where_the_direction_is_not():
    response = LinearArray(4).response(np.ones(4, dtype=complex), np.array([0.5, np.nan]))
    assert np.isfinite(response[0])
    assert np.isnan(response[1])


@pytest.mark.parametrize(("axis", "project"), [("vertical", np.sin), ("horizontal", np.cos)])
def test_phase_is_the_step_from_one_element_to_the_next(axis, project):
    array = LinearArray(4, 0.3, axis)
    expected = 2 * np.pi * 0.3 * project(ANGLES)
    np.testing.assert_allclose(array.phase(ANGLES), expected, rtol=1e-15, atol=1e-16)
    np.testing.assert_array_equal(array.frequency(ANGLES), project(ANGLES))
    steps = array.steering(ANGLES)[:, 1:] / array.steering(ANGLES)[:, :-1]
    np.testing.assert_allclose(steps, np.exp(1j * expected)[:, None] * np.ones(3), rtol=1e-14)


@pytest.mark.parametrize("axis", ["vertical", "horizontal"])
def test_slope_is_the_complex_step_of_the_frequency(axis):
    project = np.sin if axis == "vertical" else np.cos
    expected = project(ANGLES + 1e-30j).imag / 1e-30
    np.testing.assert_allclose(LinearArray(2, axis=axis).slope(ANGLES), expected, atol=2e-16)


@pytest.mark.parametrize("n", [0, -3, 2.5, 4.0, True, "4", None, np.float64(3.0)])
def test_number_of_elements_is_a_whole_number_from_one(n):
    with pytest.raises(ArrayError) as fault:
        LinearArray(n)
    assert str(fault.value) == f"n must be a whole number from 1, not {n!r}"


@pytest.mark.parametrize(
    "spacing", [0, 0.0, -0.5, math.nan, math.inf, -math.inf, "x", None, 1j, True, 10**400]
)
def test_spacing_is_a_positive_number(spacing):
    with pytest.raises(ArrayError) as fault:
        LinearArray(4, spacing)
    assert str(fault.value) == f"spacing must be a positive number of wavelengths, not {spacing!r}"


@pytest.mark.parametrize("axis", ["up", "Vertical", "", None, 1])
def test_axis_is_one_of_two(axis):
    with pytest.raises(ArrayError) as fault:
        LinearArray(4, axis=axis)
    assert str(fault.value) == f"axis must be 'vertical' or 'horizontal', not {axis!r}"


def test_every_fault_of_an_array_is_reported_together():
    with pytest.raises(InputError) as fault:
        LinearArray(0, math.nan, "up")
    said = str(fault.value).split("; ")
    assert [part.split()[0] for part in said] == ["n", "spacing", "axis"]
    assert all(part.endswith(value) for part, value in zip(said, ["0", "nan", "'up'"], strict=True))


@pytest.mark.parametrize("n", [1, np.int64(1), np.uint8(1)])
def test_smallest_array_and_numpys_whole_numbers_are_accepted(n):
    assert LinearArray(n, np.float64(1e-9)).steering(0.3).shape == (1,)


def test_arrays_are_values_that_can_be_compared_hashed_and_pickled():
    array = LinearArray(8, 0.4, "horizontal")
    assert len({array, LinearArray(8, 0.4, "horizontal"), LinearArray(np.int64(8), 0.4)}) == 2
    assert array not in {LinearArray(9, 0.4, "horizontal"), LinearArray(8, 0.5, "horizontal")}
    copy = pickle.loads(pickle.dumps(array))
    assert copy == array
    assert hash(copy) == hash(array)
    np.testing.assert_array_equal(copy.steering(ANGLES), array.steering(ANGLES))


@pytest.mark.parametrize(("n", "spacing"), [(2, 0.5), (8, 0.4), (30, 0.5), (64, 0.5)])
@pytest.mark.parametrize("axis", ["vertical", "horizontal"])
@pytest.mark.parametrize("degrees", [1.0, 60.0, 90.0, 135.0])
def test_half_power_width_is_where_the_pattern_has_fallen_to_half(n, spacing, axis, degrees):
    """Walked out from the beam's centre on a fine grid, explicit phases."""
    array, centre = LinearArray(n, spacing, axis), math.radians(degrees)
    offset = np.linspace(0.0, math.pi, 400_001)
    project = np.sin if axis == "vertical" else np.cos
    sides = 0.0
    for sign in (1, -1):
        phase = math.pi * spacing * (project(centre + sign * offset) - project(centre))
        with np.errstate(invalid="ignore"):
            gain = np.where(phase == 0, 1, (np.sin(n * phase) / (n * np.sin(phase))) ** 2)
        sides += offset[np.argmax(gain < 0.5)] if (gain < 0.5).any() else math.pi
    assert float(array.half_power_width(centre)) == pytest.approx(sides, abs=2e-5)


def test_half_power_width_of_a_long_array_is_0_886_over_its_length():
    width = LinearArray(1000, 0.5, "horizontal").half_power_width(math.pi / 2)
    assert float(width) == pytest.approx(0.886 / 500, rel=1e-3)
    assert float(LinearArray(1).half_power_width(1.0)) == pytest.approx(2 * math.pi)
    assert np.isnan(LinearArray(8).half_power_width([math.nan]))
