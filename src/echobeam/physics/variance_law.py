"""The law of the measurement variance: a function of a state and of what was sent.

Nature evaluates it at the true state. The UAV knows the law and its own beams, so it may evaluate
it at any state that it thinks possible.
"""

from __future__ import annotations

from dataclasses import dataclass

from echobeam.physics.array import LinearArray
from echobeam.physics.aspect import Reflector
from echobeam.physics.bounds import Crb, effective_variance, measurement_variance
from echobeam.physics.echo import echo_snr
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

    transmitter: LinearArray
    receiver: LinearArray
    rcs: complex
    gain: float
    noise: float
    bandwidth: float
    pulse_length: float
    crb: Crb
    target: Reflector | None = None

    def snr(self, sent: Transmission, state: Array, *, along: bool = False) -> Array:
        """Return the echo SNR ``(..., K)`` at states ``(..., K, 3)``, Eqs. (14), (16).

        With ``along`` it is computed for many states at once, which is faster for tens of them and
        the same but for rounding.
        """
        snr = echo_snr(
            sent,
            state[..., 0],
            state[..., 1],
            self.transmitter,
            rcs=self.rcs,
            gain=self.gain,
            noise=self.noise,
            along=along,
        )
        return snr if self.target is None else snr * self.target.relative(state)

    def variance(self, sent: Transmission, state: Array, snr: Array | None = None) -> Array:
        """Return the variance ``(..., K, 3)``: rad^2, s^2, Hz^2; infinite without an echo.

        Parameters
        ----------
        sent
            What is transmitted.
        state
            ``(..., K, 3)`` rad, m, m/s: where the object is, or is thought to be; NaN where
            there is none, which gives infinity.
        snr
            ``(..., K)``: the echo SNR there, if it is known already.
        """
        if snr is None:
            snr = self.snr(sent, state)
        bound = measurement_variance(
            sent,
            state[..., 0],
            snr,
            self.transmitter,
            self.receiver,
            crb=self.crb,
            bandwidth=self.bandwidth,
            pulse_length=self.pulse_length,
        )
        return effective_variance(bound, snr)
