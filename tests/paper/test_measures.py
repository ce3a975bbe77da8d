"""Measures of claims on rates made up so that the answer is known."""

import numpy as np
import pytest

from echobeam.reproduction.catalogue import CLAIMS as ALL
from echobeam.reproduction.figures import resolutions
from echobeam.reproduction.records import Finding
from echobeam.reproduction.results import Outcome, Results
from echobeam.reproduction.setups import (
    HEIGHTS,
    RESOLUTIONS,
    Setup,
    height,
    long,
    manoeuvre,
    multi,
    single,
)

TRIALS = 30
CLAIMS = {claim.id: claim for claim in ALL}
LINES = dict.fromkeys(resolutions.FIGURE.points)


def outcome(setup: Setup, rate: dict[str, float], kept: dict[str, np.ndarray] | None = None):
    """Return trials whose sum rate is a scheme's value, up to a little luck that trials share."""
    luck = 1 + 0.01 * np.random.default_rng(5).normal(size=TRIALS)
    slots = setup.scenario().n_slots
    sums = np.array([np.tile(rate.get(name, 9.0) * luck[:, None], slots) for name in setup.schemes])
    return Outcome(setup.point(TRIALS), {"sum_rate": sums}, kept or {})


def judged(claim: str, outcomes: list[Outcome]) -> Finding:
    return Finding(CLAIMS[claim], CLAIMS[claim].measure(Results(outcomes, TRIALS, 0)))


def over_resolutions(rates: dict[int, list[float]]) -> list[Outcome]:
    """Return the lines over the resolution, with rates by the number of antennas."""
    outcomes = []
    for setup in LINES:
        scenario = setup.scenario()
        step = np.degrees(scenario.coverage.resolution)
        index = int(np.argmin(np.abs(np.array(RESOLUTIONS) - step)))
        outcomes.append(outcome(setup, {"temporal": rates[scenario.array.n_tx][index]}))
    return outcomes


FALLING = [9.0, 8.9, 8.0, 7.0, 6.5, 6.0, 5.0, 4.5, 4.0]
SAWTOOTH = [9.0, 8.9, 8.0, 7.0, 5.5, 6.5, 5.0, 4.5, 4.0]
GENTLE = [9.0, 8.95, 8.9, 8.8, 8.7, 8.5, 8.2, 8.1, 8.0]
LEVEL = [9.0] * 9


@pytest.mark.parametrize(
    ("rates", "verdict"),
    [(FALLING, "reproduced"), (SAWTOOTH, "in part"), (LEVEL, "not reproduced")],
)
def test_a_rate_that_rises_in_between_does_not_worsen_throughout(rates, verdict):
    found = judged(
        "coarse-resolution-worsens", over_resolutions(dict.fromkeys((25, 30, 35), rates))
    )
    assert found.verdict == verdict
    least = found.measured.estimates["N 30, 90 m, least step"]
    steps = 100 * (1 - np.array(rates[1:]) / rates[:-1])
    assert least.value == pytest.approx(steps.min())


@pytest.mark.parametrize(
    ("many", "few", "verdict"),
    [(FALLING, GENTLE, "reproduced"), (GENTLE, FALLING, "not reproduced")],
)
def test_losses_with_many_antennas_are_held_against_those_with_few(many, few, verdict):
    found = judged("antennas-sharpen-losses", over_resolutions({25: few, 30: few, 35: many}))
    assert found.verdict == verdict
    expected = 100 * (few[-1] / few[0] - many[-1] / many[0])
    assert found.measured.estimates["5 deg"].value == pytest.approx(expected)


@pytest.mark.parametrize(
    ("lead", "verdict"),
    [
        (lambda h: 1.0 + h / 1000, "reproduced"),
        (lambda h: 2.0 - h / 1000, "in part"),
        (lambda h: 0.5 - h / 1000, "not reproduced"),
    ],
)
def test_the_lead_over_water_filling_must_be_there_and_grow(lead, verdict):
    found = judged(
        "superior-at-distance",
        [outcome(height(h), {"temporal": lead(h), "water-filling": 1.0}) for h in HEIGHTS],
    )
    assert found.verdict == verdict
    growth = found.measured.estimates["growth from 100 to 120 m"].value
    assert growth == pytest.approx(100 * (lead(120) - lead(100)))


@pytest.mark.parametrize(
    ("alone", "verdict"), [(3.0, "reproduced"), (0.5, "in part"), (0.01, "in part")]
)
def test_the_pilot_scheme_must_be_outperformed_with_one_object_and_with_two(alone, verdict):
    found = judged(
        "outperforms-pilot",
        [
            outcome(multi(), {"temporal": 2.0, "pilot": 1.0}),
            outcome(single(), {"temporal": alone, "pilot": 1.0}),
        ],
    )
    assert found.verdict == verdict
    assert found.measured.estimates["one object"].value == pytest.approx(100 * (alone - 1))


@pytest.mark.parametrize(("growth", "verdict"), [(1.5, "reproduced"), (1.0, "not reproduced")])
def test_sensing_is_lost_in_an_omni_slot_if_the_angle_error_grows_there(growth, verdict):
    setup = long()
    slots = setup.scenario().n_slots
    truth = np.zeros((TRIALS, slots, 2, 3))
    error = np.random.default_rng(6).normal(size=(TRIALS, 1, 2)) * np.ones((1, slots, 1)) * 1e-3
    error[:, 10::10] *= growth
    estimated = np.zeros((2, *truth.shape))
    estimated[..., 0] = error
    kept = {"truth": truth, "estimated": estimated}
    found = judged(
        "sensing-dips-at-omni-slots",
        [outcome(setup, {"temporal": 2.0, "pilot": 1.0, "genie": 4.0}, kept)],
    )
    assert found.verdict == verdict
    assert list(found.measured.estimates) == ["slot 11", "slot 21", "slot 31", "slot 41"]
    for one in found.measured.estimates.values():
        assert one.value == pytest.approx(100 * (growth - 1))


@pytest.mark.parametrize(("best", "verdict"), [(2.1, "reproduced"), (4.0, "not reproduced")])
def test_recovery_is_near_optimal_if_the_genie_has_little_more(best, verdict):
    rates = {"temporal": 2.0, "pilot": 1.0, "genie": best}
    found = judged("near-optimal-after-update", [outcome(long(), rates)])
    assert found.verdict == verdict
    assert found.measured.headline.value == pytest.approx(200.0 / best)


@pytest.mark.parametrize(
    ("dropping", "verdict"), [("pilot", "reproduced"), ("temporal", "not reproduced")]
)
def test_a_scheme_is_less_stable_whose_rate_drops_within_a_frame(dropping, verdict):
    one = outcome(manoeuvre(), {"temporal": 2.0, "pilot": 1.0})
    sums = one.statistics["sum_rate"]
    sums[:, :, ::10] = 0.0  # omni slots count as nobody's drop
    sums[one.point.schemes.index(dropping), : TRIALS // 2, 35] *= 0.4
    found = judged("stable-under-manoeuvres", [one])
    assert found.verdict == verdict
    assert abs(found.measured.headline.value) == pytest.approx(50.0)


@pytest.mark.parametrize(("pilot", "verdict"), [(3.0, "reproduced"), (1.0, "not reproduced")])
def test_the_pilot_is_high_at_first_if_it_beats_the_proposed_scheme_there(pilot, verdict):
    rates = {"temporal": 2.0, "pilot": pilot}
    found = judged("pilot-high-at-first", [outcome(multi(), rates), outcome(single(), rates)])
    assert found.verdict == verdict


@pytest.mark.parametrize(("fall", "verdict"), [(0.5, "in part"), (2.0, "not reproduced")])
def test_the_faster_object_is_tracked_stably_if_its_errors_fall(fall, verdict):
    """Of 30 trials without a lost track Clopper and Pearson know no more than 88 % kept."""
    setup = multi()
    truth = np.zeros((TRIALS, 10, 2, 3))
    estimated = np.zeros((2, *truth.shape))
    luck = np.random.default_rng(7).normal(size=(TRIALS, 1, 1))
    estimated[0, :, :, 0] = 1e-3 * luck
    estimated[0, :, 9, 0] *= fall
    one = outcome(setup, {"temporal": 2.0, "pilot": 1.0}, {"truth": truth, "estimated": estimated})
    found = judged("stable-at-high-speed", [one])
    assert found.verdict == verdict
    assert found.measured.headline.value == pytest.approx(100 * (1 - fall))
