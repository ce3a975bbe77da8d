"""The loop over slots: predict, beamform, transmit, echo, measure, update, move."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np

from echobeam.scenario.model import Scenario
from echobeam.schemes.base import Decision, Scheme, SchemeError, System, View
from echobeam.simulation.decisions import rehearse
from echobeam.simulation.world import World
from echobeam.values import (
    PHASES,
    Array,
    BoolArray,
    ComplexArray,
    GaussianState,
    Measurement,
    Phase,
    freeze,
)

POWER_TOLERANCE = 1e-6


@dataclass(frozen=True, slots=True)
class SlotRecord:
    """Everything that happened in one slot; leading axes as the run's.

    Names, shapes and units are those of the result file: states are rad, m, m/s; measurements
    rad, s, Hz; beams sqrt(power); rates bit/s/Hz. ``decision_seconds`` is what `beamform` took
    per trial, NaN in slots without it; no result file has it.
    """

    slot: int
    time: float
    phase: Phase
    truth: Array
    present: BoolArray
    predicted: Array
    predicted_cov: Array
    estimated: Array
    estimated_cov: Array
    measured: Array
    measured_var: Array
    beam: ComplexArray
    sinr: Array
    rate: Array
    radar_snr: Array
    fallback: BoolArray
    decision_seconds: float


@dataclass(frozen=True, slots=True)
class Memory:
    """What passes from one slot to the next on the UAV's side."""

    posterior: GaussianState
    measurement: Measurement
    spread: Array
    scheme: object


def run_slots(scenario: Scenario, scheme: Scheme, world: World) -> Iterator[SlotRecord]:
    """Yield the record of every slot of a block of trials.

    Raises
    ------
    SchemeError
        If the scheme's beams are not finite or radiate more than P_T.
    """
    memory = _blank(world)
    for slot in range(scenario.n_slots):
        truth = world.truth(slot)
        view = _view(scenario, scheme, world, slot, memory)
        prior = _read_only(_ask(scheme, "predict", view, view))
        decision, seconds = _decide(scheme, prior, view)
        sent = world.transmission(view.phase, decision.beams, slot)
        link = world.transmit(sent, truth)
        snr = world.echo(sent, truth)
        heard = _ask(scheme, "listens", view, view)
        measurement = world.measure(sent, snr, truth, heard, view.uav, slot)
        posterior = _read_only(_ask(scheme, "update", view, prior, measurement, view))
        memory = Memory(posterior, measurement, _spread(view, measurement), decision.memory)
        yield SlotRecord(
            slot=slot + 1,
            time=slot * scenario.frame.slot,
            phase=view.phase,
            truth=truth,
            present=world.present(slot),
            predicted=prior.mean,
            predicted_cov=prior.cov,
            estimated=posterior.mean,
            estimated_cov=posterior.cov,
            measured=measurement.value,
            measured_var=measurement.variance,
            beam=decision.beams,
            sinr=link.sinr,
            rate=link.rate,
            radar_snr=snr,
            fallback=decision.fallback,
            decision_seconds=seconds,
        )


def _blank(world: World) -> Memory:
    """Return the memory of a UAV that has seen nothing."""
    shape = (world.luck.shape[0], world.motion.present.shape[1])
    unknown = GaussianState(
        mean=np.full((*shape, 3), np.nan),
        cov=np.full((*shape, 3, 3), np.nan),
        known=np.zeros(shape, dtype=bool),
    )
    nothing = Measurement(np.full((*shape, 3), np.nan), np.full((*shape, 3), np.inf))
    return Memory(unknown, nothing, np.full(shape, np.nan), None)


def _view(scenario: Scenario, scheme: Scheme, world: World, slot: int, memory: Memory) -> View:
    """Return what the scheme may know; objects that left are forgotten."""
    slot_in_frame = slot % scenario.frame.slots_per_frame + 1
    stays = ~world.motion.arrived(slot)
    last = memory.posterior
    posterior = GaussianState(
        mean=np.where(stays[:, None], last.mean, np.nan),
        cov=np.where(stays[:, None, None], last.cov, np.nan),
        known=last.known & stays,
    )
    return View(
        slot=slot + 1,
        slot_in_frame=slot_in_frame,
        phase=_phase(scheme, slot_in_frame),
        uav=world.motion.uav(slot),
        uav_before=world.motion.uav(max(slot - 1, 0)),
        posterior=posterior,
        measurement=memory.measurement,
        spread=np.where(stays, memory.spread, np.nan),
        memory=memory.scheme,
        system=system_of(scenario),
        truth=world.truth(slot) if scheme.omniscient else None,
        present=world.present(slot) if scheme.omniscient else None,
    )


def _phase(scheme: Scheme, slot_in_frame: int) -> Phase:
    phase = scheme.phase(slot_in_frame)
    if phase not in PHASES:
        raise SchemeError(
            f"scheme {scheme.name!r} gives phase {phase!r} for slot {slot_in_frame} of a frame; "
            f"expected {', '.join(PHASES)}"
        )
    return phase


def system_of(scenario: Scenario) -> System:
    """Return the part of a scenario that the UAV knows."""
    return System(
        array=scenario.array,
        radio=scenario.radio,
        filter=scenario.filter,
        coverage=scenario.coverage,
        ripple=scenario.ripple,
        slot_duration=scenario.frame.slot,
    )


def _read_only(state: GaussianState) -> GaussianState:
    """Protect what is recorded from a scheme that writes into what it was shown."""
    freeze(state.mean, state.cov, state.known)
    return state


def _ask(scheme: Scheme, method: str, view: View, *arguments: object) -> Any:
    """Call a scheme; what a user's scheme raises becomes one clear message."""
    call = getattr(scheme, method)
    if type(scheme).__module__.startswith("echobeam."):
        return call(*arguments)
    try:
        return call(*arguments)
    except SchemeError:
        raise
    except (Exception, SystemExit) as error:
        raise SchemeError(
            f"scheme {scheme.name!r} raised {type(error).__name__} in {method} of slot "
            f"{view.slot}: {error}"
        ) from error


def _decide(scheme: Scheme, prior: GaussianState, view: View) -> tuple[Decision, float]:
    """Return the decision and its seconds per trial; no beams outside directional slots."""
    shape = (*prior.known.shape, view.system.array.n_tx)
    if view.phase != "directional":
        nothing = np.full(shape, complex(np.nan, np.nan))
        return Decision(nothing, np.zeros(shape[:-2], dtype=bool), view.memory), np.nan
    rehearse(scheme, prior, view)
    begun = perf_counter()
    decision: Decision = _ask(scheme, "beamform", view, prior, view)
    seconds = (perf_counter() - begun) / shape[0]
    _examine(scheme, decision, view, shape)
    return decision, seconds


def _examine(scheme: Scheme, decision: Decision, view: View, shape: tuple[int, ...]) -> None:
    """Refuse beams of the wrong shape, not finite or too strong; protect the others."""
    if decision.beams.shape != shape:
        raise SchemeError(
            f"scheme {scheme.name!r} sent beams of shape {decision.beams.shape} in slot "
            f"{view.slot}; expected {shape}"
        )
    if not np.isfinite(decision.beams).all():
        raise SchemeError(
            f"scheme {scheme.name!r} sent beams in slot {view.slot} that are not finite"
        )
    freeze(decision.beams)
    most = float(np.max(np.sum(np.abs(decision.beams) ** 2, axis=(-2, -1)), initial=0.0))
    allowed = view.system.radio.power
    if most > allowed * (1.0 + POWER_TOLERANCE):
        raise SchemeError(
            f"scheme {scheme.name!r} radiates {most:.6g} in slot {view.slot}; "
            f"at most radio.power = {allowed:.6g} is allowed"
        )


def _spread(view: View, measurement: Measurement) -> Array:
    """Return sigma_theta of the last slot in which each object was measured."""
    variance = measurement.variance[..., 0]
    measured = np.isfinite(variance)
    return np.where(measured, np.sqrt(np.where(measured, variance, 0.0)), view.spread)


def first_trial(record: SlotRecord) -> SlotRecord:
    """Return the record of a block's first trial, without the leading axis."""
    scalars = ("slot", "time", "phase", "decision_seconds")
    fields = {
        name: getattr(record, name)[0] for name in SlotRecord.__slots__ if name not in scalars
    }
    return replace(record, **fields)
