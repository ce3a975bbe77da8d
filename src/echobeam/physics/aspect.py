"""Aspect of a target: the direction to the UAV in the target's frame, from geometry and heading.

Cross-sections relative to their mean are what the laws of the echo need: |epsilon|^2 of the paper
is that of the mean cross-section.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from echobeam.physics.targets import Target
from echobeam.values import Array


class Reflector(Protocol):
    """Target in a geometry of places."""

    def relative(self, place: Array) -> Array:
        """Return the cross-section over its mean, ``(...)``, at places ``(..., P)``."""


def aspect(sight: Array, heading: Array) -> tuple[Array, Array]:
    """Return zenith and azimuth ``(...)`` rad of the UAV in the frame of an object on the ground.

    The frame's vertical is the ground's; azimuths count to the left of the heading.

    Parameters
    ----------
    sight
        ``(..., 3)``: vector from the UAV to the object, of any length but zero.
    heading
        ``(..., 3)``: vector along the object's direction of travel, whose horizontal part counts;
        where that is zero the azimuth is NaN.
    """
    zenith = np.arctan2(np.hypot(sight[..., 0], sight[..., 1]), -sight[..., 2])
    ahead = -(sight[..., 0] * heading[..., 0] + sight[..., 1] * heading[..., 1])
    left = sight[..., 0] * heading[..., 1] - sight[..., 1] * heading[..., 0]
    rests = (heading[..., 0] == 0.0) & (heading[..., 1] == 0.0)
    return zenith, np.where(rests, np.nan, np.arctan2(left, ahead))


@dataclass(frozen=True, slots=True)
class OnRoad:
    """Target on the road below the UAV, which is ahead of it or behind it.

    Attributes
    ----------
    target
        The target.
    """

    target: Target

    def relative(self, place: Array) -> Array:
        """Return the cross-section over its mean, ``(...)``, for states ``(..., 3)``.

        A velocity of zero is no heading: the direction on the road is not known, and the mean of
        front and back is taken.
        """
        zenith, azimuth = road_aspect(place)
        known = self.target.relative(zenith, azimuth)
        if not self.target.directional or not (place[..., 2] == 0.0).any():
            return known
        ends = [self.target.relative(zenith, end) for end in (0.0, np.pi)]
        return np.where(place[..., 2] == 0.0, 0.5 * (ends[0] + ends[1]), known)


def road_aspect(place: Array) -> tuple[Array, Array]:
    """Return zenith and azimuth ``(...)`` rad of the UAV for states ``(..., 3)`` on the road.

    Parameters
    ----------
    place
        Angle, distance, and velocity along the road, whose sign is the heading.
    """
    theta, velocity = place[..., 0], place[..., 2]
    zero = np.zeros_like(theta)
    sight = np.stack([np.cos(theta), zero, -np.sin(theta)], axis=-1)
    return aspect(sight, np.stack([velocity, zero, zero], axis=-1))


AZIMUTHS = np.arange(-np.pi, np.pi, np.pi / 36.0)
"""Azimuths, rad, over which the cross-section of a target of unknown heading is averaged: in steps
of 5 degrees the mean is right to 0.03 dB, in steps of 15 it is 2 dB off for the lobes of a UAV."""


@dataclass(frozen=True, slots=True)
class OnGround:
    """Target on the ground in two dimensions.

    Attributes
    ----------
    target
        The target.
    """

    target: Target

    def relative(self, place: Array) -> Array:
        """Return the cross-section over its mean, ``(...)``, for places ``(..., 8)``.

        They end in the line of sight and the velocity along x and y. A velocity of zero is no
        heading: the mean over all of them is taken.
        """
        heading = np.concatenate([place[..., 6:8], np.zeros_like(place[..., :1])], axis=-1)
        zenith, azimuth = aspect(place[..., 3:6], heading)
        known = self.target.relative(zenith, azimuth)
        rests = (place[..., 6:8] == 0.0).all(axis=-1)
        if not self.target.directional or not rests.any():
            return known
        around = self.target.relative(zenith[rests][:, None], AZIMUTHS)
        known[rests] = around.mean(axis=-1)
        return known
