"""Link budget of one slot with objects on the ground: SNRs, and accuracies of both cosines.

Powers and echoes are those of `link_budget`; a measurement has two direction cosines in place of
the angle, and tells a place on the ground together with the delay.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from echobeam.physics import transmission
from echobeam.physics.detection import DetectionLaw
from echobeam.physics.planar import PlanarArray
from echobeam.physics.plane import GroundGeometry
from echobeam.schemes.configure import detection_of
from echobeam.simulation.link_budget import Budget, Echo, downlinks, echo_of, omni_budget
from echobeam.simulation.world import World
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import Array, Transmission


@dataclass(frozen=True, slots=True, kw_only=True)
class GroundEcho(Echo):
    """Echo of one object on the ground, and the accuracy of its measurement.

    Attributes
    ----------
    cosine_std
        Standard deviations of u and v, infinite where nothing is measured.
    position_std
        Standard deviations of x and y from cosines and delay, at the known height, m.
    """

    cosine_std: tuple[float, float]
    position_std: tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class GroundBudget(Budget):
    """Downlink, with the gain of the elements, and echo of one object on the ground in one slot.

    Attributes
    ----------
    position, velocity
        x and y, m and m/s.
    cosines, distance
        u and v; m. An object behind the array has neither gain nor echo.
    beam_widths
        Half-power widths of the matched beam along u and v.
    """

    position: tuple[float, float]
    velocity: tuple[float, float]
    cosines: tuple[float, float]
    distance: float
    beam_widths: tuple[float, float]
    omni_echo: GroundEcho
    beam_echo: GroundEcho


def ground_budgets(world: World) -> tuple[GroundBudget, ...]:
    """Return the budgets of the objects on the ground present in a slot of one trial."""
    scenario, array = world.scene.scenario, world.scene.law.transmitter
    assert isinstance(array, PlanarArray)
    here, seen = np.flatnonzero(world.present), detection_of(scenario)
    state, place = world.state[0, here], world.place[0, here]
    omni = omni_budget(world)
    budgets = []
    for row, link in enumerate(downlinks(world)):
        alone, own = place[row : row + 1], state[row]
        beam = _matched(place[row, :2], scenario.radio.power, array)
        budgets.append(
            GroundBudget(
                position=_pair(own[:2]),
                velocity=_pair(own[2:4]),
                cosines=_pair(place[row, :2]),
                distance=0.5 * SPEED_OF_LIGHT * link["delay"],
                beam_widths=array.half_power_widths,
                omni_echo=_echo(world, omni, alone, own, seen),
                beam_echo=_echo(world, beam, alone, own, seen),
                **link,
            )
        )
    return tuple(budgets)


def _pair(values: Array) -> tuple[float, float]:
    return float(values[0]), float(values[1])


def _matched(cosines: Array, power: float, array: PlanarArray) -> Transmission:
    """Return the transmission of all power in the beam matched to a direction."""
    beam = np.zeros((1, array.n), dtype=complex)
    beam[0, : array.elements] = math.sqrt(power / array.elements) * array.steering(cosines)
    return transmission.directional(beam)


def _echo(
    world: World, sent: Transmission, place: Array, state: Array, seen: DetectionLaw
) -> GroundEcho:
    """Return the echo of an object at a place ``(1, 3)`` or more, in a state ``(4,)``."""
    fields, variance = echo_of(world, sent, place, seen)
    return GroundEcho(
        cosine_std=_pair(np.sqrt(variance[:2])),
        position_std=_position(world, state, variance[:3]),
        **fields,
    )


def _position(world: World, state: Array, variance: Array) -> tuple[float, float]:
    """Return the standard deviations of x and y: the inverse of the sum of information."""
    geometry, uav = world.scene.geometry, world.uav
    assert isinstance(geometry, GroundGeometry)
    slope = np.empty((3, 2))
    slope[:2] = geometry.cosine_jacobian(state[None], uav)[0]
    offset = state[:2] - uav.position[:2]
    distance = math.hypot(*offset, uav.position[2])
    slope[2] = 2.0 / SPEED_OF_LIGHT * offset / distance
    slope /= np.sqrt(variance)[:, None]  # no information where the variance is infinite
    information = slope.T @ slope
    # of eigenvalues apart by many orders: delay and cosines differ so
    _, values, axes = np.linalg.svd(slope)
    if not np.isfinite(information).all() or not values[-1] > 0.0:
        return math.inf, math.inf
    return _pair(np.sqrt(np.square(axes / values[:, None]).sum(axis=0)))
