"""The uniform planar array as a value: steering vectors and patterns in direction cosines."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from echobeam.numerals import whole
from echobeam.physics.array import (
    ArrayError,
    LinearArray,
    count_faults,
    half_power_phase,
    spacing_faults,
)
from echobeam.values import Array, BoolArray, ComplexArray


@dataclass(frozen=True, slots=True)
class PlanarArray:
    """Uniform planar array of ``rows x columns`` elements.

    A direction is a pair of direction cosines (u, v), of the angles to the axis along which rows
    are counted and to the one along which columns are. Element (i, j), number
    ``i columns + j``, has the phase 2 pi spacing (i u + j v): Eq. (4) in two dimensions.

    Attributes
    ----------
    rows, columns
        Numbers of elements along the two axes.
    spacing
        Distance between neighbours in wavelengths, along both axes.
    polarisations
        1, or 2: every element sends in two orthogonal polarisations, each with weights of its own,
        and a receiver takes the power of both. A beam is then the weights of the first
        polarisation followed by those of the second.

    Raises
    ------
    ArrayError
        If there is no such array.
    """

    rows: int
    columns: int
    spacing: float = 0.5
    polarisations: int = 1

    def __post_init__(self) -> None:
        faults = count_faults("rows", self.rows) + count_faults("columns", self.columns)
        faults += spacing_faults(self.spacing)
        if whole(self.polarisations) not in (1, 2):
            faults.append(f"polarisations must be 1 or 2, not {self.polarisations!r}")
        if faults:
            raise ArrayError("; ".join(faults))
        for name in ("rows", "columns", "polarisations"):
            object.__setattr__(self, name, whole(getattr(self, name)))
        object.__setattr__(self, "spacing", float(self.spacing))

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        return self.rows, self.columns

    @property
    def elements(self) -> int:
        """Number of elements: the largest gain of a beam of unit power."""
        return self.rows * self.columns

    @property
    def n(self) -> int:
        """Number of weights of a beam: elements times polarisations."""
        return self.elements * self.polarisations

    @property
    def axes(self) -> int:
        """Number of components of a direction."""
        return 2

    def phases(self, direction: npt.ArrayLike) -> Array:
        """Return the phase steps between neighbouring rows and columns, ``(..., 2)`` rad.

        Parameters
        ----------
        direction
            ``(..., 2)``: direction cosines (u, v).
        """
        steps: Array = 2.0 * np.pi * self.spacing * np.asarray(direction, dtype=np.float64)
        return steps

    def steering(self, direction: npt.ArrayLike) -> ComplexArray:
        """Return the steering vector of the elements, ``(..., rows columns)``, of modulus 1 each.

        Parameters
        ----------
        direction
            ``(..., 2)``: direction cosines (u, v).
        """
        along_rows, along_columns = self._turns(direction)
        vector = along_rows[..., :, np.newaxis] * along_columns[..., np.newaxis, :]
        steering: ComplexArray = vector.reshape(*vector.shape[:-2], self.elements)
        return steering

    def derivative(self, direction: npt.ArrayLike) -> ComplexArray:
        """Return da/du and da/dv, ``(..., 2, rows columns)``: j 2 pi spacing (i or j) a."""
        rows, columns = np.divmod(np.arange(self.elements), self.columns)
        rate = 2.0 * np.pi * self.spacing * np.stack([rows, columns])
        derivative: ComplexArray = 1j * rate * self.steering(direction)[..., np.newaxis, :]
        return derivative

    def far_field(self, wavelength: float) -> float:
        """Return the Fraunhofer distance 2 D^2 / lambda, m, D the diagonal of the array."""
        sides = ((count - 1) * self.spacing for count in self.shape)
        return 2.0 * sum(side * side for side in sides) * wavelength

    @property
    def half_power_widths(self) -> tuple[float, float]:
        """Widths of a matched beam between its half-power points along u and v, 2 at most."""
        step = np.pi * self.spacing
        u, v = (min(half_power_phase(count) / step, 2.0) for count in self.shape)
        return u, v

    def pattern(self, beams: ComplexArray, direction: npt.ArrayLike) -> Array:
        """Return the power of beams in many directions, sum over polarisations of |a^H w|^2.

        Parameters
        ----------
        beams
            ``(..., n)``, sqrt(power).
        direction
            ``(..., J, 2)``: the directions of each beam.

        Returns
        -------
        Array
            ``(..., J)``, power.
        """
        along_rows, along_columns = self._turns(direction)
        weights = beams.reshape(*beams.shape[:-1], self.polarisations, *self.shape)
        # (..., 1, J, rows) @ (..., P, rows, columns), then the columns' phases
        partial = np.conj(along_rows)[..., np.newaxis, :, :] @ weights
        response = np.sum(partial * np.conj(along_columns)[..., np.newaxis, :, :], axis=-1)
        pattern: Array = np.sum(response.real**2 + response.imag**2, axis=-2)
        return pattern

    def _turns(self, direction: npt.ArrayLike) -> tuple[ComplexArray, ComplexArray]:
        """Return exp(j phase) of every row, ``(..., rows)``, and of every column."""
        steps = self.phases(direction)
        rows = np.exp(1j * steps[..., :1] * np.arange(self.rows))
        columns = np.exp(1j * steps[..., 1:] * np.arange(self.columns))
        return rows, columns


AntennaArray = LinearArray | PlanarArray
"""Arrays that beams are designed for: centro-symmetric, with elements on a lattice."""


def linear(array: AntennaArray) -> LinearArray:
    """Return a linear array, for what is made for one alone."""
    assert isinstance(array, LinearArray)
    return array


def absent(direction: npt.ArrayLike, array: AntennaArray) -> BoolArray:
    """Return where there is no direction: a NaN, in any of its components."""
    missing: BoolArray = np.isnan(np.asarray(direction, dtype=np.float64))
    return missing if array.axes == 1 else np.asarray(missing.any(axis=-1))


def by_polarisation(values: ComplexArray, array: AntennaArray) -> ComplexArray:
    """Return weights ``(..., C, n)`` as those of each polarisation in turn, ``(..., C P, N)``."""
    streams = values.shape[-2] * array.polarisations
    return values.reshape(*values.shape[:-2], streams, array.elements)
