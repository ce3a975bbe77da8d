"""Beliefs of many trials about where their objects are: the input of the expected design."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from echobeam.brief import Brief
from echobeam.faults import InputError
from echobeam.physics.planar import AntennaArray
from echobeam.values import Array, BoolArray, ComplexArray, IntArray

NEAREST = 0.1
"""Part of the mean distance below which no node is: a linear law of the distance may pass zero."""

MOST_SNR = 1e12

LEAST, MOST = 1e-24, 1e24
"""Range of noise over gain at which numbers are sure to stay numbers."""


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class BeliefBatch(Brief):
    """Gaussian beliefs about K objects in T trials, one power and one array.

    Attributes
    ----------
    angles, deviation
        ``(T, K)`` rad: mean and standard deviation of the angle; anything where not ``active``.
        With a planar array ``(T, K, 2)`` direction cosines, and ``(T, K, 2, 2)``: the principal
        axes of their covariance by row, each as long as its standard deviation.
    loss
        ``(T, K)``: noise over path gain at the mean distance, sigma_C^2 d^2 / alpha0^2.
    stretch
        ``(T, K)`` 1/rad: relative change of the mean distance with the angle,
        cov(theta, d) / (var(theta) d); with a planar array ``(T, K, 2)``, C^-1 cov((u, v), d) / d
        with C the covariance of the cosines. What is left of the distance's variance is neglected:
        it changes no direction, and the loss only by its square relative to d^2.
    active
        ``(T, K)``: the objects that get a beam.
    min_rate
        ``(K,)`` bit/s/Hz: Gamma_k of (38e), to be met with probability 1 - ``outage``.
    outage
        Probability with which a floor may be missed, between 0 and 1.
    power
        P_T.
    array
        The transmit array. With two polarisations a beam has rank two where that is better.
    least_snr
        SNR of a matched beam with all the power that shapes are designed for at least; zero for
        the objective as it is, see `echobeam.beamforming.expected.caution`. Cautious beams have
        one polarisation.
    warm_start
        ``(T, K, N)`` complex: beams to start from, NaN where there are none.

    Raises
    ------
    InputError
        If power or outage are out of their range.
    """

    angles: Array
    deviation: Array
    loss: Array
    stretch: Array
    active: BoolArray
    min_rate: Array
    power: float
    array: AntennaArray
    outage: float = 0.05
    least_snr: float = 0.0
    warm_start: ComplexArray | None = None

    def __post_init__(self) -> None:
        if not (self.power > 0.0 and np.isfinite(self.power)):
            raise InputError(f"power: {self.power!r} is not accepted; expected a positive number")
        check_outage(self.outage)
        check_least_snr(self.least_snr)

    def __len__(self) -> int:
        """T."""
        return int(self.angles.shape[0])

    def taken(self, trials: IntArray) -> BeliefBatch:
        """Return some of the trials, in the order given."""
        warm = self.warm_start
        return replace(
            self,
            angles=self.angles[trials],
            deviation=self.deviation[trials],
            loss=self.loss[trials],
            stretch=self.stretch[trials],
            active=self.active[trials],
            warm_start=None if warm is None else warm[trials],
        )

    def arranged(self, columns: IntArray) -> BeliefBatch:
        """Return some of the objects of each trial, ``(T, J)``; floors must be the same for all."""

        def some(values: Array) -> Array:
            return values[np.arange(len(values))[:, None], columns]

        warm = self.warm_start
        return replace(
            self,
            angles=some(self.angles),
            deviation=some(self.deviation),
            loss=some(self.loss),
            stretch=some(self.stretch),
            active=np.take_along_axis(self.active, columns, axis=1),
            min_rate=self.min_rate[: columns.shape[1]],
            warm_start=None
            if warm is None
            else np.take_along_axis(warm, columns[..., None], axis=1),
        )

    @property
    def sound(self) -> BoolArray:
        """``(T, K)``: active objects whose numbers make a problem, not those of a lost track."""
        with np.errstate(invalid="ignore", over="ignore"):
            ratio = self.loss / (self.power * self.array.elements)
            fits = (ratio >= LEAST) & (ratio <= MOST)
            if self.array.axes == 1:
                fits &= self.deviation >= 0.0
        numbers = [self.angles, self.deviation, self.stretch]
        finite = [np.isfinite(each).all(axis=tuple(range(2, each.ndim))) for each in numbers]
        good: BoolArray = self.active & fits & np.all(finite, axis=0)
        return good


def check_outage(outage: float) -> None:
    """Refuse a probability that is none.

    Raises
    ------
    InputError
        If ``outage`` is not between 0 and 1.
    """
    if not 0.0 < outage < 1.0:
        raise InputError(f"outage: {outage!r} is not accepted; expected a number between 0 and 1")


def check_least_snr(snr: float) -> None:
    """Refuse what is no SNR to design for.

    Raises
    ------
    InputError
        If ``snr`` is negative or beyond 1e12.
    """
    if not 0.0 <= snr <= MOST_SNR:
        raise InputError(f"least_snr: {snr!r} is not accepted; expected a number from 0 to 1e12")
