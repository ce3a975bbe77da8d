"""The bound of a UAV that knows its height, against the information of all slots at once."""

import numpy as np
import pytest

import echobeam as eb
from echobeam.simulation.ground_bound import ground_bound
from echobeam.units import SPEED_OF_LIGHT


def seen(start, slot, uav, scenario):
    """Return angle, delay, Doppler in a slot for (x, v, b) in the first, complex-step ready."""
    x = start[0] + start[1] * slot * scenario.frame.slot
    depth = uav[2] + start[2]
    distance = np.sqrt(x * x + depth * depth)
    angle = np.pi / 2 - np.arctan(x / depth)
    closing = -start[1] * x / distance  # the UAV hovers
    carrier = scenario.radio.carrier
    return np.array(
        [angle, 2 * distance / SPEED_OF_LIGHT, 2 * carrier * closing / SPEED_OF_LIGHT], complex
    )


def test_the_recursion_is_the_information_of_all_slots_at_once():
    """Without process noise J = J_0 + sum_n D_n^T R_n^-1 D_n, D_n by complex steps."""
    scenario = eb.load_scenario("paper-single").replace(
        {"uav.speed": "0 m/s", "objects.0.angle": "60 deg", "objects.0.acceleration": 0.0}
    )
    result = eb.simulate(scenario, schemes=["water-filling"], trials=3, seed=1)
    bound = ground_bound(result, scenario, "water-filling")
    variance = result["true_var"].isel(scheme=0, object=0).transpose("trial", "slot", ...).values
    height = scenario.uav.height
    v = scenario.objects[0].velocity
    start = np.array([height / np.tan(np.radians(60.0)), v, 0.0])
    uav = result["uav_position"].values
    J = np.diag([0.0, 30.0**-2, scenario.uav.altitude_std**-2])
    step = 1e-20
    for slot in range(scenario.n_slots):
        D = np.stack(
            [
                seen(start + 1j * step * one, slot, uav[slot], scenario).imag / step
                for one in np.eye(3)
            ],
            axis=-1,
        )
        J = J + np.mean([D.T @ np.diag(1 / one[slot]) @ D for one in variance], axis=0)
        to_now = np.eye(3)
        to_now[0, 1] = slot * scenario.frame.slot
        x = start[0] + v * slot * scenario.frame.slot
        d = np.hypot(x, height)
        polar = np.array([[-height / d**2, 0, x / d**2], [x / d, 0, height / d], [0, 1, 0]])
        whole = polar @ to_now @ np.linalg.inv(J) @ to_now.T @ polar.T
        np.testing.assert_allclose(bound[slot, 0], np.sqrt(np.diag(whole)), rtol=1e-6)


def test_runs_that_the_bound_is_not_for_are_one_message():
    scenario = eb.load_scenario("paper-single").replace({"truth.process_noise": True})
    result = eb.simulate(scenario, schemes=["water-filling"], trials=1)
    with pytest.raises(eb.InputError, match="without process noise"):
        ground_bound(result, scenario, "water-filling")
