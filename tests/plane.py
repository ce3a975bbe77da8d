"""A planar array that looks down on an object on the plane: truth, beams and measurements drawn."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from echobeam.physics.planar import PlanarArray
from echobeam.tracking import filter, ground_start, ground_update
from echobeam.tracking.ground import GroundMeasurement, GroundMotion
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import GaussianState, UavState

RCS, GAIN, BANDWIDTH, PULSE = 28_800.0, 10.0, 80e6, 1e-5
"""The paper's |epsilon|^2, G_m, kappa and iota."""


@dataclass(frozen=True)
class Hovering:
    """An array of ``n x n`` elements that hovers at ``height`` and sends ``power``."""

    n: int = 8
    height: float = 100.0
    power: float = 1.0

    @property
    def array(self):
        return PlanarArray(self.n, self.n)

    @property
    def uav(self):
        return UavState(np.array([0.0, 0.0, self.height]), np.zeros(3))

    @property
    def model(self):
        return GroundMeasurement(30e9, axes=2)

    def gain(self, beams, cosines):
        """Power towards directions ``(T, G, 2)``; beams ``(T, N)`` of unit power, or None: omni."""
        if beams is None:
            return np.full(cosines.shape[:-1], self.power)
        return self.power * self.array.pattern(beams, cosines)

    def variance(self, beams, state):
        """The printed bound for each axis at states ``(T, G, 5)``, ``(T, G, 4)``."""
        seen = self.model.expected(state, self.uav)
        distance = 0.5 * SPEED_OF_LIGHT * seen[..., 2]
        elements = self.n**2
        snr = GAIN * RCS * self.gain(beams, seen[..., :2]) / distance**4
        with np.errstate(divide="ignore"):
            single = 1.0 / (snr * elements**2)
        cosine = 12.0 * single / (np.pi**2 * (self.n**2 - 1))
        return np.stack([cosine, cosine, single / BANDWIDTH**2, single / PULSE**2], axis=-1)

    def rate(self, gain, state):
        seen = self.model.expected(state, self.uav)
        return np.log2(1.0 + gain / (0.5 * SPEED_OF_LIGHT * seen[..., 2]) ** 2)


@dataclass(frozen=True)
class Tracked:
    """Rates over the genie's ``(T,)``, squared errors and innovations, normalised, ``(slots, T)``.

    There is no innovation in the first slot: NaN.
    """

    ratio: np.ndarray
    nees: np.ndarray
    nis: np.ndarray


def tracked(setting, truth, slots=10, seed=1, noise=True, velocity_std=0.5, altitude_std=0.7):
    """Track objects ``(T, 5)``: the first slot omnidirectional, then beams at the prediction."""
    rng = np.random.default_rng(seed)
    uav, model = setting.uav, setting.model
    motion = GroundMotion(0.01, velocity_std, axes=2)
    root = np.linalg.cholesky(motion.noise()[:4, :4] + 1e-15 * np.eye(4))
    aperture = np.pi * (setting.n - 1)
    truth = truth[:, None].copy()
    served, best, nees, nis = (np.full((slots, len(truth)), np.nan) for _ in range(4))
    state, beams = None, None
    for slot in range(slots):
        if slot > 0:
            truth = motion.step(truth, uav)
            if noise:
                truth[..., :4] += rng.standard_normal((len(truth), 1, 4)) @ root.T
            state = filter.predict(state, motion, uav)
            aim = model.expected(state.mean, uav)[:, 0, :2]
            beams = setting.array.steering(aim) / setting.n
        seen = model.expected(truth, uav)
        served[slot] = setting.rate(setting.gain(beams, seen[..., :2]), truth)[:, 0]
        best[slot] = setting.rate(setting.power * setting.n**2, truth)[:, 0]
        true_variance = setting.variance(beams, truth)
        value = seen + np.sqrt(true_variance) * rng.standard_normal(seen.shape)

        def law(trials, beams=beams):
            sent = None if beams is None else beams[trials]
            return lambda states: setting.variance(
                sent, states.reshape(len(states), -1, 5)
            ).reshape(*states.shape[:-1], 4)

        if state is None:
            every = np.arange(len(truth))
            made = ground_start.first_state(
                value, true_variance, law(every), model, uav, (30.0, 30.0, altitude_std), 16
            )
        else:
            made = ground_update.update(state, value, law, model, uav, aperture)
            nis[slot] = made.nis[:, 0]
        state = GaussianState(made.mean, made.cov, np.ones((len(truth), 1), dtype=bool))
        error = (state.mean - truth)[:, 0, :4]
        nees[slot] = (
            error * np.linalg.solve(state.cov[:, 0, :4, :4], error[..., None])[..., 0]
        ).sum(-1)
    return Tracked(served.mean(axis=0) / best.mean(axis=0), nees, nis)
