"""Beams of largest expected rate in two polarisations, against bounds and laws of their own."""

from __future__ import annotations

import numpy as np
import pytest

import echobeam as eb
from echobeam.beamforming.expected.beliefs import BeliefBatch
from echobeam.beamforming.expected.design import design_expected


def beliefs(polarisations, centres, stds, snr, floors=0.0, side=8):
    """One trial: deviations along u and v, an SNR of matched beams with all the power."""
    array = eb.PlanarArray(side, side, polarisations=polarisations)
    count = len(centres)
    return BeliefBatch(
        angles=np.array([centres], dtype=float),
        deviation=np.array([[np.diag(pair) for pair in stds]]),
        loss=np.full((1, count), array.elements / snr),
        stretch=np.zeros((1, count, 2)),
        active=np.ones((1, count), dtype=bool),
        min_rate=np.full(count, floors),
        power=1.0,
        array=array,
    )


def dense(belief, k, count=61, reach=4.5):
    """Steering vectors and weights of a fine grid of one object's belief, in front of the array."""
    line = np.linspace(-reach, reach, count)
    z = np.stack(np.meshgrid(line, line, indexing="ij"), axis=-1).reshape(-1, 2)
    weight = np.exp(-0.5 * np.sum(z**2, axis=-1))
    cosines = belief.angles[0, k] + z @ belief.deviation[0, k]
    seen = np.sum(cosines**2, axis=-1) <= 1.0
    weight, cosines = weight[seen], cosines[seen]
    return belief.array.steering(cosines), weight / weight.sum()


def columns(belief, answer):
    """Beams ``(K, P, N)``."""
    return answer.beams[0].reshape(len(belief.angles[0]), -1, belief.array.elements)


def value_of(a, weight, loss, W):
    """Expected rate of one object in nats, its slope by W, and the received power."""
    gain = np.einsum("gn,nm,gm->g", a.conj(), W, a).real / loss
    slope = weight / (1.0 + gain) / loss
    return weight @ np.log1p(gain), (a.T * slope) @ a.conj(), gain


def alone(belief, answer, steps=60):
    """Expected rate of one object in nats, and a bound on that of covariances of any rank.

    The rate is concave in W, tr W = 1, so that f(W) + lambda_max(G) - tr(G W) bounds it for every
    W; here at those which steps of Frank and Wolfe lead to.
    """
    a, weight = dense(belief, 0, count=25)
    beams, loss = columns(belief, answer)[0], belief.loss[0, 0]
    W = beams.T @ beams.conj()
    lengths = np.linspace(0.0, 0.3, 200) ** 2
    reached, bound = value_of(a, weight, loss, W)[0], np.inf
    for _ in range(steps):
        value, G, gain = value_of(a, weight, loss, W)
        levels, axes = np.linalg.eigh(G)
        bound = min(bound, value + levels[-1] - np.trace(G @ W).real)
        towards = np.abs(a.conj() @ axes[:, -1]) ** 2 / loss
        mixed = gain + lengths[:, None] * (towards - gain)
        length = lengths[np.argmax(np.log1p(mixed) @ weight)]
        W = W + length * (np.outer(axes[:, -1], axes[:, -1].conj()) - W)
    return reached, bound


@pytest.mark.parametrize(("std", "snr"), [(0.02, 100.0), (0.1, 1.0), (0.15, 1e4), (0.25, 100.0)])
def test_no_covariance_is_much_better_than_two_columns(std, snr):
    belief = beliefs(2, [(0.1, 0.2)], [(std, 0.7 * std)], snr)
    value, bound = alone(belief, design_expected(belief))
    assert value <= bound <= value * (1.0 + 2e-3)


def test_a_wide_belief_at_high_snr_gains_by_the_second():
    one, two = (beliefs(p, [(0.1, 0.2)], [(0.15, 0.105)], 1e4) for p in (1, 2))
    first, second = design_expected(one), design_expected(two)
    assert second.expected_rate[0] > first.expected_rate[0] * (1.0 + 3e-4)
    lower, bound = alone(one, first)
    upper, _ = alone(two, second)
    assert lower < upper <= bound
    powers = np.sum(np.abs(columns(two, second)[0]) ** 2, axis=-1)
    assert powers.min() > 1e-3
    assert powers.sum() == pytest.approx(1.0, rel=1e-12)


@pytest.mark.parametrize("seed", range(6))
def test_two_are_never_worse_than_one(seed):
    rng = np.random.default_rng(seed)
    count = 1 + seed % 3
    centres = rng.uniform(-0.5, 0.5, (count, 2))
    stds = rng.uniform(0.02, 0.2, (count, 2))
    snr = 10.0 ** rng.uniform(0.0, 4.0)
    one, two = (design_expected(beliefs(p, centres, stds, snr)) for p in (1, 2))
    assert two.expected_rate[0] >= one.expected_rate[0] * (1.0 - 1e-12)
    assert np.sum(np.abs(two.beams) ** 2) == pytest.approx(1.0, rel=1e-12)


def test_the_expected_rate_is_that_of_the_weights_and_any_mixture_of_the_columns():
    belief = beliefs(2, [(0.1, 0.2), (-0.3, 0.1)], [(0.12, 0.1), (0.1, 0.15)], 1e3)
    answer = design_expected(belief)
    beams = columns(belief, answer)
    phase = np.exp(0.4j)
    mixer = np.array([[0.6, 0.8 * phase], [-0.8 / phase, 0.6]])
    for made in (beams, np.einsum("pq,kqn->kpn", mixer, beams)):
        total = 0.0
        for k in range(2):
            a, weight = dense(belief, k)
            gains = np.sum(np.abs(np.einsum("gn,kpn->gkp", a.conj(), made)) ** 2, axis=-1)
            own = gains[:, k]
            noise = gains.sum(axis=-1) - own + belief.loss[0, k]
            total += weight @ np.log2(1.0 + own / noise)
        assert answer.expected_rate[0] == pytest.approx(total, rel=3e-3)


def test_floors_hold_with_their_probability():
    belief = beliefs(2, [(0.1, 0.2), (-0.4, 0.1)], [(0.08, 0.06), (0.05, 0.1)], 300.0, floors=1.0)
    answer = design_expected(belief)
    assert not answer.fallback[0]
    beams = columns(belief, answer)
    for k in range(2):
        a, weight = dense(belief, k)
        gains = np.sum(np.abs(np.einsum("gn,kpn->gkp", a.conj(), beams)) ** 2, axis=-1)
        rate = np.log2(1.0 + gains[:, k] / (gains.sum(axis=-1) - gains[:, k] + belief.loss[0, k]))
        assert weight @ (rate >= 1.0 - 1e-6) >= 1.0 - belief.outage - 0.01
