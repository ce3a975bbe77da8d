"""Statistics of a run, against loops over schemes, trials, slots and objects."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
import pytest

import echobeam as eb
from echobeam.estimation.intervals import quotient
from echobeam.simulation.statistics import (
    NEEDED,
    TRIAL,
    cover_centre,
    join,
    of_scheme,
    per_trial,
    rmse,
    statistics_of,
    sum_rate,
)
from echobeam.values import Mode

C = 299792458.0
NAMES = ("temporal", "temporal:centre=previous,min_rate=0.5", "genie")
SCENARIO = eb.load_scenario("paper-multi")
CARRIER = SCENARIO.radio.carrier
TRIALS, SLOTS, OBJECTS = 5, 6, 2


def made_up(trials=TRIALS, seed=0):
    """Arrays of a result with everything that may occur, and no physics behind them.

    Trials differ in mode, objects leave, tracks are lost, components are not measured, designs
    are missing; the last scheme has estimates without doubt.
    """
    rng = np.random.default_rng(seed)
    track = (len(NAMES), trials, SLOTS, OBJECTS)
    unit = np.array([0.05, 1.0, 5.0])
    truth = np.array([1.2, 110.0, 20.0]) + unit * rng.normal(size=(trials, SLOTS, OBJECTS, 3))
    root = unit[:, None] * (np.eye(3) + 0.2 * rng.normal(size=(*track, 3, 3)))
    arrays = {
        "truth": truth,
        "present": rng.random((trials, SLOTS, OBJECTS)) < 0.8,
        "uav_velocity": rng.normal([3.0, 0.0, -15.0], 2.0, size=(SLOTS, 3)) * [1.0, 0.0, 1.0],
        "mode": rng.choice([Mode.OMNI, Mode.DIRECTIONAL, Mode.PILOT], size=track[:3]),
        "covered": rng.uniform(0.0, 0.2, size=track),
        "predicted": truth + unit * rng.normal(size=(*track, 3)),
        "predicted_cov": root @ np.swapaxes(root, -1, -2),
        "estimated": truth + unit * rng.normal(size=(*track, 3)),
        "estimated_cov": 0.5 * root @ np.swapaxes(root, -1, -2),
        "rate": rng.exponential(0.5, size=track),
        "fallback": rng.random(track[:3]) < 0.3,
    }
    noise = np.array([0.02, 1e-8, 900.0])
    expected = [h(state, arrays["uav_velocity"][n]) for n, state in each_state(truth)]
    expected = np.reshape(expected, truth.shape)
    arrays["measured"] = expected + noise * rng.normal(size=(*track, 3))
    arrays["measured_var"] = noise**2 * rng.uniform(0.5, 2.0, size=(*track, 3))
    arrays["true_var"] = arrays["measured_var"] * rng.uniform(0.5, 2.0, size=(*track, 3))
    arrays["estimated"][0, :, :, :, 0] += 2 * np.pi  # a turn more is the same angle
    arrays["predicted"][0, :, :, :, 0] -= 2 * np.pi

    absent = ~arrays["present"]
    truth[absent] = np.nan
    arrays["rate"][:, absent] = np.nan
    for name in ("predicted", "estimated"):
        lost = rng.random(track) < 0.2  # of objects that have left too
        arrays[name][lost] = np.nan
        arrays[f"{name}_cov"][lost] = np.nan
    arrays["predicted_cov"][2] = arrays["estimated_cov"][2] = 0.0
    arrays["covered"][(rng.random(track) < 0.3) | absent] = np.nan
    unmeasured = (rng.random((*track, 3)) < 0.2) | absent[..., None]
    arrays["measured"][unmeasured] = np.nan
    for name in ("measured_var", "true_var"):
        arrays[name][unmeasured] = np.inf
    return arrays


def each_state(truth):
    return [(i[1], truth[i]) for i in np.ndindex(truth.shape[:-1])]


def h(state, velocity):
    """Angle, delay and Doppler of a state, from the geometry: the Doppler is that of -2 dd/dt."""
    angle, distance, speed = state
    line = np.array([np.cos(angle), -np.sin(angle)])  # from the UAV to the object: x and z
    relative = np.array([speed - velocity[0], -velocity[2]])
    return np.array([angle, 2 * distance / C, -2 * CARRIER / C * (line @ relative)])


def jacobian(state, velocity):
    """Of `h`, by complex steps."""
    step = 1e-30
    rows = [h(state + 1j * step * axis, velocity).imag / step for axis in np.eye(3)]
    return np.array(rows).T


def turned(angle):
    return np.arctan2(np.sin(angle), np.cos(angle))


def by_loops(arrays):
    """Every sum once more, one scheme, trial, slot and object at a time."""
    n_trials = len(arrays["truth"])
    found = defaultdict(lambda: np.zeros((len(NAMES), SLOTS)))
    found["sum_rate"] = np.zeros((len(NAMES), n_trials, SLOTS))
    found["fallback"] = np.zeros((len(NAMES), n_trials))
    for name in ("errors", "squares_angle", "squares_distance", "squares_velocity"):
        found[name] = np.zeros((len(NAMES), SLOTS, OBJECTS))
    floor = (SCENARIO.coverage.min_rate, 0.5, SCENARIO.coverage.min_rate)
    for i, t, n, k in np.ndindex(arrays["rate"].shape):
        truth, present = arrays["truth"][t, n, k], arrays["present"][t, n, k]
        estimate, cov = arrays["estimated"][i, t, n, k], arrays["estimated_cov"][i, t, n, k]
        prior, prior_cov = arrays["predicted"][i, t, n, k], arrays["predicted_cov"][i, t, n, k]
        if k == 0:
            found["fallback"][i, t] += arrays["fallback"][i, t, n]
        if present:
            found["there"][i, n] += 1
            found["known"][i, n] += np.isfinite(estimate[0])
            rate = arrays["rate"][i, t, n, k]
            found["sum_rate"][i, t, n] += rate
            if arrays["mode"][i, t, n] == Mode.DIRECTIONAL:
                found["served"][i, n] += 1
                found["below"][i, n] += rate < floor[i]
        if present and np.isfinite(estimate[0]):
            error = estimate - truth
            error[0] = turned(error[0])
            found["errors"][i, n, k] += 1
            for part, name in enumerate(("angle", "distance", "velocity")):
                found[f"squares_{name}"][i, n, k] += error[part] ** 2
            if cov.any():
                found["nees"][i, n] += error @ np.linalg.solve(cov, error)
                found["nees_count"][i, n] += 1
        if np.isfinite(prior[0]) and prior_cov.any():
            used = np.isfinite(arrays["measured"][i, t, n, k])
            if used.any():
                velocity = arrays["uav_velocity"][n]
                innovation = arrays["measured"][i, t, n, k] - h(prior, velocity)
                innovation[0] = turned(innovation[0])
                H = jacobian(prior, velocity)[used]
                R = np.diag(arrays["measured_var"][i, t, n, k][used])
                spread = H @ prior_cov @ H.T + R
                found["nis"][i, n] += innovation[used] @ np.linalg.solve(spread, innovation[used])
                found["nis_degrees"][i, n] += used.sum()
        before = arrays["estimated"][i, t, n - 1, k, 0] if n > 0 else np.nan
        choices = (before, prior[0]) if i == 1 else (prior[0], before)
        centre = next((angle for angle in choices if np.isfinite(angle)), None)
        if centre is not None and np.isfinite(arrays["covered"][i, t, n, k] + truth[0]):
            found["covered"][i, n] += 1
            inside = abs(turned(centre - truth[0])) <= arrays["covered"][i, t, n, k]
            found["inside"][i, n] += inside
    return found


@pytest.mark.parametrize("trials", [1, TRIALS])
def test_every_sum_is_that_of_a_loop(trials):
    arrays = made_up(trials)
    assert set(arrays) == set(NEEDED)
    figures = statistics_of(arrays, SCENARIO, NAMES)
    expected = by_loops(arrays)
    bound = {"information", "motion", "motion_square", "predictions", "estimates"}
    assert set(expected) == {name for name in figures if not name.startswith(TRIAL)} - bound
    for name, values in expected.items():
        np.testing.assert_allclose(figures[name], values, rtol=1e-8, err_msg=name)
        assert values.any(), f"{name} is never counted"


def test_sums_of_a_trial_are_those_of_a_loop_over_it():
    arrays = made_up(TRIALS)
    figures = statistics_of(arrays, SCENARIO, NAMES)
    for trial in range(TRIALS):
        own = {
            name: values
            if name == "uav_velocity"
            else np.take(values, [trial], axis=0 if name in ("truth", "present") else 1)
            for name, values in arrays.items()
        }
        for name, values in by_loops(own).items():
            if name not in ("sum_rate", "fallback"):
                slots = values[:, -1:] if name in ("known", "there") else values
                whole = slots.reshape(len(NAMES), -1).sum(axis=-1)
                found = figures[f"{TRIAL}{name}"][:, trial]
                np.testing.assert_allclose(found, whole, rtol=1e-8, atol=1e-15, err_msg=name)


def test_the_information_is_that_of_the_variances_nature_drew_with():
    arrays = made_up()
    found = statistics_of(arrays, SCENARIO, NAMES)["information"]
    expected = np.zeros((len(NAMES), SLOTS, OBJECTS, 3, 3))
    for i, t, n, k in np.ndindex(arrays["rate"].shape):
        if arrays["present"][t, n, k]:
            H = jacobian(arrays["truth"][t, n, k], arrays["uav_velocity"][n])
            expected[i, n, k] += H.T @ np.diag(1 / arrays["true_var"][i, t, n, k]) @ H
    scale = np.sqrt(np.einsum("...ii->...i", expected))
    unit = scale[..., :, None] * scale[..., None, :]
    unit[unit == 0] = 1.0
    np.testing.assert_allclose(found / unit, expected / unit, rtol=1e-9, atol=1e-12)


def test_statistics_of_blocks_come_to_those_of_the_run():
    arrays = made_up()
    on_trials = {"truth", "present"}

    def some(cut):
        return {
            name: values
            if name == "uav_velocity"
            else values[cut if name in on_trials else (slice(None), cut)]
            for name, values in arrays.items()
        }

    parts = [statistics_of(some(cut), SCENARIO, NAMES) for cut in (slice(0, 2), slice(2, None))]
    whole = statistics_of(arrays, SCENARIO, NAMES)
    joined = join(parts)
    assert set(joined) == set(whole)
    for name, values in whole.items():
        np.testing.assert_allclose(joined[name], values, rtol=1e-9, atol=1e-12, err_msg=name)
    for name in filter(per_trial, whole):
        np.testing.assert_array_equal(joined[name], whole[name])  # in the order of the blocks


def test_rmse_pools_trials_and_objects():
    """Three errors of one object and one of another weigh 3 to 1."""
    part = {"errors": np.array([[3.0, 1.0], [0.0, 0.0]])}
    part["squares_distance"] = np.array([[12.0, 4.0], [0.0, 0.0]])
    np.testing.assert_array_equal(rmse(part, "distance"), [2.0, np.nan])


def test_the_rate_of_who_is_not_there_does_not_count():
    rate = np.array([[1.0, 2.0], [np.nan, 4.0], [np.nan, np.nan]])
    present = np.array([[True, False], [True, True], [True, True]])
    np.testing.assert_array_equal(sum_rate(rate, present), [1.0, 4.0, 0.0])


def test_a_beam_is_designed_around_the_prediction_or_the_estimate_before():
    """A held estimate has no prediction; a new object has no estimate before."""
    nan = np.nan
    predicted = np.array([[nan, 1.0], [0.5, nan], [0.6, 1.2], [0.7, nan]])
    estimated = np.array([[0.4, nan], [0.51, 1.1], [0.61, 1.21], [0.71, 1.22]])
    around = cover_centre(predicted, estimated, "predicted")
    np.testing.assert_array_equal(around, [[nan, 1.0], [0.5, nan], [0.6, 1.2], [0.7, 1.21]])
    around = cover_centre(predicted, estimated, "previous")
    np.testing.assert_array_equal(around, [[nan, 1.0], [0.4, nan], [0.51, 1.1], [0.61, 1.21]])


def test_nothing_to_count_is_not_a_number():
    np.testing.assert_array_equal(quotient([0.0, 1.0], [0, 2]), [np.nan, 0.5])


def test_a_scene_without_objects_has_sums_of_nothing():
    arrays = {name: _without_objects(name, values) for name, values in made_up().items()}
    figures = statistics_of(arrays, SCENARIO.replace({"objects": []}), NAMES)
    np.testing.assert_array_equal(figures["sum_rate"], np.zeros((len(NAMES), TRIALS, SLOTS)))
    for name in ("nees", "nis", "served", "covered", "there"):
        np.testing.assert_array_equal(figures[name], np.zeros((len(NAMES), SLOTS)))
    assert np.isnan(rmse(of_scheme(figures, 0), "angle")).all()


def _without_objects(name, values):
    if name in ("uav_velocity", "mode", "fallback"):
        return values
    return values[:, :, :0] if name in ("truth", "present") else values[:, :, :, :0]
