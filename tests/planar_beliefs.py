"""Random beliefs about two direction cosines, and their expected rates by Monte Carlo."""

import numpy as np

from echobeam.beamforming.expected.beliefs import BeliefBatch
from echobeam.physics.planar import PlanarArray


def axes_of(angle, stds):
    """Principal axes by row, ``(..., 2, 2)``, as long as ``stds``, turned by ``angle``."""
    x, y = np.cos(angle), np.sin(angle)
    rows = np.stack([np.stack([x, y], axis=-1), np.stack([-y, x], axis=-1)], axis=-2)
    return rows * np.asarray(stds)[..., None]


def beliefs(trials, objects, array, std, snr, seed=0, **options):
    """Return beliefs of random places; ``std`` of the longer axis, ``snr`` of a matched beam."""
    draw = np.random.default_rng(seed)
    shape = trials, objects
    stds = std * np.array([1.0, 0.4]) * draw.uniform(0.5, 1.5, (*shape, 1))
    defaults = {
        "angles": draw.uniform(-0.5, 0.5, (*shape, 2)),
        "deviation": axes_of(draw.uniform(0.0, np.pi, shape), stds),
        "loss": array.elements / snr * draw.uniform(0.5, 2.0, shape),
        "stretch": np.zeros((*shape, 2)),
        "active": np.ones(shape, dtype=bool),
        "min_rate": np.zeros(objects),
        "power": 1.0,
        "array": array,
    }
    return BeliefBatch(**defaults | options)


def rates_at(given, beams, z):
    """Return ``(T, K, M)`` bit/s/Hz at standard normals z ``(T, K, M, 2)`` along the axes."""
    shift = np.einsum("tkma,tkab->tkmb", z, given.deviation)
    array = PlanarArray(*given.array.shape, given.array.spacing)
    steering = array.steering(given.angles[..., None, :] + shift)
    beams = beams.reshape(*beams.shape[:2], -1, array.n)  # by polarisation
    power = np.sum(np.abs(np.einsum("tkmn,tipn->tkmip", steering.conj(), beams)) ** 2, axis=-1)
    own = np.einsum("tkmk->tkm", power)
    loss = given.loss[..., None] * (1.0 + np.einsum("tkmb,tkb->tkm", shift, given.stretch)) ** 2
    return np.log2(1.0 + own / (power.sum(axis=-1) - own + loss))
