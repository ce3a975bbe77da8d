"""Height of the ground under the objects, of which the UAV knows a mean and a deviation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from echobeam.scenario.model import Scenario
from echobeam.simulation.movers import Ground
from echobeam.simulation.randomness import Use, object_normals, trial_normals

ONCE = 0
"""Slot of the draws' key: a height is drawn once for a trial."""


def elevated(ground: Ground, scenario: Scenario, seed: int, trials: range) -> Ground:
    """Return the objects on the true ground.

    Heights are counted from where the UAV takes the ground to be. So its own altimeter's error,
    the same for all objects of a trial, raises or lowers the ground as well: an object is

        z_k = h - sigma_a n - sigma_t n_k

    high, with h of ``truth.terrain`` and standard normals n of the trial, n_k of the object. The
    components b of the tracker `ground` are their negatives if h is 0.

    Parameters
    ----------
    ground
        Objects on a flat ground, or as this function returned them in the slot before.
    scenario
        With ``truth.altitude_errors``, ``truth.terrain`` and the deviations of ``uav``.
    seed, trials
        Key of the draws.
    """
    truth, uav = scenario.truth, scenario.uav
    if not truth.altitude_errors and truth.terrain == 0.0:
        return ground
    height = np.full((1, ground.identity.size), truth.terrain)
    if truth.altitude_errors:
        own = trial_normals(seed, trials, ONCE, Use.ALTIMETER, (1,))
        each = object_normals(seed, trials, ONCE, Use.TERRAIN, ground.identity, 1)[..., 0]
        height = height - uav.altimeter_std * own - uav.terrain_std * each
    shape = (max(len(height), len(ground.position)), *ground.position.shape[1:])
    position = np.broadcast_to(ground.position, shape).copy()
    position[..., 2] = np.where(np.isnan(position[..., 0]), np.nan, height)
    return replace(ground, position=position, velocity=np.broadcast_to(ground.velocity, shape))
