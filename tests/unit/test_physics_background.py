"""The background channel against the standard's tables, its laws, and geometry by hand."""

from __future__ import annotations

import ast
import math
import re
from operator import add, mul, sub, truediv
from pathlib import Path

import numpy as np
import pytest

import echobeam as eb
from echobeam.physics.background import DRAWS, POINTS, SURROUNDINGS, reference_points
from echobeam.scenario import ScenarioError
from echobeam.simulation.background import background
from echobeam.simulation.scene import scene_of
from echobeam.simulation.signal_sensor import detect_in_signal
from echobeam.simulation.world import begin
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import Transmission

HEIGHTS = {"umi-av": 150.0, "uma-av": 80.0, "rma-av": 35.0}
LOUD = 1e-10
"""Noise of the downlink at which the points are far above the radar's."""


OPERATORS = {ast.Add: add, ast.Sub: sub, ast.Mult: mul, ast.Div: truediv}


def value_of(node, h):
    """Return the value of a formula of numbers and h."""
    if isinstance(node, ast.BinOp):
        return OPERATORS[type(node.op)](value_of(node.left, h), value_of(node.right, h))
    return h if isinstance(node, ast.Name) else float(node.value)


@pytest.mark.parametrize("name", SURROUNDINGS)
@pytest.mark.parametrize("height", [30.0, 60.0, 95.0])
def test_laws_have_the_parameters_of_the_standard(name, height):
    """The examiner's table has the formulas as text: numbers, +, - and / of h."""
    tr3gpp = pytest.importorskip("tr3gpp", reason="tr3gpp, the examiner, is not installed")
    (table,) = Path(next(iter(tr3gpp.__path__))).rglob("table-7.9.4.2-2-part2.csv")
    head, *rows = [line.split(",") for line in table.read_text().splitlines()]
    (row,) = [row for row in rows if row[0].lower() == name]
    given = {}
    for key, text in zip(head[1:], row[1:], strict=True):
        formula = ast.parse(re.sub(r"(?<=\d)h", "*h", text), mode="eval")
        given[key] = value_of(formula.body, height)
    around = SURROUNDINGS[name]
    for law, axis in ((around.distance, "d"), (around.height, "h")):
        found = (law.shape(height), law.rate(height), law.offset(height))
        expected = tuple(given[f"{part}_{axis}"] for part in ("alpha", "beta", "c"))
        assert found == pytest.approx(expected, rel=1e-12)


def test_means_of_the_urban_scenario_at_100_m():
    around = SURROUNDINGS["uma-av"]
    assert around.distance.mean(100.0) == pytest.approx(556.94, abs=5e-3)
    assert around.height.mean(100.0) == pytest.approx(53.51, abs=5e-3)


@pytest.mark.parametrize("name", SURROUNDINGS)
def test_points_follow_their_laws_120_degrees_apart(name):
    """20,000 trials: means and variances of Gamma laws within four standard errors."""
    trials, height = 20_000, HEIGHTS[name]
    rng = np.random.default_rng(3)
    draws = rng.standard_normal((trials, POINTS, DRAWS))
    around = SURROUNDINGS[name]
    points = reference_points(around, height, 30e9, rng.standard_normal(trials), draws)
    far = np.hypot(points.offset[..., 0], points.offset[..., 1])
    for law, sample in ((around.distance, far), (around.height, points.offset[..., 2])):
        k, rate = law.shape(height), law.rate(height)
        values = sample.ravel() - law.offset(height)
        assert abs(values.mean() - k / rate) < 4.0 * math.sqrt(k / rate**2 / values.size)
        # the variance of the sample variance of a Gamma law: its kurtosis is 3 + 6 / k
        error = k / rate**2 * math.sqrt((2.0 + 6.0 / k) / values.size)
        assert abs(values.var() - k / rate**2) < 4.0 * error
    azimuth = np.arctan2(points.offset[..., 1], points.offset[..., 0])
    apart = np.diff(azimuth, axis=1) % (2.0 * np.pi)
    np.testing.assert_allclose(apart, 2.0 * np.pi / 3.0, rtol=1e-9)
    turn = azimuth[:, 0] % (2.0 * np.pi) / (2.0 * np.pi)
    assert abs(turn.mean() - 0.5) < 4.0 / math.sqrt(12.0 * trials)


def test_the_path_loss_is_that_of_the_report():
    """TR 36.777, table B-2, by hand at 30 GHz, 80 m high, 500 m away."""
    far, first = np.array([500.0]), 20.0 * math.log10(40.0 * math.pi * 30.0 / 3.0)
    logarithm = math.log10(500.0)
    uma = -17.5 + (46.0 - 7.0 * math.log10(80.0)) * logarithm + first
    assert SURROUNDINGS["uma-av"].path_loss(80.0, far, 30.0) == pytest.approx(uma, rel=1e-12)
    rma = max(
        max(23.9 - 1.8 * math.log10(80.0), 20.0) * logarithm + first,
        -12.0 + (35.0 - 5.3 * math.log10(80.0)) * logarithm + first,
    )
    assert SURROUNDINGS["rma-av"].path_loss(80.0, far, 30.0) == pytest.approx(rma, rel=1e-12)
    umi = 32.4 + (43.2 - 7.6 * math.log10(80.0)) * logarithm + 20.0 * math.log10(30.0)
    assert SURROUNDINGS["umi-av"].path_loss(80.0, far, 30.0) == pytest.approx(umi, rel=1e-12)


def test_the_amplitude_is_the_gain_of_path_loss_and_shadow_fading():
    around = SURROUNDINGS["uma-av"]
    draws = np.zeros((1, POINTS, DRAWS))
    draws[..., 2], draws[..., 3] = 1.0, np.sqrt(2.0)  # one deviation of fading, unit amplitude
    points = reference_points(around, 90.0, 30e9, np.zeros(1), draws)
    distance = np.linalg.norm(points.offset - [0.0, 0.0, 90.0], axis=-1)
    lost = around.path_loss(90.0, distance, 30.0) + 6.0
    free = 20.0 * math.log10(4.0 * math.pi * 30e9 / SPEED_OF_LIGHT)
    np.testing.assert_allclose(20.0 * np.log10(np.abs(points.amplitude)), free - lost, rtol=1e-9)


def scenario_of(geometry, **changes):
    if geometry == "road":
        name = "paper-signal"
        fixed = {"uav.height": "80 m", "array.axis": "horizontal"}
    else:
        name = "ground"
        fixed = {"uav.position": [10, -20, 80], "uav.velocity": [20, 5, 1], "radar.model": "signal",
                 "radar.integration": "grid", "radar.crb": "exact"}  # fmt: skip
    fixed |= {"radar.background": "uma-av", "radio.noise": LOUD, "radar.detections": "unlabelled",
              "radar.bandwidth": "10 MHz", "objects": []}  # fmt: skip
    return eb.load_scenario(name, fixed | changes)


@pytest.mark.parametrize("geometry", ["road", "ground"])
def test_points_stand_still_while_the_uav_flies(geometry):
    """Delays, Doppler shifts and directions of two slots are of the same places."""
    world = begin(scene_of(scenario_of(geometry)), 4, range(3))
    first = background(world, range(3))
    later = world.advance().advance()
    second = background(later, range(3))
    moved = np.linalg.norm(later.uav.position - world.uav.position)
    assert moved > 0.1
    rate = 30e9 * (first.delay - second.delay) / 0.02  # Doppler is -f_c d(delay)/dt
    between = 0.5 * (first.doppler + second.doppler)
    np.testing.assert_allclose(rate, between, rtol=1e-3, atol=1.0)
    strength = np.abs(first.amplitude)
    assert strength.shape == (3, POINTS)
    assert strength.max() > 0.0
    if geometry == "ground":
        u, v = np.moveaxis(first.angle, -1, 0)
        distance = 0.5 * SPEED_OF_LIGHT * first.delay
        place = np.stack([10 + u * distance, -20 + v * distance], axis=-1)
        u, v = np.moveaxis(second.angle, -1, 0)
        distance = 0.5 * SPEED_OF_LIGHT * second.delay
        later_place = later.uav.position[:2] + np.stack([u * distance, v * distance], axis=-1)
        np.testing.assert_allclose(later_place, place, atol=1e-6)
        above = 80.0 - np.sqrt(np.maximum(distance**2 * (1 - u**2 - v**2), 0.0)) > 80.0
        assert not above.any()


@pytest.mark.slow
@pytest.mark.parametrize("geometry", ["road", "ground"])
def test_the_receiver_finds_the_points_where_they_are(geometry):
    """Far above the noise, nobody else there: detections within a cell of every strong point."""
    world = begin(scene_of(scenario_of(geometry)), 4, range(2))
    n = world.scene.law.transmitter.n
    power = np.full((2, 0, n), 0.0)
    probing = np.full((2, n), world.scene.scenario.radio.power / n)
    sent = Transmission(np.zeros((2, 0, n), dtype=complex), power, probing)
    nobody = np.ones((2, 0), dtype=complex)
    found, _, _ = detect_in_signal(world, sent, nobody, np.ones(2, dtype=bool))
    points = background(world, range(2))
    strongest = np.argmax(np.abs(points.amplitude), axis=1)
    for trial, point in enumerate(strongest):
        off = np.abs(found.delay[trial] - points.delay[trial, point]) * 10e6
        seen = found.valid[trial] & (off < 1.0)
        assert seen.any()


def test_without_it_nothing_changes():
    plain = eb.load_scenario("paper-signal", {"frame.slots_per_frame": 2})
    assert plain.radar.background == "none"
    quiet = plain.replace({"radar.background": "uma-av", "radio.alpha0": 1e-9})
    loud = quiet.replace({"radio.noise": LOUD * 1e-18})
    a, b, c = (
        eb.simulate(each, ["omni"], trials=2, seed=3, progress=False)["measured"].values
        for each in (plain, quiet, loud)
    )
    assert not np.array_equal(a, c)
    np.testing.assert_allclose(a, b, rtol=1e-6)


@pytest.mark.parametrize(
    ("name", "changes", "message"),
    [
        ("paper-multi", {"radar.background": "uma-av"}, "radar.background: 'uma-av' needs echo"),
        ("paper-signal", {"radar.background": "city"}, "radar.background: 'city' is not accepted"),
        (
            "paper-signal",
            {"radar.background": "uma-av", "uav.height": "120 m"},
            "stated for heights above 22.5 and up to 100 m; the UAV starts 120 m high",
        ),
        ("paper-signal", {"radar.background": "umi-av", "uav.height": "10 m"}, "above 22.5"),
    ],
)
def test_what_the_standard_does_not_state_is_refused(name, changes, message):
    with pytest.raises(ScenarioError, match=re.escape(message)):
        eb.describe(eb.load_scenario(name, changes))
