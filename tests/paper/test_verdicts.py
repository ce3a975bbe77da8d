"""Rules and numbers on synthetic cases: every verdict that a rule knows can be had."""

import json

import numpy as np
import pytest
from scipy import stats

from echobeam.reproduction import estimates
from echobeam.reproduction.catalogue import CLAIMS as ALL
from echobeam.reproduction.records import Claim, Estimate, Finding, Measured, Rule
from echobeam.reproduction.report import document, page, written
from echobeam.reproduction.results import Outcome, Results
from echobeam.reproduction.rules import all_above, all_below, inside, near, within
from echobeam.reproduction.setups import HEIGHTS, height


def verdict(rule: Rule, *numbers: tuple[float, float, float], names: str = "abcdef") -> str:
    found = {name: Estimate(*one) for name, one in zip(names, numbers, strict=False)}
    return rule.decide(Measured(found))


@pytest.mark.parametrize(
    ("ours", "expected"),
    [
        ((138, 120, 156), "reproduced"),
        ((109, 100, 118), "reproduced"),
        ((61, 40, 82), "in part"),
        ((300, 280, 320), "in part"),
        ((30, -5, 65), "not reproduced"),
        ((136, -10, 282), "not reproduced"),
        ((136, 34, 279), "in part"),
        ((136, 110, 165), "in part"),
        ((136, 110, 162), "reproduced"),
        ((-20, -30, -10), "not reproduced"),
        ((np.nan, np.nan, np.nan), "not reproduced"),
    ],
)
def test_near_wants_the_value_near_and_the_sign_sure(ours, expected):
    assert verdict(near(136.0), ours) == expected


@pytest.mark.parametrize(
    ("numbers", "expected"),
    [
        ([(2, 1, 3), (5, 4, 6)], "reproduced"),
        ([(2, 1, 3), (5, -4, 16)], "in part"),
        ([(2, -1, 3), (5, -4, 16)], "not reproduced"),
        ([(3, -8, 14)], "not reproduced"),
        ([(2, 1, 3), (-5, -6, -4)], "in part"),
        ([(2, -1, 3), (-5, -6, -4)], "not reproduced"),
        ([(0, 0, 0)], "not reproduced"),
        ([(np.nan, np.nan, np.nan)], "not reproduced"),
    ],
)
def test_all_above_wants_whole_intervals(numbers, expected):
    assert verdict(all_above(0.0), *numbers) == expected
    mirrored = [(-value, -high, -low) for value, low, high in numbers]
    assert verdict(all_below(0.0), *mirrored) == expected


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        (107, "reproduced"),
        (105, "reproduced"),
        (98, "in part"),
        (np.inf, "not reproduced"),
        (-np.inf, "not reproduced"),
    ],
)
def test_inside_tells_range_from_neighbourhood(value, expected):
    assert verdict(inside(105, 110, 95, 120, "m"), (value, value, value)) == expected


@pytest.mark.parametrize(
    ("ours", "expected"),
    [
        ((107, 101, 114), "reproduced"),
        ((115, 106, 119), "in part"),
        ((115, 100, np.inf), "not reproduced"),
        ((107, -np.inf, 110), "not reproduced"),
        ((np.nan, np.nan, np.nan), "not reproduced"),
    ],
)
def test_inside_wants_an_interval_that_says_where(ours, expected):
    assert verdict(inside(105, 110, 95, 120, "m"), ours) == expected


@pytest.mark.parametrize(
    ("large", "small", "expected"),
    [(1.0, 2.0, "reproduced"), (0.2, 5.0, "in part"), (2.0, 2.0, "not reproduced"),
     (5.0, 1.0, "not reproduced"), (np.inf, np.inf, "not reproduced")],
)  # fmt: skip
def test_within_falls_back_on_the_ordering(large, small, expected):
    rule = within({"a": (0.5, 1.5), "b": (1.5, 3.0)}, ("a", "b"))
    assert verdict(rule, (large,) * 3, (small,) * 3) == expected


@pytest.mark.parametrize(
    ("less", "more", "expected"),
    [
        ((1.0, 0.5, 1.5), (2.0, 1.5, 3.0), "reproduced"),
        ((1.0, 0.2, 1.4), (2.0, 1.5, 3.0), "in part"),
        ((1.0, 0.2, 1.5), (2.0, 1.0, 3.0), "not reproduced"),
    ],
)
def test_within_wants_whole_intervals(less, more, expected):
    rule = within({"a": (0.5, 1.5), "b": (1.5, 3.0)}, ("a", "b"))
    assert verdict(rule, less, more) == expected


def test_a_verdict_cannot_be_given_by_hand():
    claim = Claim("x", "t1", "text", 136.0, "reading", lambda results: None, near(136.0))
    with pytest.raises(TypeError):
        Finding(claim, Measured({"a": Estimate.exact(1.0)}), verdict="reproduced")


def test_bootstrap_of_a_mean_agrees_with_students_interval():
    samples = np.random.default_rng(1).normal(3.0, 2.0, 400)
    ours = estimates.bootstrap(lambda x: x.mean(axis=-1), samples)
    half = 2.0 / np.sqrt(400) * stats.norm.ppf(0.975)
    assert ours.value == pytest.approx(samples.mean())
    # resampling error of a 2.5 % quantile from 2000 draws: about 3 % of the half-width each
    assert (ours.high - ours.low) / 2 == pytest.approx(half, rel=0.15)
    assert estimates.bootstrap(lambda x: x.mean(axis=-1), samples) == ours


@pytest.mark.slow
def test_bootstrap_intervals_hold_what_they_promise():
    """200 intervals for a ratio of root mean squares: misses are binomial with 5 %."""
    random = np.random.default_rng(2)
    misses = 0
    for _ in range(200):
        common = random.normal(size=150)
        above, below = 2.0 * common + random.normal(size=150), random.normal(size=150)
        found = estimates.rms_ratio(above, below)
        misses += not found.low <= np.sqrt(5.0) <= found.high
    # percentile intervals at 150 trials miss a little more often than 5 %; 10 % bounds the slack
    assert misses <= stats.binom.ppf(1 - 1e-4, 200, 0.10)
    assert misses >= stats.binom.ppf(1e-4, 200, 0.05)


def test_proportion_agrees_with_scipys_exact_interval():
    for hits in (0, 3, 50, 100):
        ours = estimates.proportion(np.arange(100) < hits)
        theirs = stats.binomtest(hits, 100).proportion_ci(0.95, "exact")
        assert (ours.value, ours.low, ours.high) == pytest.approx(
            (hits / 100, theirs.low, theirs.high), abs=1e-12
        )


@pytest.mark.parametrize(
    ("ratios", "expected"),
    [
        ([1.2, 1.1, 0.9, 0.8], 105.0 + 2.5),
        ([1.2, 0.9, 1.1, 0.8], 110.0 + 5.0 / 3.0),
        ([1.2, 1.1, 1.3, 1.4], np.inf),
        ([0.9, 0.8, 0.7, 0.6], -np.inf),
        ([0.9, 0.8, 0.7, 1.6], np.inf),
    ],
)
def test_crossing_is_the_last_fall_below_one(ratios, expected):
    heights = np.array([100.0, 105.0, 110.0, 115.0])
    assert estimates.crossing(heights, np.array(ratios)) == pytest.approx(expected)


def test_numbers_are_written_with_their_interval():
    assert written(Estimate(138.2, 118.4, 157.9), "%") == "138 (118 to 158) %"
    assert written(Estimate(0.01234, 0.01200, 0.01270)) == "0.01234 (0.01200 to 0.01270)"
    assert written(Estimate.exact(100.0), "%") == "100 %"
    assert written(Estimate.exact(np.inf), "m") == "none"
    assert written(Estimate.exact(np.nan), "m") == "undefined"
    assert written(Estimate.exact(0.5), "deg") == "0.5 deg"
    assert written(Estimate.exact(0.15634), "%") == "0.156 %"
    assert written(Estimate(3.0, 2.0, 3.0), "slot") == "slot 3 (2 to 3)"
    assert written(Estimate.exact(0.0), "deg") == "0 deg"


@pytest.mark.parametrize(
    ("value", "low", "high", "unit", "said"),
    [
        (101, -np.inf, 112, "m", "101 (below 95 to 112) m"),
        (107, 104, np.inf, "m", "107 (104 to above 120) m"),
        (np.inf, 104, np.inf, "m", "above 120 (104 to above 120) m"),
        (-np.inf, -np.inf, 104, "m", "below 95 (below 95 to 104) m"),
        (-np.inf, -np.inf, -np.inf, "m", "below 95 m"),
        (np.inf, np.inf, np.inf, "m", "none"),
        (3, 2, np.inf, "slot", "slot 3 (2 to above 120)"),
        (np.inf, np.inf, np.inf, "slot", "none"),
    ],
)
def test_open_ends_are_told_by_what_was_looked_at(value, low, high, unit, said):
    assert written(Estimate(value, low, high, looked=(95, 120)), unit) == said


@pytest.mark.parametrize(
    ("tail", "said"),
    [([1.2, 1.1, 1.3, 0.8, 0.7, 0.6], "108 m"), ([0.9] * 6, "below 95 m"), ([1.1] * 6, "none")],
)
def test_a_crossing_says_among_which_heights_it_was_sought(tail, said):
    """Water-filling's rate over the proposed scheme's at 95, 100, ... 120 m, without luck."""
    outcomes = [
        Outcome(setup.point(20), {"sum_rate": np.full((2, 20, 10), 1.0) * rates}, {})
        for setup, ratio in zip(map(height, HEIGHTS), tail, strict=True)
        for rates in [np.array([1.0, ratio])[:, None, None]]
    ]
    (claim,) = (one for one in ALL if one.id == "crossing-of-tails")
    found = claim.measure(Results(outcomes, 20, 0))
    assert written(found.headline, found.unit) == said


def finding(value: float, low: float, high: float) -> Finding:
    measured = Measured({"crossing": Estimate(value, low, high)}, "m")
    claim = Claim("c", "t7-1", "text", "105 to 110 m", "read", lambda r: measured, near(107.0))
    return Finding(claim, claim.measure(Results([], 20, 0)))


def test_claims_are_strict_json_whatever_was_measured():
    found = [finding(107.0, 104.0, 110.0), finding(np.inf, np.inf, np.inf), finding(np.nan, 1, 2)]
    text = json.dumps(document(found), allow_nan=False)
    first, second, third = json.loads(text)["claims"]
    assert set(first) == {
        "id", "figure", "text", "paper", "ours", "interval", "reading", "verdict"
    }  # fmt: skip
    assert (first["ours"], first["interval"]) == (107.0, [104.0, 110.0])
    assert (second["ours"], second["interval"], third["ours"]) == (None, None, None)
    row = "| t7-1 | **c**: text | 105 to 110 m | crossing: 107.0 (104.0 to 110.0) m | reproduced |"
    assert row in page(found, Results([], 20, 0))
