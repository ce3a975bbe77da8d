"""Beamers: from a belief to the beams of a directional slot."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Literal

import numpy as np

from echobeam.beamforming.design import design_batch
from echobeam.beamforming.methods import DEFAULT, METHODS
from echobeam.beamforming.problem import ProblemBatch
from echobeam.brief import Brief
from echobeam.faults import InputError
from echobeam.physics.coordinates import cover_shape, direction_of, distance_of
from echobeam.scenario.tables import CoverageTable
from echobeam.schemes.base import System, View
from echobeam.schemes.covers import cover_of
from echobeam.schemes.matched import matched_beams
from echobeam.values import Array, BoolArray, ComplexArray, Tracks, aligned

COVERAGE_KEYS = tuple(CoverageTable.model_fields)


@dataclass(frozen=True, slots=True, repr=False)
class Aim(Brief):
    """Belief that the beams of a slot are made from.

    Attributes
    ----------
    prior
        The prediction of this slot.
    last
        The posterior of the last slot, of the objects that are still on the roster.
    spread
        ``(T, C)`` rad: sigma_theta of the last slot in which the object was measured, the
        standard deviation that (38f) covers; NaN if never. On the ground ``(T, C, 2)``, of both
        direction cosines.
    active
        ``(T,)``: the trials in which beams are sent.
    share
        ``(T,)``: part of the power that is taken from the beams and goes in all directions; None
        for none.
    """

    prior: Tracks
    last: Tracks
    spread: Array
    active: BoolArray
    share: Array | None = None


@dataclass(frozen=True, slots=True, repr=False)
class Beams(Brief):
    """Beams of a slot, see `echobeam.schemes.base.Decision`.

    Attributes
    ----------
    beams
        ``(T, C, N)`` complex, sqrt(power); zero for tracks that are not served.
    covered
        ``(T, C)`` rad, on the ground the matrices ``(T, C, 2, 2)``; NaN without a design.
    fallback
        ``(T,)``.
    messages, memory
        As in `Decision`.
    """

    beams: ComplexArray
    covered: Array
    fallback: BoolArray
    messages: dict[int, str] = field(default_factory=dict)
    memory: Any = None


Target = Literal["prior", "last"]
"""The belief that beams are aimed at: the prediction, or the last posterior (a held estimate)."""


def problems_at(
    place: Array,
    covered: Array,
    active: BoolArray,
    system: System,
    *,
    min_rate: float,
    warm_start: ComplexArray | None = None,
    share: Array | None = None,
) -> ProblemBatch:
    """Return problem (38) for a block of trials, ``(T, C)`` objects each at a place.

    With a share ``(T,)`` of the power in all directions the beams have to be scaled, see
    `System.loss`.
    """
    n_objects = active.shape[-1]
    axes = system.transmitter.axes
    loss = system.loss(distance_of(place, axes), share)
    return ProblemBatch(
        angles=direction_of(place, axes),
        loss=loss,
        coverage_halfwidths=covered,
        active=active & ~np.isinf(loss),
        ripple=np.full(n_objects, system.ripple),
        min_rate=np.full(n_objects, min_rate),
        power=system.radio.power,
        array=system.transmitter,
        resolution=system.coverage.resolution,
        warm_start=warm_start,
    )


@dataclass(frozen=True, slots=True)
class CoverBeamer:
    """Problem (38): the largest sum rate of beams that cover the uncertainty of the angle.

    Attributes
    ----------
    aim
        The belief that the beams are made from.
    cold_every
        Slots after which the beams are sought anew: a start from the last slot's beams may stay
        on a branch that has become the worse one while the uncertainty changed.
    """

    parameters: ClassVar[tuple[str, ...]] = COVERAGE_KEYS

    aim: Target = "prior"
    cold_every: int = 8

    def __post_init__(self) -> None:
        if self.cold_every < 1:
            raise InputError(f"cold_every: {self.cold_every} is not accepted; expected 1 or more")

    def load(self) -> None:
        """Load or compile the solver, so that no decision waits for it."""
        METHODS[DEFAULT].solver()

    def problems(self, aim: Aim, view: View) -> ProblemBatch:
        """Return the problems of a slot, most of them started from the last slot's beams."""
        tracks, geometry = getattr(aim, self.aim), view.system.geometry
        covered, wanted = cover_of(tracks, aim.spread, view)
        active = tracks.known & wanted & aim.active[:, None]
        place = geometry.place(tracks.mean, view.uav)
        if view.system.coverage.centre == "previous":
            before = geometry.place(aim.last.mean, view.uav_before)
            place = np.concatenate(
                [
                    np.where(aim.last.known[..., None], before, place)[..., : geometry.axes],
                    place[..., geometry.axes :],
                ],
                axis=-1,
            )
        directional = view.slot_in_frame - 2  # the paper's frame begins with another slot
        warm = view.memory if directional % self.cold_every else None
        return problems_at(
            place,
            covered,
            active,
            view.system,
            min_rate=view.system.coverage.min_rate,
            warm_start=warm,
            share=aim.share,
        )

    def beams(self, aim: Aim, view: View) -> Beams:
        """Return the optimised beams."""
        problems = self.problems(aim, view)
        answer = design_batch(problems)
        covered = problems.coverage_halfwidths
        covered = np.where(aligned(problems.active, covered), covered, np.nan)
        kept = np.full_like(answer.beams, np.nan) if view.memory is None else view.memory
        memory = np.where(aim.active[:, None, None], answer.beams, kept)
        return Beams(answer.beams, covered, answer.fallback, answer.messages, memory)


@dataclass(frozen=True, slots=True)
class MatchedBeamer:
    """Matched beams w_k = sqrt(p_k / N_t) a(theta_k), water-filling power; they cover nothing."""

    parameters: ClassVar[tuple[str, ...]] = ()

    aim: Target = "prior"

    def beams(self, aim: Aim, view: View) -> Beams:
        """Return the matched beams."""
        tracks, geometry = getattr(aim, self.aim), view.system.geometry
        active = tracks.known & aim.active[:, None]
        place = geometry.place(tracks.mean, view.uav)
        beams = matched_beams(place, active, view.system, aim.share)
        return Beams(
            beams,
            np.full((*active.shape, *cover_shape(geometry.axes)), np.nan),
            np.zeros(len(active), dtype=bool),
        )


@dataclass(frozen=True, slots=True)
class HeldBeams:
    """Beams designed in the second slot of a frame and held until its end.

    In a trial that had nobody to send them to they are designed once it has a track.
    """

    beamer: CoverBeamer | MatchedBeamer

    @property
    def parameters(self) -> tuple[str, ...]:
        """Keys of the scenario that the design depends on."""
        return self.beamer.parameters

    @property
    def aim(self) -> Target:
        """Belief that the held beams are made from."""
        return self.beamer.aim

    def load(self) -> None:
        """Load what the design needs."""
        getattr(self.beamer, "load", lambda: None)()

    def beams(self, aim: Aim, view: View) -> Beams:
        """Return the beams of the frame, none for an object that has left."""
        held = view.memory
        if view.slot_in_frame == 2 or held is None:
            held = self.beamer.beams(aim, replace(view, memory=None))
        stays = aim.last.known
        late = aim.active & stays.any(axis=-1) & ~held.beams.any(axis=(-2, -1))
        if late.any():
            made = self.beamer.beams(replace(aim, active=late), replace(view, memory=None))
            held = _instead(held, made, late)
        return Beams(
            np.where(stays[..., None], held.beams, 0.0),
            np.where(aligned(stays, held.covered), held.covered, np.nan),
            held.fallback,
            held.messages,
            memory=held,
        )


def _instead(held: Beams, made: Beams, trials: BoolArray) -> Beams:
    """Return the held beams, in some trials those made now."""
    return Beams(
        np.where(trials[:, None, None], made.beams, held.beams),
        np.where(aligned(trials, made.covered), made.covered, held.covered),
        np.where(trials, made.fallback, held.fallback),
        (held.messages or {}) | (made.messages or {}),
    )
