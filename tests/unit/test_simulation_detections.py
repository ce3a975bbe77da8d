"""Unlabelled detections of a slot: how many, where, how accurate, and what their order says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import kstest, poisson, spearmanr

from echobeam.physics import transmission
from echobeam.physics.measurement import measure
from echobeam.scenario.model import Scenario
from echobeam.schemes.base import Decision
from echobeam.schemes.configure import configure, detection_of
from echobeam.simulation.detections import detect
from echobeam.simulation.loop import run_slots
from echobeam.simulation.scene import scene_of
from echobeam.simulation.world import begin
from echobeam.values import NOBODY, Mode

LEVEL = 1e-4
"""Probability with which a right law fails a test; the seeds are fixed."""

SIGMAS = 4.0
"""Standard deviations of a mean or a share, for about the same level."""


def scenario_of(angles=(1.1, 1.9), **changes) -> Scenario:
    table = {
        "name": "detections",
        "array": {"n_tx": 8},
        "radio": {"power": 1e4},
        "radar": {"detections": "unlabelled", "crb": "exact", "false_alarm": 1e-6},
        "uav": {"height": 100.0, "speed": 10.0, "heading": 0.0},
        "objects": [
            {"angle": angle, "velocity": 10.0 + place} for place, angle in enumerate(angles)
        ],
        "frame": {"slots_per_frame": 4, "frames": 1},
    }
    return Scenario.model_validate(table).replace(changes)


def world_of(scenario, trials=range(2000), seed=5):
    return begin(scene_of(scenario), seed, trials)


def omni_slot(world, power=None, sensed=True) -> Decision:
    """One stream for nobody in particular; a radar needs no addressee."""
    power = world.scene.scenario.radio.power if power is None else power
    shape = (len(world.trials), 1)
    return Decision(
        sent=transmission.omni(np.ones(shape, bool), power, world.scene.scenario.array.n_tx),
        addressee=np.full(shape, NOBODY),
        sensed=np.broadcast_to(sensed, shape),
        mode=np.full(len(world.trials), Mode.OMNI, dtype=np.int8),
        covered=np.full(shape, np.nan),
        fallback=np.zeros(len(world.trials), bool),
    )


def true_values(world):
    angle, distance, velocity = np.moveaxis(world.state, -1, 0)
    uav = world.uav
    return measure(angle, distance, velocity, uav.speed, uav.heading, 30e9)[0]


@pytest.mark.parametrize("target", ["constant", "swerling1", "3gpp-vehicle"])
@pytest.mark.parametrize("power", [300.0, 1000.0, 1500.0])
def test_objects_are_detected_as_often_as_the_law_says(target, power):
    world = world_of(scenario_of(**{"radar.target": target}))
    decision = omni_slot(world, power)
    _, sensed = detect(world, decision)
    law, trials = detection_of(world.scene.scenario), len(world.trials)
    share = np.isfinite(sensed.measured[..., 0]).mean(axis=0)
    expected = law.probability(world.scene.law.snr(decision.sent, world.state)[0])
    assert ((expected > 0.001) & (expected < 0.999)).any()
    band = SIGMAS * np.sqrt(expected * (1.0 - expected) / trials) + 1.0 / trials
    assert (np.abs(share - expected) < band).all()
    alone = np.isfinite(sensed.measured[..., 0])
    both, independent = alone.all(axis=-1).mean(), np.prod(expected)
    assert abs(both - independent) < SIGMAS * np.sqrt(0.25 / trials)


@pytest.mark.parametrize("axis", ["vertical", "horizontal"])
def test_false_detections_are_poisson_and_uniform(axis):
    world = world_of(
        scenario_of((), **{"array.axis": axis, "radar.clutter": 2.5, "radar.false_alarm": 1e-5})
    )
    law, trials = detection_of(world.scene.scenario), len(world.trials)
    found, _ = detect(world, omni_slot(world))
    count = found.valid.sum(axis=-1)
    assert abs(count.mean() - law.mean_false) < SIGMAS * np.sqrt(law.mean_false / trials)
    assert abs(count.var() / count.mean() - 1.0) < SIGMAS * np.sqrt(2.0 / trials)
    for number in range(6):
        p = poisson.pmf(number, law.mean_false)
        assert abs((count == number).mean() - p) < SIGMAS * np.sqrt(p * (1 - p) / trials)
    angle, delay, doppler = np.moveaxis(found.value[found.valid], -1, 0)
    u = np.sin(angle) if axis == "vertical" else 0.5 * (1.0 + np.cos(angle))
    uniform = (u, delay / law.longest, 0.5 * (1.0 + doppler / law.widest))
    for component in uniform:
        assert kstest(component, "uniform").pvalue > LEVEL
    for one, other in ((0, 1), (0, 2), (1, 2)):
        assert spearmanr(uniform[one], uniform[other]).pvalue > LEVEL


def test_measurement_errors_are_normal_with_the_stated_true_variance():
    world = world_of(scenario_of())
    _, sensed = detect(world, omni_slot(world))
    error = (sensed.measured - true_values(world)) / np.sqrt(sensed.true_var)
    there = np.isfinite(error).all(axis=-1)
    assert there.mean() > 0.5
    scores = error[there]
    for component in scores.T:
        assert kstest(component, "norm").pvalue > LEVEL
    product = np.abs(np.corrcoef(scores.T) - np.eye(3))
    assert product.max() < SIGMAS / np.sqrt(len(scores))


def test_detections_are_ordered_by_delay_and_carry_no_label():
    world = world_of(scenario_of((1.9, 1.1, 1.5), **{"radar.clutter": 3.0}), range(200))
    found, sensed = detect(world, omni_slot(world))
    assert (found.label == NOBODY).all()
    step = np.diff(found.value[..., 1], axis=-1)
    assert (step[found.valid[:, 1:]] >= 0.0).all()
    assert (found.valid[:, :-1] >= found.valid[:, 1:]).all()  # empty columns last
    assert np.isnan(found.value[~found.valid]).all()
    assert np.isinf(found.variance[~found.valid]).all()
    own = sensed.measured[..., 1]
    for trial in range(20):
        mine = found.value[trial, found.valid[trial], 1]
        assert set(own[trial][np.isfinite(own[trial])]) <= set(mine)


def test_objects_in_other_columns_give_the_same_detections():
    """With equal luck of each identity the columns of the objects must not matter."""
    world = world_of(scenario_of((1.1, 1.9), **{"radar.clutter": 2.0}), range(50))
    ground = world.ground
    back = replace(
        world,
        state=world.state[:, ::-1],
        ground=replace(
            ground,
            position=ground.position[:, ::-1],
            velocity=ground.velocity[:, ::-1],
            identity=ground.identity[::-1].copy(),
        ),
    )
    one, other = (detect(each, omni_slot(each))[0] for each in (world, back))
    np.testing.assert_array_equal(one.valid, other.valid)
    np.testing.assert_array_equal(one.value, other.value)
    np.testing.assert_allclose(one.variance, other.variance, rtol=1e-12)


@pytest.mark.parametrize("target", ["constant", "swerling1", "3gpp-vehicle"])
def test_a_trial_is_the_same_however_the_work_is_split(target):
    scenario = scenario_of(**{"radar.clutter": 2.0, "radar.target": target})
    (whole,) = _detected(scenario, range(6))
    parts = [part for split in (range(3), range(3, 6)) for part in _detected(scenario, split)]
    for trial in range(6):
        part, row = parts[trial // 3], trial % 3
        mine = whole.value[trial, whole.valid[trial]]
        np.testing.assert_array_equal(mine, part.value[row, part.valid[row]])
        np.testing.assert_array_equal(
            whole.variance[trial, whole.valid[trial]], part.variance[row, part.valid[row]]
        )


def _detected(scenario, trials):
    world = world_of(scenario, trials).advance()
    return [detect(world, omni_slot(world))[0]]


def test_a_radar_that_is_off_detects_nothing_not_even_clutter():
    world = world_of(scenario_of(**{"radar.clutter": 5.0}), range(40))
    found, sensed = detect(world, omni_slot(world, sensed=False))
    assert found.valid.size == 0
    assert np.isnan(sensed.measured).all()
    odd = (np.arange(40) % 2 == 1)[:, None]
    found, _ = detect(world, omni_slot(world, sensed=odd))
    assert not found.valid[::2].any()
    assert found.valid[1::2].any(axis=-1).all()


def test_the_pilot_scheme_has_no_detections_in_its_directional_slots():
    scenario = scenario_of(**{"radio.power": 1e4, "radar.clutter": 3.0, "frame.frames": 2})
    scheme = configure(scenario, "pilot")
    counts = []

    class Counting:
        def __getattr__(self, name):
            return getattr(scheme.scheme, name)

        def update(self, prior, detections, view):
            counts.append(int(detections.valid.sum()))
            return scheme.scheme.update(prior, detections, view)

    world = begin(scene_of(scenario), 1, range(5))
    records = list(run_slots(world, replace(scheme, scheme=Counting())))
    directional = [bool((record.mode == Mode.DIRECTIONAL).all()) for record in records]
    assert directional == [False, True, True, True] * 2
    for record, count, off in zip(records, counts, directional, strict=True):
        assert (count == 0) == off
        assert np.isnan(record.measured).all() == off


def test_an_object_beyond_the_longest_delay_is_not_seen():
    longest = 200 / 80e6  # s: 375 m
    near, far = np.arcsin(100.0 / 370.0), np.arcsin(100.0 / 380.0)
    world = world_of(scenario_of((near, far), **{"radio.power": 1e9}), range(30))
    found, sensed = detect(world, omni_slot(world))
    assert np.isfinite(sensed.measured[:, 0]).all()
    assert np.isnan(sensed.measured[:, 1]).all()
    assert (found.value[found.valid][:, 1] < longest * 1.01).all()


def test_an_absent_object_is_not_seen():
    scenario = scenario_of(**{"radio.power": 1e6, "radar.false_alarm": 1e-9})
    first, second = scenario.objects
    late = first.model_copy(update={"appears": 0.015})
    gone = second.model_copy(update={"leaves": 0.005})
    world = world_of(scenario.model_copy(update={"objects": (late, gone)}), range(10))
    seen = []
    for _ in range(4):
        _, sensed = detect(world, omni_slot(world))
        seen.append(np.isfinite(sensed.measured[..., 0]).all(axis=0).tolist())
        world = world.advance()
    assert seen == [[False, True], [False, False], [True, False], [True, False]]


def test_a_vertical_array_folds_the_angle_and_a_horizontal_one_does_not():
    for axis in ("vertical", "horizontal"):
        world = world_of(scenario_of((1.9,), **{"array.axis": axis, "radio.power": 1e6}), range(50))
        found, sensed = detect(world, omni_slot(world))
        angle = found.value[..., 0][found.valid]
        expected = np.pi - 1.9 if axis == "vertical" else 1.9
        nearest = angle[np.abs(found.value[..., 1][found.valid] * 1.5e8 - 105.7) < 1.0]
        assert len(nearest) == 50
        assert np.abs(nearest - expected).max() < 0.01
        np.testing.assert_allclose(sensed.measured[..., 0], 1.9, atol=0.01)  # the record has it


def test_the_stated_variance_is_that_of_the_measured_place():
    """Its law at what was measured; at the truth where the scenario says that it is known."""
    for knowledge in ("predicted", "known"):
        own = {"radar.variance": knowledge, "radio.power": 1e5, "radar.false_alarm": 1e-9}
        world = world_of(scenario_of((1.1,), **own), range(20))
        decision = omni_slot(world)
        found, sensed = detect(world, decision)
        assert found.valid.all()
        measured = found.value[..., 0, :]
        place = np.stack(
            [measured[:, 0], measured[:, 1] * 299_792_458.0 / 2.0, 0.0 * measured[:, 0]], axis=-1
        )
        at_place = world.scene.law.variance(decision.sent, place[:, None])[:, 0]
        at_truth = np.broadcast_to(
            world.scene.law.variance(decision.sent, world.state)[:, 0], (20, 3)
        )
        expected = at_place if knowledge == "predicted" else at_truth
        np.testing.assert_allclose(found.variance[:, 0], expected, rtol=1e-9)
        np.testing.assert_allclose(sensed.true_var[:, 0], at_truth, rtol=1e-12)


@pytest.mark.parametrize("target", ["constant", "swerling1", "3gpp-vehicle"])
@pytest.mark.parametrize("variance", ["predicted", "known"])
def test_the_stated_variance_gives_no_false_detection_away(target, variance):
    """A scheme knows the law: where one states exactly the law at its place, so must all."""
    changes = {"radar.target": target, "radar.variance": variance, "radar.clutter": 5.0}
    world = world_of(scenario_of(**changes), range(100))
    decision = omni_slot(world)
    found, sensed = detect(world, decision)
    own = sensed.measured[..., 1]
    mine = (found.value[..., None, 1] == own[:, None, :]).any(axis=-1)
    angle, delay, _ = np.moveaxis(found.value, -1, 0)
    place = np.stack([angle, 0.5 * 299792458.0 * delay, np.zeros_like(angle)], axis=-1)
    law = world.scene.law.variance(decision.sent, place)
    exact = np.isclose(found.variance, law, rtol=1e-9).all(axis=-1)
    plain = target == "constant" and variance == "predicted"
    assert mine.any()
    assert (~mine & found.valid).any()
    assert (exact[mine] == plain).all()
    assert (exact[~mine & found.valid] == plain).all()


def test_false_echoes_that_fluctuate_are_as_strong_as_true_ones_that_are_detected():
    """Swerling I beyond a sharp threshold: SNR - threshold of a cell is exponential."""
    changes = {"radar.fluctuation": "swerling1", "radar.clutter": 20.0, "radio.power": 1e6}
    world = world_of(scenario_of((), **changes), range(100))
    decision = omni_slot(world)
    found, _ = detect(world, decision)
    angle, delay, _ = np.moveaxis(found.value[found.valid], -1, 0)
    place = np.stack([angle, 0.5 * 299792458.0 * delay, np.zeros_like(angle)], axis=-1)
    law, sent = world.scene.law, omni_slot(world_of(scenario_of((), **changes), range(1))).sent
    strength = law.variance(sent, place[None])[0] / found.variance[found.valid]
    np.testing.assert_allclose(strength, strength[:, :1] * np.ones(3), rtol=1e-9)
    least = -np.log(1e-6) / (8 * law.snr(sent, place[None])[0])
    assert kstest(strength[:, 0] - least, "expon").pvalue > LEVEL


def test_behind_the_empty_roster_is_nothing():
    """A slice has the whole array behind it, and with it the number of objects."""
    scenario = scenario_of()
    scheme = configure(scenario, "water-filling")
    behind = []

    class Looking:
        def __getattr__(self, name):
            return getattr(scheme.scheme, name)

        def predict(self, belief, view):
            behind.append((view.roster.shape, view.roster.base))
            return scheme.scheme.predict(belief, view)

    list(run_slots(begin(scene_of(scenario), 1, range(2)), replace(scheme, scheme=Looking())))
    assert behind == [((2, 0), None)] * 4
