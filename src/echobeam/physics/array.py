"""The uniform linear array as a value: steering vectors, derivatives, responses, Eq. (4)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, assert_never

import numpy as np
import numpy.typing as npt

from echobeam.faults import InputError
from echobeam.numerals import whole
from echobeam.physics.angles import exact_cosine, exact_sine
from echobeam.values import Array, Axis, ComplexArray


class ArrayError(InputError):
    """An array that cannot be built; the message names every fault."""


def count_faults(name: str, number: Any) -> list[str]:
    """Return the fault of a number of elements, if it is none."""
    count = whole(number)
    if count is not None and count >= 1:
        return []
    return [f"{name} must be a whole number from 1, not {number!r}"]


def spacing_faults(spacing: Any) -> list[str]:
    """Return the fault of a distance between elements, if it is none."""
    try:
        positive = math.isfinite(spacing) and spacing > 0 and not isinstance(spacing, bool)
    except (TypeError, OverflowError):
        positive = False
    message = f"spacing must be a positive number of wavelengths, not {spacing!r}"
    return [] if positive else [message]


@dataclass(frozen=True, slots=True)
class LinearArray:
    """Uniform linear array of ``n`` elements.

    Attributes
    ----------
    n
        Number of elements.
    spacing
        Distance between neighbours in wavelengths, Delta d / lambda.
    axis
        ``"vertical"``: the phase follows sin(theta), as in the paper, so that ``theta`` and
        ``pi - theta`` are one direction (an object ahead and its mirror image behind);
        ``"horizontal"``: it follows cos(theta), and ``theta`` and ``-theta`` are one (the ground
        and the sky).

    Raises
    ------
    ArrayError
        If there is no such array.
    """

    n: int
    spacing: float = 0.5
    axis: Axis = "vertical"

    def __post_init__(self) -> None:
        faults = count_faults("n", self.n) + spacing_faults(self.spacing)
        if self.axis not in ("vertical", "horizontal"):
            faults.append(f"axis must be 'vertical' or 'horizontal', not {self.axis!r}")
        if faults:
            raise ArrayError("; ".join(faults))
        object.__setattr__(self, "n", whole(self.n))
        object.__setattr__(self, "spacing", float(self.spacing))

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns: one row."""
        return 1, self.n

    @property
    def elements(self) -> int:
        """Number of elements: the largest gain of a beam of unit power."""
        return self.n

    @property
    def polarisations(self) -> int:
        """One: a beam of one column is as good as any, see `docs/beam-design.md`."""
        return 1

    @property
    def axes(self) -> int:
        """Number of components of a direction."""
        return 1

    @property
    def visible(self) -> tuple[float, float]:
        """Range of u for angles from 0 to 180 degrees; upright, both sides are one."""
        return (0.0, 1.0) if self.axis == "vertical" else (-1.0, 1.0)

    def frequency(self, theta: npt.ArrayLike) -> Array:
        """Return the direction as the array sees it: u in the phase 2 pi spacing m u of Eq. (4).

        Parameters
        ----------
        theta
            ``(...)`` rad: depression angle from the road's direction.

        Returns
        -------
        Array
            ``(...)``, sin(theta) or cos(theta) by `axis`; NaN where ``theta`` is.
        """
        angle = np.asarray(theta, dtype=np.float64)
        match self.axis:
            case "vertical":
                u: Array = np.sin(angle)
            case "horizontal":
                u = np.cos(angle)
            case _:
                assert_never(self.axis)
        return u

    def slope(self, theta: npt.ArrayLike) -> Array:
        """Return du/dtheta of `frequency`, ``(...)``: cos(theta) or -sin(theta).

        Exactly zero where the array is blind to small changes of the angle: 90 degrees for the
        vertical axis, 0 and 180 for the horizontal one.
        """
        match self.axis:
            case "vertical":
                return exact_cosine(theta)
            case "horizontal":
                return -exact_sine(theta)
            case _:
                assert_never(self.axis)

    def phase(self, theta: npt.ArrayLike) -> Array:
        """Return the phase step between neighbouring elements, ``(...)`` rad: 2 pi spacing u."""
        step: Array = 2.0 * np.pi * self.spacing * self.frequency(theta)
        return step

    def phases(self, theta: npt.ArrayLike) -> Array:
        """Return `phase` with an axis for the array's one dimension, ``(..., 1)`` rad."""
        steps: Array = self.phase(theta)[..., np.newaxis]
        return steps

    def steering(self, theta: npt.ArrayLike) -> ComplexArray:
        """Return the steering vector a(theta) of Eq. (4): exp(j 2 pi spacing m u), m = 0 .. n - 1.

        Parameters
        ----------
        theta
            ``(...)`` rad.

        Returns
        -------
        ComplexArray
            ``(..., n)``, each entry of modulus 1; NaN where ``theta`` is.
        """
        phase = self._rate() * self.frequency(theta)[..., np.newaxis]
        vector = np.empty(phase.shape, dtype=np.complex128)
        np.cos(phase, out=vector.real)  # several times faster than the complex exponential
        np.sin(phase, out=vector.imag)
        return vector

    def derivative(self, theta: npt.ArrayLike) -> ComplexArray:
        """Return da/dtheta, ``(..., n)`` 1/rad: j 2 pi spacing m (du/dtheta) a(theta), Eq. (4)."""
        phase_slope = self._rate() * self.slope(theta)[..., np.newaxis]
        derivative: ComplexArray = 1j * phase_slope * self.steering(theta)
        return derivative

    def response(self, beams: ComplexArray, theta: npt.ArrayLike) -> ComplexArray:
        """Return the response of beams in many directions, a(theta)^H w with a of Eq. (4).

        The response is a polynomial in exp(-j 2 pi spacing u). It is evaluated in blocks of about
        sqrt(n) coefficients, so that few exponentials have to be taken.

        Parameters
        ----------
        beams
            ``(..., n)``, sqrt(power).
        theta
            ``(..., J)`` rad: the directions of each beam.

        Returns
        -------
        ComplexArray
            ``(..., J)``, sqrt(power); NaN where ``theta`` is.
        """
        block = math.isqrt(self.n - 1) + 1
        blocks = -(-self.n // block)
        rate = -self.phase(theta)
        within = _powers(rate, block)
        across = _powers(block * rate, blocks)
        padded = np.zeros((*beams.shape[:-1], blocks * block), dtype=np.complex128)
        padded[..., : self.n] = beams
        coefficients = padded.reshape(*beams.shape[:-1], blocks, block)
        response: ComplexArray = np.einsum(
            "...jq,...jq->...j", within @ np.swapaxes(coefficients, -1, -2), across
        )
        return response

    def pattern(self, beams: ComplexArray, theta: npt.ArrayLike) -> Array:
        """Return |a(theta)^H w|^2, ``(..., J)``: the power of `response`."""
        response = self.response(beams, theta)
        pattern: Array = response.real**2 + response.imag**2
        return pattern

    def far_field(self, wavelength: float) -> float:
        """Return the Fraunhofer distance 2 D^2 / lambda, m, from which waves are taken as plane.

        Parameters
        ----------
        wavelength
            lambda, m. D = (n - 1) spacing lambda is the length of the array, so that Eq. (4)
            holds beyond 2 (n - 1)^2 spacing^2 lambda.
        """
        length = (self.n - 1) * self.spacing
        return 2.0 * length * length * wavelength

    def half_power_width(self, theta: npt.ArrayLike) -> Array:
        """Return the width of the matched beam between its half-power angles, ``(...)`` rad.

        The main lobe ends where |sin(n x / 2) / (n sin(x / 2))|^2 = 1 / 2, x the difference in
        phase step. Around the array's axis the lobe folds over, and its two halves are one.

        Parameters
        ----------
        theta
            ``(...)`` rad: where the beam points; NaN gives NaN.

        Returns
        -------
        Array
            ``(...)`` rad, 2 pi where the lobe has no end, as for a single element.
        """
        u = np.abs(self.frequency(theta))  # both directions of the axis are alike
        reach = half_power_phase(self.n) / (2.0 * np.pi * self.spacing)
        low = np.arcsin(np.maximum(u - reach, -1.0))
        folded = u + reach >= 1.0
        width: Array = np.where(folded, np.pi - low, np.arcsin(np.minimum(u + reach, 1.0))) - low
        return width

    def _rate(self) -> Array:
        rate: Array = 2.0 * np.pi * self.spacing * np.arange(self.n, dtype=np.float64)
        return rate


def _powers(phase: Array, count: int) -> ComplexArray:
    """Return exp(j phase)^m, m = 0 .. count - 1, on a new last axis."""
    turns = np.empty((*phase.shape, count), dtype=np.complex128)
    turns[..., 0] = 1.0
    turns[..., 1:] = np.exp(1j * phase)[..., np.newaxis]
    return np.cumprod(turns, axis=-1, out=turns)


def half_power_phase(n: int) -> float:
    """Return the difference in phase step, rad, at which ``n`` elements lose half their power."""
    if n == 1:
        return math.inf
    inside, outside = 0.0, 2.0 * math.pi / n  # the first zero
    for _ in range(60):  # bisection, down to the spacing of doubles
        middle = 0.5 * (inside + outside)
        amplitude = math.sin(n * middle / 2.0) / (n * math.sin(middle / 2.0))
        inside, outside = (middle, outside) if amplitude**2 > 0.5 else (inside, middle)
    return inside
