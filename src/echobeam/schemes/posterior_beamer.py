"""The beamer that maximises the expected sum rate over the belief."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from echobeam.beamforming.expected.beliefs import BeliefBatch, check_least_snr, check_outage
from echobeam.beamforming.expected.design import design_expected
from echobeam.physics.coordinates import cover_shape
from echobeam.physics.plane import GroundGeometry
from echobeam.schemes.base import View
from echobeam.schemes.beamers import Aim, Beams, Target
from echobeam.schemes.cosine_beliefs import cosine_belief
from echobeam.values import Array, Tracks

WIDEST = np.pi / 4
"""rad: standard deviation of the angle beyond which no belief is taken any wider."""


@dataclass(frozen=True, slots=True)
class PosteriorBeamer:
    """Beams of the largest expected sum rate over the belief of each object's direction.

    The belief is Gaussian, the track's mean and variance of the angle (on the ground those of the
    two direction cosines), and the distance follows
    the angle as far as the track's covariance says. Narrow beliefs give matched beams that heed
    the interference, wide ones a cover whose width nobody has to choose; ``covered`` is NaN, since
    none is designed for.

    Attributes
    ----------
    aim
        The belief that the beams are made from.
    outage
        Probability with which ``coverage.min_rate``, Gamma_k of (38e), may be missed.
    least_snr
        SNR of a matched beam that shapes are designed for at least. Zero: the expected rate of
        this slot, and nothing else. About 100: no part of a wide belief is left dark, so that the
        echo tells the next slots where the object is.
    """

    parameters: ClassVar[tuple[str, ...]] = ("min_rate",)

    aim: Target = "prior"
    outage: float = 0.05
    least_snr: float = 0.0

    def __post_init__(self) -> None:
        check_outage(self.outage)
        check_least_snr(self.least_snr)

    def beliefs(self, aim: Aim, view: View) -> BeliefBatch:
        """Return the beliefs of a slot, started from the last slot's beams."""
        tracks, system = getattr(aim, self.aim), view.system
        active = tracks.known & aim.active[:, None]
        geometry = system.geometry
        if isinstance(geometry, GroundGeometry):
            belief = cosine_belief(tracks, geometry, view.uav)
            mean, deviation, stretch = belief.mean, belief.axes, belief.stretch
            distance = belief.distance
            active &= np.isfinite(distance)
        else:
            mean, distance = tracks.mean[..., 0], tracks.mean[..., 1]
            deviation, stretch = belief_of(tracks)
        return BeliefBatch(
            angles=mean,
            deviation=deviation,
            loss=system.loss(distance, aim.share),
            stretch=stretch,
            active=active,
            min_rate=np.full(active.shape[-1], system.coverage.min_rate),
            power=system.radio.power,
            array=system.transmitter,
            outage=self.outage,
            least_snr=self.least_snr,
            warm_start=view.memory,
        )

    def beams(self, aim: Aim, view: View) -> Beams:
        """Return the beams of the trials that send some in this slot."""
        answer = design_expected(self.beliefs(aim, view))
        kept = np.full_like(answer.beams, np.nan) if view.memory is None else view.memory
        return Beams(
            answer.beams,
            np.full((*answer.beams.shape[:2], *cover_shape(view.system.geometry.axes)), np.nan),
            answer.fallback,
            answer.messages,
            np.where(aim.active[:, None, None], answer.beams, kept),
        )


def belief_of(tracks: Tracks) -> tuple[Array, Array]:
    """Return the standard deviation of the angle, rad, and how the distance follows it, 1/rad.

    Parameters
    ----------
    tracks
        ``(T, C)`` tracks in (angle, distance, velocity).

    Returns
    -------
    deviation, stretch
        ``(T, C)``: sqrt(var(theta)), at most 45 degrees, and cov(theta, d) / (var(theta) d), by
        which the mean distance changes with the angle; NaN where there is no track.
    """
    variance = np.maximum(tracks.cov[..., 0, 0], 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = tracks.cov[..., 0, 1] / variance / tracks.mean[..., 1]
    stretch = np.where(np.isfinite(slope), slope, 0.0)  # no variance, or no end of it
    return np.minimum(np.sqrt(variance), WIDEST), stretch
