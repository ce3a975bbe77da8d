"""The law of the measurement variance: a function of a place and of what was sent.

Nature evaluates it at the true place. The UAV knows the law and its own beams, so it may evaluate
it at any place that it thinks possible.
"""

from __future__ import annotations

from dataclasses import dataclass

from echobeam.physics.aspect import Reflector
from echobeam.physics.bounds import Crb, effective_variance, measurement_variance
from echobeam.physics.coordinates import direction_of, distance_of
from echobeam.physics.echo import echo_snr
from echobeam.physics.planar import AntennaArray
from echobeam.values import Array, Transmission


@dataclass(frozen=True, slots=True)
class VarianceLaw:
    """Variance of angle, delay and Doppler of an echo, Eqs. (12)-(16), (20)-(23), (41).

    Attributes
    ----------
    transmitter, receiver
        The two arrays.
    rcs
        epsilon, the complex radar cross-section; the mean one of a target with a pattern.
    gain, noise
        G_m and sigma^2.
    bandwidth, pulse_length
        kappa, Hz, and iota, s.
    crb
        ``"paper"`` or ``"exact"``, see `echobeam.physics.bounds`.
    target
        Pattern of the cross-section over the aspect, at a place of the geometry; None for a
        constant one.
    """

    transmitter: AntennaArray
    receiver: AntennaArray
    rcs: complex
    gain: float
    noise: float
    bandwidth: float
    pulse_length: float
    crb: Crb
    target: Reflector | None = None

    def snr(self, sent: Transmission, place: Array, *, along: bool = False) -> Array:
        """Return the echo SNR ``(..., K)`` at places ``(..., K, A + 1)``, Eqs. (14), (16).

        With ``along`` it is computed for many states at once, which is faster for tens of them and
        the same but for rounding.
        """
        snr = echo_snr(
            sent,
            direction_of(place, self.transmitter.axes),
            distance_of(place, self.transmitter.axes),
            self.transmitter,
            rcs=self.rcs,
            gain=self.gain,
            noise=self.noise,
            along=along,
        )
        return snr if self.target is None else snr * self.target.relative(place)

    def variance(self, sent: Transmission, place: Array, snr: Array | None = None) -> Array:
        """Return the variance ``(..., K, A + 2)``: rad^2, s^2, Hz^2; infinite without an echo.

        Parameters
        ----------
        sent
            What is transmitted.
        place
            ``(..., K, A + 1)`` or more: where the object is, or is thought to be, see
            `echobeam.physics.coordinates`; NaN where there is none, which gives infinity.
        snr
            ``(..., K)``: the echo SNR there, if it is known already.
        """
        if snr is None:
            snr = self.snr(sent, place)
        bound = measurement_variance(
            sent,
            direction_of(place, self.transmitter.axes),
            snr,
            self.transmitter,
            self.receiver,
            crb=self.crb,
            bandwidth=self.bandwidth,
            pulse_length=self.pulse_length,
        )
        return effective_variance(bound, snr)
