"""The loop over slots: predict, transmit, link, sense, update, advance."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from time import perf_counter
from types import TracebackType
from typing import Any

import numpy as np

from echobeam.brief import html_table
from echobeam.physics.transmission import undirected_power
from echobeam.schemes.answers import check_identities, check_tracks
from echobeam.schemes.base import Decision, SchemeError, SchemeRunError, View, reported
from echobeam.schemes.configure import ConfiguredScheme
from echobeam.schemes.failures import failure, is_users, users_traceback
from echobeam.simulation.decisions import first_decision
from echobeam.simulation.detections import Sensed, detect
from echobeam.simulation.examine import examine_decision
from echobeam.simulation.randomness import SchemeNormals, Use, scheme_key
from echobeam.simulation.receiver import by_identity, receive
from echobeam.simulation.scoring import about_objects, axis_of, scored, unscored
from echobeam.simulation.sensor import sense
from echobeam.simulation.world import World
from echobeam.values import (
    NOBODY,
    Array,
    BoolArray,
    ComplexArray,
    Detections,
    IntArray,
    Mode,
    ModeArray,
    Status,
    Tracks,
    freeze,
    with_beams,
)


@dataclass(frozen=True, slots=True)
class SlotRecord:
    """Record of one slot; leading axes as the run's.

    Names, shapes and units are those of the result file: states are rad, m, m/s; measurements
    rad, s, Hz; positions m; beams sqrt(power); rates bit/s/Hz. ``messages`` are the reasons of
    fallbacks by trial. ``decision_seconds`` is the time of `transmit` per trial, NaN where it was
    not taken; no result file has it. The last five are those of unlabelled runs, else None.
    """

    slot: int
    time: float
    uav_position: Array
    uav_velocity: Array
    identity: IntArray
    present: BoolArray
    position: Array
    truth: Array
    mode: ModeArray
    covered: Array
    predicted: Array
    predicted_cov: Array
    estimated: Array
    estimated_cov: Array
    measured: Array
    measured_var: Array
    true_var: Array
    beam: ComplexArray
    sinr: Array
    rate: Array
    radar_snr: Array
    fallback: BoolArray
    messages: dict[int, str]
    decision_seconds: float
    shared: BoolArray | None = None
    track_id: IntArray | None = None
    track_status: ModeArray | None = None
    track_object: IntArray | None = None
    track_state: Array | None = None

    @property
    def cover(self) -> Array:
        """Covers of the ground's geometry, ``(T, K, 2, 2)``: what `covered` is there."""
        return self.covered

    @property
    def phase(self) -> str:
        """Name of the mode, "mixed" where trials differ."""
        modes = np.unique(self.mode).tolist()
        return (Mode(modes[0]) if len(modes) == 1 else Mode.MIXED).name.lower()

    def __repr__(self) -> str:
        """Return slot, mode and mean sum rate in one line."""
        total = float(np.nansum(self.rate, axis=-1).mean())
        return f"<SlotRecord slot {self.slot}: {self.phase}, {total:.4g} bit/s/Hz>"

    def _repr_html_(self) -> str:
        """Return the key numbers as a table, for notebooks."""
        shown = ("time", "truth", "estimated", "rate", "sinr", "covered", "fallback")
        rows = {name: getattr(self, name) for name in shown}
        return html_table(f"Slot {self.slot}: {self.phase}", rows)


def run_slots(world: World, configured: ConfiguredScheme) -> Iterator[SlotRecord]:
    """Yield the record of every slot of a block of trials.

    Parameters
    ----------
    world
        Nature in the first slot.
    configured
        The scheme and its system.

    Raises
    ------
    SchemeRunError
        If the scheme raises, or its answer is not what the contract asks for.
    """
    uav_before, memory = world.uav, None
    last_look = np.zeros(len(world.trials), dtype=np.int64)
    belief: Any = None
    score = None if _by_label(world, configured) else unscored(len(world.trials))
    for slot in range(world.scene.scenario.n_slots):
        view = _view(world, configured, uav_before, memory, last_look)
        if slot == 0:
            _load(configured.scheme)
            belief = _ask(configured, "start", world, view)
        prior = _ask(configured, "predict", world, belief, view)
        predicted = _tracks(configured, prior, "predict", world)
        decision, seconds = _decide(configured, world, prior, predicted, view)
        owner = decision.addressee if score is None else score.of(decision.addressee)
        link = world.link(decision, owner)
        detections, sensed = _sense(world, decision, predicted, labels=score is None)
        view = replace(
            view,
            sent=decision.sent,
            mode=decision.mode,
            normals=_normals(world, Use.SCHEME_UPDATE),
        )
        belief = _ask(configured, "update", world, prior, detections, view)
        estimated = _tracks(configured, belief, "update", world)
        roster = _identities(world)
        reports, about = estimated, estimated.id
        if score is not None:
            truth, identity, axis = world.state, world.identity, axis_of(world.scene.scenario)
            predicted = about_objects(predicted, score, truth, identity, world.uav, axis)
            score = scored(estimated, truth, identity, score, axis)
            about = score.identity
            estimated = about_objects(estimated, score, truth, identity, world.uav, axis)
        own = _track_record(world, reports, about)
        yield SlotRecord(
            slot=slot + 1,
            time=slot * world.scene.scenario.frame.slot,
            uav_position=world.uav.position,
            uav_velocity=world.uav.velocity,
            identity=roster,
            present=np.broadcast_to(world.present, roster.shape),
            position=_spread_out(world.ground.position, view),
            truth=_spread_out(world.state, view),
            mode=decision.mode.copy(),  # copies: a scheme may use its arrays again
            covered=_for_objects(
                owner, roster, _carried(decision, decision.covered), np.nan
            ).copy(),
            predicted=by_identity(predicted, roster, predicted.mean).copy(),
            predicted_cov=by_identity(predicted, roster, predicted.cov).copy(),
            estimated=by_identity(estimated, roster, estimated.mean).copy(),
            estimated_cov=by_identity(estimated, roster, estimated.cov).copy(),
            measured=sensed.measured,
            measured_var=sensed.measured_var,
            true_var=sensed.true_var,
            beam=_beams(decision, owner, roster).copy(),
            sinr=link.sinr,
            rate=link.rate,
            radar_snr=sensed.snr,
            fallback=decision.fallback.copy(),
            messages=decision.messages or {},
            decision_seconds=seconds,
            shared=_shared(decision, owner, roster) if own else None,
            **own,
        )
        uav_before, memory = world.uav, decision.memory
        last_look = np.where(undirected_power(decision.sent) > 0.0, slot + 1, last_look)
        if slot + 1 < world.scene.scenario.n_slots:
            world = world.advance()


def _by_label(world: World, configured: ConfiguredScheme) -> bool:
    """Return whether a scheme is told who is there; one that sees the truth always is."""
    return configured.scheme.omniscient or not world.scene.scenario.unlabelled


def _identities(world: World) -> IntArray:
    """Return who is in each column, ``(T, K)``."""
    return np.tile(world.identity, (len(world.trials), 1))


def _sense(
    world: World, decision: Decision, predicted: Tracks, *, labels: bool
) -> tuple[Detections, Sensed]:
    """Return what the scheme is given of the slot's echoes, and what the record says of them."""
    if not labels:
        return detect(world, decision)
    echoes = sense(world, decision)
    knowledge = world.scene.scenario.radar.variance
    detections = receive(
        echoes, world.identity, predicted, decision.sent, world.scene, world.uav, knowledge
    )
    return detections, Sensed(echoes.snr, detections.value, detections.variance, echoes.variance)


def _track_record(world: World, tracks: Tracks, about: IntArray) -> dict[str, Any]:
    """Return what the record of an unlabelled run says of the tracks, nothing of a labelled one."""
    if not world.scene.scenario.unlabelled:
        return {}
    known = tracks.known
    return {
        "track_id": np.where(known, tracks.id, NOBODY),
        "track_status": tracks.status.astype(np.int8),
        "track_object": np.where(known, about, NOBODY),
        "track_state": np.where(known[..., None], tracks.mean, np.nan),
    }


def _shared(decision: Decision, owner: IntArray, roster: IntArray) -> BoolArray:
    """Return whether an object ``(T, K)`` is served in turns with others, by one stream."""
    if decision.carrier is None:
        return np.zeros(roster.shape, dtype=bool)
    carrier = np.where(decision.addressee == NOBODY, NOBODY, decision.carrier)
    alike = carrier[..., None] == carrier[:, None, :]
    shared = (alike.sum(axis=-1) > 1) & (carrier != NOBODY)
    return np.asarray(_for_objects(owner, roster, shared, False))


def _view(
    world: World, configured: ConfiguredScheme, uav_before: Any, memory: Any, last_look: IntArray
) -> View:
    """Return the knowledge of the UAV; the truth only for a scheme that declares to see it."""
    by_label = _by_label(world, configured)
    # Not a slice: whoever looks behind one finds the whole array.
    roster = _identities(world) if by_label else np.zeros((len(world.trials), 0), dtype=np.int64)
    freeze(roster, last_look)
    return View(
        slot=world.slot + 1,
        uav=world.uav,
        uav_before=uav_before,
        system=configured.system,
        roster=roster,
        memory=memory,
        normals=_normals(world, Use.SCHEME),
        last_look=last_look,
        truth=_true_tracks(world, roster) if configured.scheme.omniscient else None,
    )


def _normals(world: World, use: Use) -> Callable[[tuple[int, ...]], Array]:
    """Return the draws that a scheme may ask for in a slot."""
    return SchemeNormals(scheme_key(world.seed), world.trials, world.slot, use)


def _true_tracks(world: World, roster: IntArray) -> Tracks:
    """Return the truth as tracks without uncertainty."""
    mean = np.broadcast_to(world.state, (*roster.shape, world.state.shape[-1]))
    there = np.broadcast_to(world.present, roster.shape)
    zero = np.zeros((mean.shape[-1],) * 2)
    return Tracks(
        mean=mean,
        cov=np.where(there[..., None, None], zero, np.nan),
        status=np.where(there, Status.CONFIRMED, Status.NONE).astype(np.int8),
        id=roster,
    )


def _ask(configured: ConfiguredScheme, call: str, world: World, *arguments: object) -> Any:
    """Call a scheme, see `_Answering`."""
    with _Answering(configured, call, world):
        return getattr(configured.scheme, call)(*arguments)


@dataclass(frozen=True, slots=True)
class _Answering:
    """Context in which a scheme's code runs, or its answer is examined: a fault is one message.

    No generator: in one, Python has a meaning of its own for what a scheme may raise.
    """

    configured: ConfiguredScheme
    call: str
    world: World

    def __enter__(self) -> None:
        """Let the scheme answer."""

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Raise what went wrong as one message.

        Raises
        ------
        SchemeRunError
            With file and line of what the scheme's code raised; a fault of our own goes on as it
            is, and so does an interruption.
        """
        if error is None or isinstance(error, (KeyboardInterrupt, SchemeRunError)):
            return
        if isinstance(error, SchemeError):
            raise SchemeRunError(str(error), error.details) from error
        if is_users(error) or _is_built_outside(self.configured.scheme):
            first, last = self.world.trials[0], self.world.trials[-1]
            trials = f"trial {first}" if first == last else f"trials {first} to {last}"
            raise SchemeRunError(
                f"{failure(error)} (scheme {self.configured.name!r}, {self.call} of slot "
                f"{self.world.slot + 1}, {trials})",
                users_traceback(error),
            ) from error


def _is_built_outside(scheme: object) -> bool:
    """Whether a scheme or one of its parts is not ours: what it answers may make our code fail."""
    parts = [getattr(scheme, part, None) for part in ("frame", "tracker", "beamer")]
    function = getattr(parts[-1], "function", None)
    modules = [str(one.__module__) for one in (scheme, *parts, function) if one is not None]
    return any(module.partition(".")[0] != "echobeam" for module in modules)


def _tracks(configured: ConfiguredScheme, belief: object, call: str, world: World) -> Tracks:
    """Return the tracks of a belief, examined and protected from being written to."""
    label = f"scheme {configured.name!r}, tracks from {call} of slot {world.slot + 1}"
    with _Answering(configured, call, world):
        tracks = reported(belief, f"scheme {configured.name!r}", call)
        check_tracks(label, tracks, len(world.trials), configured.system.geometry.space.size)
        if not _by_label(world, configured):
            check_identities(label, tracks)
    freeze(tracks.mean, tracks.cov, tracks.status)
    return tracks


def _decide(
    configured: ConfiguredScheme, world: World, prior: Any, predicted: Tracks, view: View
) -> tuple[Decision, float]:
    """Return the decision and its seconds per trial; NaN without directional trials."""
    begun = perf_counter()
    decision: Decision = _ask(configured, "transmit", world, prior, view)
    seconds = (perf_counter() - begun) / view.n_trials
    with _Answering(configured, "transmit", world):
        examine_decision(configured.name, decision, predicted, view)
    freeze(decision.sent.beams)
    timed = bool(with_beams(decision.mode).any())
    if timed and _is_built_outside(configured.scheme):
        timed = not first_decision(configured.name)
    return decision, seconds if timed else np.nan


def _load(scheme: object) -> None:
    """Load what our own schemes need for their decisions, so that none is timed with it."""
    if not _is_built_outside(scheme):
        for part in (scheme, getattr(scheme, "beamer", None)):
            getattr(part, "load", lambda: None)()


def _spread_out(values: Array, view: View) -> Array:
    """Return values of the objects ``(1 or T, K, ...)`` for every trial."""
    return np.broadcast_to(values, (view.n_trials, *values.shape[1:]))


def _for_objects(owner: IntArray, roster: IntArray, values: Any, missing: Any) -> Any:
    """Return values of the streams ``(T, C, ...)`` in the order of the roster ``(T, K, ...)``.

    ``owner`` ``(T, C)`` is the identity of the object that each stream is for.
    """
    if owner.shape == roster.shape and np.array_equal(owner, roster):
        return values
    trailing = (1,) * (values.ndim - 2)
    if owner.shape[-1] == 0:
        return np.full((*roster.shape, *values.shape[2:]), missing, dtype=values.dtype)
    match = (owner[:, None, :] == roster[..., None]) & (roster != NOBODY)[..., None]
    place = np.argmax(match, axis=-1).reshape(*roster.shape, *trailing)
    found = match.any(axis=-1).reshape(*roster.shape, *trailing)
    return np.where(found, np.take_along_axis(values, place, axis=1), missing)


def _carried(decision: Decision, values: Any) -> Any:
    """Return values of the streams ``(T, C, ...)`` for the addressees that they carry."""
    if decision.carrier is None:
        return values
    column = decision.carrier.reshape(*decision.carrier.shape, *(1,) * (values.ndim - 2))
    return np.take_along_axis(values, column, axis=1)


def _beams(decision: Decision, owner: IntArray, roster: IntArray) -> ComplexArray:
    """Return the beam for each object: zero if none, NaN in omnidirectional and pilot slots."""
    sent = _carried(decision, decision.sent.beams)
    beams: ComplexArray = _for_objects(owner, roster, sent, 0.0)
    directional = with_beams(decision.mode)
    if directional.all():
        return beams
    return np.where(directional[:, None, None], beams, complex(np.nan, np.nan))


def first_trial(record: SlotRecord) -> SlotRecord:
    """Return the record of a block's first trial, without the leading axis."""
    shared = ("slot", "time", "uav_position", "uav_velocity", "messages", "decision_seconds")
    fields = {name: getattr(record, name) for name in SlotRecord.__slots__ if name not in shared}
    first: dict[str, Any] = {name: None if v is None else v[0] for name, v in fields.items()}
    return replace(record, **first)
