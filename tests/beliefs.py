"""Random beliefs, and their expected rates by other means than the design's."""

import numpy as np

from echobeam.beamforming.expected.beliefs import BeliefBatch
from echobeam.physics.array import LinearArray


def beliefs(trials, objects, n, deviation, snr, seed=0, **options):
    """Return beliefs of random places; ``deviation`` in degrees, ``snr`` of a matched beam."""
    draw = np.random.default_rng(seed)
    shape = trials, objects
    defaults = {
        "angles": np.radians(draw.uniform(35.0, 145.0, shape)),
        "deviation": np.radians(deviation) * draw.uniform(0.5, 1.5, shape),
        "loss": n / snr * draw.uniform(0.5, 2.0, shape),
        "stretch": np.zeros(shape),
        "active": np.ones(shape, dtype=bool),
        "min_rate": np.zeros(objects),
        "power": 1.0,
        "array": LinearArray(n),
    }
    return BeliefBatch(**defaults | options)


def rates_at(given, beams, z):
    """Return ``(T, K, M)`` bit/s/Hz at angles ``mean + deviation z``, z of shape ``(T, K, M)``."""
    shift = given.deviation[..., None] * z
    steering = given.array.steering(given.angles[..., None] + shift)
    power = np.abs(np.einsum("tkmn,tin->tkmi", steering.conj(), beams)) ** 2
    own = np.einsum("tkmk->tkm", power)
    loss = given.loss[..., None] * (1.0 + given.stretch[..., None] * shift) ** 2
    foreign = np.einsum("tkmi,ki->tkm", power, 1.0 - np.eye(power.shape[1]))
    return np.log2(1.0 + own / (foreign + loss))


def expected_rate(given, beams):
    """Return ``(T,)`` by the trapezoidal rule on 4,001 angles."""
    z = np.linspace(-6.0, 6.0, 4001)
    weight = np.exp(-0.5 * z * z) / np.sum(np.exp(-0.5 * z * z))
    rate = rates_at(given, beams, np.broadcast_to(z, (*given.angles.shape, z.size)))
    return (rate @ weight).sum(axis=-1)
