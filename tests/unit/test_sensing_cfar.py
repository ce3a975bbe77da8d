"""Thresholds: the rate of false alarms against the binomial law, with and without clutter edges."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from echobeam.sensing.cfar import noise_level, threshold_factor, training_cells

KINDS = ["cell-averaging", "ordered-statistic"]
RATE = 1e-3


def alarms(cells, kind, width=12):
    """Return how many of the cells in the middle exceed their threshold, and of how many."""
    place = np.full(cells.shape[:-1], cells.shape[-1] // 2)
    around = training_cells(cells, place, width, 2, 1)
    level = noise_level(around, kind)
    return int(
        (cells[..., cells.shape[-1] // 2] > threshold_factor(2 * width, RATE, kind) * level).sum()
    )


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.slow
def test_noise_alone_raises_false_alarms_at_the_set_rate(kind):
    """400,000 cells under test; the interval holds 99.9 % of all seeds."""
    noise = np.random.default_rng(11).exponential(size=(400_000, 31))
    low, high = stats.binom.interval(0.999, 400_000, RATE)
    assert low <= alarms(noise, kind) <= high


def test_factors_are_those_of_their_integrals():
    """Against P_FA by quadrature over the law of the level."""
    from scipy.integrate import quad

    cells = 24
    factor = threshold_factor(cells, RATE, "cell-averaging")
    over = quad(lambda z: np.exp(-factor * z) * stats.gamma.pdf(z, cells, scale=1 / cells), 0, 20)
    assert over[0] == pytest.approx(RATE, rel=1e-6)
    factor = threshold_factor(cells, RATE, "ordered-statistic")
    # the law of the k-th of W exponentials is that of a beta variable
    law = stats.beta(18, cells - 18 + 1)
    over = quad(lambda u: law.pdf(u) * (1 - u) ** factor, 0, 1)
    assert over[0] == pytest.approx(RATE, rel=1e-6)


def rate_at_an_edge(in_clutter, kind, cells=24, up=10**1.5):
    """Return P_FA of a cell of clutter, of whose training cells so many are in clutter as well.

    Cell averaging: the product of 1 / (1 + factor s_i / W) over the levels s_i of the training
    cells against that of the cell under test; ordered statistic: quadrature over the law of the
    k-th of two kinds of exponentials (Gandhi and Kassam, 1988).
    """
    from scipy.integrate import quad

    factor = threshold_factor(cells, RATE, kind)
    levels = np.where(np.arange(cells) < in_clutter, 1.0, 1.0 / up)
    if kind == "cell-averaging":
        return float(np.prod(1.0 / (1.0 + factor * levels / cells)))

    def at_most(z):
        """Return the probability that the 18th is at most z, by the two numbers below z."""
        strong = stats.binom.pmf(np.arange(25), in_clutter, -np.expm1(-z))
        weak = stats.binom.pmf(np.arange(25), cells - in_clutter, -np.expm1(-z * up))
        return float(np.convolve(strong, weak)[18:].sum())

    # by parts: E exp(-factor Z) = integral of factor exp(-factor z) F(z)
    return quad(lambda z: factor * np.exp(-factor * z) * at_most(z), 0, 5, limit=400)[0]


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("in_clutter", [12, 16, 20, 24])
def test_false_alarms_at_an_edge_of_clutter_follow_the_law_of_both_levels(kind, in_clutter):
    """Clutter 15 dB above the noise; with all training cells in it the rate is the set one."""
    rng = np.random.default_rng(12)
    cells = rng.exponential(size=(200_000, 31))
    cells[:, : 15 - 2 - (in_clutter - 12)] /= 10**1.5
    expected = rate_at_an_edge(in_clutter, kind)
    low, high = stats.binom.interval(0.999, 200_000, expected)
    assert low <= alarms(cells, kind) <= high
    if in_clutter == 24:
        assert expected == pytest.approx(RATE, rel=1e-6)


@pytest.mark.parametrize("kind", KINDS)
def test_noise_beside_clutter_raises_no_more_false_alarms_than_set(kind):
    """The cell under test is the last one before clutter, with half of the training cells in it."""
    cells = np.random.default_rng(14).exponential(size=(200_000, 31))
    cells[:, 16:] *= 10**1.5
    assert alarms(cells, kind) <= stats.binom.ppf(0.999, 200_000, RATE)


@pytest.mark.parametrize("kind", KINDS)
def test_beside_another_echo_only_the_ordered_statistic_still_detects(kind):
    """An echo of 30 dB two cells off, and one of 20 dB under test."""
    rng = np.random.default_rng(13)
    cells = rng.exponential(size=(20_000, 31))
    cells[:, 15] = 100 * rng.exponential(size=20_000)
    cells[:, 20] += 1000
    detected = alarms(cells, kind) / 20_000
    assert (detected > 0.8) == (kind == "ordered-statistic")


def test_training_cells_are_on_both_sides_beyond_the_guard_and_wrap_around():
    cells = np.arange(20.0)[None]
    found = training_cells(cells, np.array([1]), width=2, guard=1, stride=2)
    assert sorted(found[0]) == sorted([(1 - 4) % 20, (1 - 6) % 20, 1 + 4, 1 + 6])
