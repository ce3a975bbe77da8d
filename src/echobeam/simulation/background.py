"""Background channel of a run with echo signals: static points, as scatterers of a slot."""

from __future__ import annotations

import numpy as np

from echobeam.physics.array import LinearArray
from echobeam.physics.background import DRAWS, POINTS, SURROUNDINGS, reference_points
from echobeam.physics.echo_signal import Scatterers
from echobeam.physics.plane import GroundGeometry
from echobeam.simulation.randomness import Use, trial_normals
from echobeam.simulation.world import World
from echobeam.units import SPEED_OF_LIGHT


def background(world: World, trials: range) -> Scatterers:
    """Return the reference points of some trials as the UAV sees them in this slot.

    They are drawn around the place where the UAV starts and stay there. An echo takes the way there
    and back, and its phase turns with it. The gain of 1 m of free space is alpha0^2, and the noise
    of the radar is as thermal as that of the downlink: sigma^2 for sigma_C^2.
    """
    scenario, law = world.scene.scenario, world.scene.law
    radio, radar = scenario.radio, scenario.radar
    start = world.scene.flight.at(0).position
    size = POINTS * DRAWS + 1
    normals = trial_normals(world.seed, trials, 0, Use.BACKGROUND, (size,))
    points = reference_points(
        SURROUNDINGS[radar.background],
        float(start[2]),
        radio.carrier,
        normals[:, -1],
        normals[:, :-1].reshape(len(trials), POINTS, DRAWS),
    )
    place = points.offset + np.array([start[0], start[1], 0.0])
    offset = place - world.uav.position
    distance = np.sqrt(np.sum(offset**2, axis=-1))
    closing = offset @ world.uav.velocity / distance
    delay, doppler = 2.0 / SPEED_OF_LIGHT * distance, 2.0 * radio.carrier / SPEED_OF_LIGHT * closing
    amplitude = points.amplitude * radio.alpha0 * np.sqrt(radar.noise / radio.noise)
    geometry = world.scene.geometry
    if isinstance(geometry, GroundGeometry):
        still = np.zeros_like(place[..., :2])
        seen = geometry.place(geometry.exact(place, still, world.uav), world.uav)
        direction = seen[..., :2]
        amplitude = amplitude * (distance / seen[..., 2]) ** 2  # none from behind the array
    else:
        receiver = law.receiver
        assert isinstance(receiver, LinearArray)
        down, along = -offset[..., 2] / distance, offset[..., 0] / distance
        vertical = receiver.axis == "vertical"
        direction = np.arcsin(down) if vertical else np.arccos(along)
    amplitude = amplitude * np.exp(-2j * np.pi * radio.carrier * delay)
    return Scatterers(direction, delay, doppler, amplitude)
