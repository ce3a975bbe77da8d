"""Errors of the receiver's estimators against the bounds, over SNR and over separation.

One object where the scenario's first one is in slot 1, lit by a beam matched to its direction or by
omnidirectional power; two objects always by the latter. Every trial has data, noise and phase of
its own; the strongest echo is taken, whether it passes the threshold or not, so that outliers below
the threshold count.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from echobeam.brief import Brief
from echobeam.physics import transmission
from echobeam.physics.array import LinearArray
from echobeam.physics.bounds import Crb, measurement_variance
from echobeam.physics.coordinates import direction_of, distance_of
from echobeam.physics.echo import illumination
from echobeam.physics.echo_signal import Scatterers, echo_signal, noise_of
from echobeam.physics.waveform import Waveform, factor, orthogonalised, symbols_of
from echobeam.scenario.checking import ScenarioError
from echobeam.scenario.model import Scenario
from echobeam.sensing.chain import Echo, Processing, angle_by_capon, find_echoes, receiver_of
from echobeam.sensing.directions import mirrored
from echobeam.sensing.target import Receiver
from echobeam.sensing.threads import one_thread
from echobeam.simulation.grid import check_unambiguous, element_noise, waveform_of
from echobeam.simulation.randomness import Use, trial_normals
from echobeam.simulation.scene import scene_of
from echobeam.simulation.signal_sensor import trials_at_once
from echobeam.simulation.world import World, begin
from echobeam.values import Array, BoolArray, ComplexArray, Transmission

TOTALS = tuple(float(total) for total in range(0, 37, 3))
"""SNR after all integration, dB: from where outliers rule to where no error but noise is left."""

SEPARATIONS = (0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0)
"""Separations of two objects in beam widths 1 / (n spacing) of the direction u, or of v where the
array has a single row."""

RESOLUTION_TOTAL = 30.0
"""SNR of each of two objects after all integration, dB."""

Progress = Callable[[int, int], None]


@dataclass(frozen=True, slots=True, repr=False)
class SensingCheck(Brief):
    """Errors and bounds; standard deviations in rad, s and Hz.

    Attributes
    ----------
    directions
        Names of the components of a direction: ``("angle",)``, or ``("u", "v")`` direction
        cosines with ``geometry = "ground"``.
    snr
        ``(n,)``: echo SNR of one receive antenna, Eq. (14) or (16).
    total
        ``(n,)`` dB: the same after the receive array.
    rmse
        Of each quantity and estimator ``(n,)``; NaN of a direction along which the arrays have a
        single antenna.
    bound
        Of each version of the bound and quantity ``(n,)``.
    detected
        ``(n,)``: share of trials whose echo passes the threshold.
    separation
        ``(m,)`` rad, or direction cosine: of two objects of one delay and Doppler.
    resolved
        Of each estimator of the direction ``(m,)``: share of trials in which both objects are found
        within half of their separation; NaN with a single antenna.
    trials
        Number of trials.
    """

    directions: tuple[str, ...]
    snr: Array
    total: Array
    rmse: dict[str, dict[str, Array]]
    bound: dict[str, dict[str, Array]]
    detected: Array
    separation: Array
    resolved: dict[str, Array]
    trials: int


def check_sensing(
    scenario: Scenario,
    trials: int,
    seed: int,
    mode: Literal["directional", "omni"] = "directional",
    progress: Progress = lambda done, total: None,
) -> SensingCheck:
    """Return the errors of the estimators of a scenario's receiver.

    Parameters
    ----------
    scenario
        Its arrays, radar and first object.
    trials, seed
        As for a run.
    mode
        Transmission: a beam matched to the object, or omnidirectional power.
    progress
        Called with the steps done and in all.

    Raises
    ------
    ScenarioError
        If there is no object, or its echo is beyond the waveform's unambiguous delay or Doppler,
        or the scenario has two polarisations.
    """
    setup = _Setup(scenario, trials, seed, mode)
    steps = len(TOTALS) + len(SEPARATIONS)
    errors: list[dict[str, Array]] = []
    for done, total in enumerate(TOTALS):
        with one_thread():
            errors.append(setup.errors(total))
        progress(done + 1, steps)
    resolved: list[dict[str, float]] = []
    for done, beams in enumerate(SEPARATIONS):
        with one_thread():
            resolved.append(setup.resolved(beams))
        progress(len(TOTALS) + done + 1, steps)
    totals = np.array(TOTALS)
    snr = 10.0 ** (0.1 * totals) / setup.receivers
    return SensingCheck(
        directions=setup.directions,
        snr=snr,
        total=totals,
        rmse={
            direction: {name: _rms(errors, f"{direction} {name}") for name in ("capon", "glrt")}
            for direction in setup.directions
        }
        | {
            "delay": {"matched_filter": _rms(errors, "delay")},
            "doppler": {"matched_filter": _rms(errors, "doppler")},
        },
        bound={crb: setup.bounds(snr, crb) for crb in ("paper", "exact")},
        detected=np.array([float(np.mean(one["valid"])) for one in errors]),
        separation=np.array([setup.separated(beams) for beams in SEPARATIONS]),
        resolved={name: np.array([one[name] for one in resolved]) for name in ("capon", "glrt")},
        trials=trials,
    )


def _rms(errors: Sequence[dict[str, Array]], name: str) -> Array:
    return np.array([float(np.sqrt(np.mean(one[name] ** 2))) for one in errors])


class _Setup:
    """One object, what lights it, and the receiver."""

    def __init__(self, scenario: Scenario, trials: int, seed: int, mode: str) -> None:
        if not scenario.n_objects:
            raise ScenarioError(f"{scenario.name}: no objects; expected one to sense")
        world = begin(scene_of(scenario.calm), 0, range(1))
        self.world, self.trials, self.seed = _first_present(world), trials, seed
        radar, law = scenario.radar, world.scene.law
        if scenario.array.polarisations == 2:
            raise ScenarioError(
                f"{scenario.name}: array.polarisations: 2 is not accepted; expected 1"
            )
        self.arrays = law.transmitter, law.receiver
        self.directions = world.scene.geometry.measurement[: law.transmitter.axes]
        self.receivers = law.receiver.n
        self.wave: Waveform = waveform_of(radar)
        self.processing = Processing(radar.filter, radar.cfar, radar.false_alarm)
        self.estimators: dict[str, Processing] = {
            "glrt": self.processing,
            "capon": replace(self.processing, angle="capon"),
        }
        self.noise = element_noise(radar)
        shapes = np.array([law.transmitter.shape, law.receiver.shape]).max(axis=0)
        self.sees = shapes[-law.transmitter.axes :] > 1
        self.step = trials_at_once(radar, max(law.receiver.n, law.transmitter.n))
        self.ideal = self.world.ideal()[0, self.world.present][0]
        self.direction = direction_of(self.ideal, law.transmitter.axes)
        distance = distance_of(self.world.place, law.transmitter.axes)[0, self.world.present]
        if not np.isfinite(distance[0]):
            raise ScenarioError(
                f"{scenario.name}: the first object is behind the array; expected one that it sees"
            )
        check_unambiguous(scenario, self.world.ideal()[:, self.world.present])
        power = scenario.radio.power
        nobody = np.zeros((1, 0), dtype=np.bool_)
        self.everywhere = transmission.omni(nobody, power, law.transmitter.n)
        towards = law.transmitter.steering(self.direction)
        beam = towards * np.sqrt(power / law.transmitter.n)
        matched = transmission.directional(beam[None, None])
        self.sent = self.everywhere if mode == "omni" else matched

    def bounds(self, snr: Array, crb: Crb) -> dict[str, Array]:
        """Return the bounds as standard deviations, ``(n,)`` of each quantity."""
        wave = self.wave
        grid = crb == "exact"
        towards = np.broadcast_to(self.direction, (len(snr), 1, *self.direction.shape))
        variance = measurement_variance(
            _repeated(self.sent, len(snr)), towards, snr[:, None],
            *self.arrays, crb=crb,
            bandwidth=wave.effective_bandwidth if grid else wave.bandwidth,
            pulse_length=wave.effective_duration if grid else wave.duration,
        )[:, 0]  # fmt: skip
        names = (*self.directions, "delay", "doppler")
        return {name: np.sqrt(variance[:, i]) for i, name in enumerate(names)}

    def errors(self, total: float) -> dict[str, Array]:
        """Return the errors of all trials at an SNR after all integration, dB."""
        parts = [
            self._errors(range(first, min(first + self.step, self.trials)), total)
            for first in range(0, self.trials, self.step)
        ]
        return {name: np.concatenate([one[name] for one in parts]) for name in parts[0]}

    def _errors(self, trials: range, total: float) -> dict[str, Array]:
        signal, known = self._signal(trials, total, self.direction[None, None], self.sent)
        found = find_echoes(signal, known, 1, self.processing)
        by_capon = angle_by_capon(signal, found, known)
        angles = {"glrt": found.angle[:, 0], "capon": by_capon[:, 0]}
        errors: dict[str, Array] = {}
        for name, angle in angles.items():
            off = self._off(angle, known)
            for axis, direction in enumerate(self.directions):
                seen = off[:, axis] if self.sees[axis] else np.full(len(trials), np.nan)
                errors[f"{direction} {name}"] = seen
        return errors | {
            "delay": found.delay[:, 0] - self.ideal[-2],
            "doppler": found.doppler[:, 0] - self.ideal[-1],
            "valid": found.valid[:, 0].astype(np.float64),
        }

    def _off(self, angle: Array, known: Receiver) -> Array:
        """Return the errors of estimated directions, ``(T, A)``."""
        if not isinstance(known.receiver, LinearArray):
            return angle - self.direction
        near = np.full(len(angle), self.direction)
        error: Array = mirrored(known.receiver, angle, near) - self.direction
        return error[:, None]

    def separated(self, beams: float) -> float:
        """Return how far two objects so many beam widths apart are, rad or direction cosine."""
        one, two = self._pair(beams)
        return float(np.max(np.abs(one - two)))

    def resolved(self, beams: float) -> dict[str, float]:
        """Return the share of trials in which each estimator finds both of two objects."""
        angles = self._pair(beams)
        if not self.sees.any():
            return dict.fromkeys(self.estimators, np.nan)
        hits: dict[str, list[BoolArray]] = {name: [] for name in self.estimators}
        for first in range(0, self.trials, self.step):
            trials = range(first, min(first + self.step, self.trials))
            signal, known = self._signal(trials, RESOLUTION_TOTAL, angles[None], self.everywhere)
            for name, estimator in self.estimators.items():
                found = find_echoes(signal, known, 2, estimator)
                hits[name].append(_both(found, angles, known))
        return {name: float(np.mean(np.concatenate(one))) for name, one in hits.items()}

    def _pair(self, beams: float) -> Array:
        """Return the directions ``(2,)`` or ``(2, 2)`` of two objects so many beam widths apart."""
        receiver = self.arrays[1]
        if not isinstance(receiver, LinearArray):
            return self._pair_of_cosines(beams)
        u = float(receiver.frequency(self.ideal[0]))
        apart = beams / (receiver.n * receiver.spacing)
        both = u + 0.5 * apart * np.array([-1.0, 1.0])
        top = float(both.max())
        both = both - max(0.0, top - 0.999)
        inverse = np.arcsin if receiver.axis == "vertical" else np.arccos
        pair: Array = inverse(np.clip(both, -0.999, 0.999))
        return pair

    def _pair_of_cosines(self, beams: float) -> Array:
        receiver = self.arrays[1]
        axis = int(np.argmax(self.sees))
        apart = beams / (receiver.shape[axis] * receiver.spacing)
        pair = np.stack([self.direction, self.direction])
        pair[:, axis] += 0.5 * apart * np.array([-1.0, 1.0])
        most = 0.999 * np.sqrt(1.0 - self.direction[1 - axis] ** 2)
        pair[:, axis] -= max(0.0, pair[:, axis].max() - most)
        pair[:, axis] = np.maximum(pair[:, axis], -most)
        return pair

    def _signal(
        self, trials: range, total: float, angles: Array, sent: Transmission
    ) -> tuple[ComplexArray, Receiver]:
        """Return the signal of objects at some angles, each of this SNR, and the receiver."""
        count, wave = len(trials), self.wave
        lit = float(illumination(sent, angles, self.arrays[0])[0, 0])
        precoder, orthogonal = factor(_repeated(sent, count))
        shape = (precoder.shape[-1], wave.subcarriers, wave.symbols, 2)
        streams = symbols_of(wave, trial_normals(self.seed, trials, 0, Use.DATA, shape))
        if orthogonal:
            streams = orthogonalised(streams)
        objects = angles.shape[1]
        pairs = trial_normals(self.seed, trials, 0, Use.FLUCTUATION, (objects, 2))
        phase = np.exp(1j * np.arctan2(pairs[..., 1], pairs[..., 0]))
        energy = 10.0 ** (0.1 * total) * self.noise / (wave.elements * self.receivers * lit)
        ones = np.ones((count, objects))
        scatterers = Scatterers(
            np.repeat(angles, count, axis=0),
            ones * self.ideal[-2],
            ones * self.ideal[-1],
            np.sqrt(energy) * phase,
        )
        size = (self.receivers, wave.subcarriers, wave.symbols, 2)
        noise = noise_of(trial_normals(self.seed, trials, 0, Use.NOISE, size), self.noise)
        signal = echo_signal(scatterers, streams, precoder, wave, self.arrays) + noise
        return signal, receiver_of(self.arrays, wave, streams, precoder, self.noise)


def _repeated(sent: Transmission, count: int) -> Transmission:
    """Return one transmission for so many trials."""
    return Transmission(
        np.repeat(sent.beams, count, axis=0),
        np.repeat(sent.antenna_power, count, axis=0),
        np.repeat(sent.probing, count, axis=0),
    )


def _both(found: Echo, truth: Array, known: Receiver) -> BoolArray:
    """Return in which trials both objects are found within half of their separation."""
    array = known.receiver
    if isinstance(array, LinearArray):
        u, wanted = array.frequency(found.angle)[..., None], array.frequency(truth)[:, None]
    else:
        u, wanted = found.angle, truth
    within = 0.5 * np.sqrt(np.sum((wanted[0] - wanted[1]) ** 2))
    off = np.sqrt(np.sum((u[:, :, None] - wanted) ** 2, axis=-1)) <= within
    straight, crossed = off[:, 0, 0] & off[:, 1, 1], off[:, 0, 1] & off[:, 1, 0]
    both: BoolArray = (straight | crossed) & found.valid.all(axis=-1)
    return both


def _first_present(world: World) -> World:
    """Return nature in the first slot in which an object is present."""
    for _ in range(world.scene.scenario.n_slots - 1):
        if world.present.any():
            return world
        world = world.advance()
    if not world.present.any():
        raise ScenarioError(f"{world.scene.scenario.name}: no object is ever present")
    return world
