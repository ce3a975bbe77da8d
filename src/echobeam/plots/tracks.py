"""Tracks and objects of one trial of unlabelled detections: positions over slots."""

from __future__ import annotations

from itertools import cycle
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from echobeam.plots.looks import (
    BLACK,
    BLUE,
    DASHED,
    DOTTED,
    GREEN,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    LineStyle,
    Look,
)
from echobeam.plots.record import Axis, FigureData, Guide, Note, Panel, Series
from echobeam.plots.scene import occupants
from echobeam.plots.source import Source, shaded
from echobeam.values import NOBODY, Array, BoolArray, IntArray, Mode, Status

_COLOURS = (BLUE, ORANGE, GREEN, PURPLE, SKY)
"""Colours of tracks in their order; black is that of objects, vermilion of tracks of none."""

_LINES: dict[Status, LineStyle] = {
    Status.TENTATIVE: DOTTED, Status.CONFIRMED: "-", Status.COASTING: DASHED,
}  # fmt: skip
_WIDTH, _TRUE_WIDTH = 2.2, 0.7
_MOST_NUMBERS = 12
"""Largest number of tracks whose identities are written: more would cover each other."""

_APPEARS, _LEAVES = Look(BLACK, ">", ""), Look(BLACK, "s", "")
_FALSE = Look(VERMILION, "x", "")


class Track(NamedTuple):
    """Track of one identity: places ``x`` (slot,) in m, NaN without it, ``status`` and ``about``.

    ``about`` is the identity of the object that it was scored against, `NOBODY` for none.
    ``birth`` is the index of its first slot; its ``colour`` is vermilion if it never was about one.
    """

    id: int
    x: Array
    status: IntArray
    about: IntArray
    birth: int
    colour: str

    def within(self, slots: slice) -> Track:
        """Return the track in some of the slots, with the birth counted from their first."""
        return self._replace(
            x=self.x[slots], status=self.status[slots], about=self.about[slots],
            birth=self.birth - slots.start,
        )  # fmt: skip

    @property
    def false(self) -> BoolArray:
        """Slots in which the track is confirmed and about no object."""
        false: BoolArray = (self.status >= Status.CONFIRMED) & (self.about == NOBODY)
        return false


class Paths(NamedTuple):
    """Tracks and objects over the other coordinate of a panel.

    ``across`` is that of each track, ``(slot,)``; ``identity``, ``true`` and ``at``, the objects'
    own coordinates, are ``(slot, object)``.
    """

    found: list[Track]
    across: list[Array]
    identity: IntArray
    true: Array
    at: Array

    def series(self) -> tuple[Series, ...]:
        """Return tracks, objects, and marks of confirmed tracks of none."""
        pairs = zip(self.found, self.across, strict=True)
        series = [part for track, across in pairs for part in _track_series(track, across)]
        series += _object_series(self.identity, self.true, self.at)
        return (*series, *_false_series(self.found, self.across))


def tracks(source: Source) -> FigureData:
    """Return the objects of one trial and the tracks of one scheme along the road, over slots.

    Objects are thin black lines, with marks where they appear and leave. Tracks are wide lines in
    a colour by their identity: dotted while tentative, dashed while coasting. Tracks that were
    never about an object are vermilion; so is a cross in every slot in which a confirmed track was
    about none. A vertical array cannot distinguish the sides of the road below it: positions are
    distances from the UAV along the road there.
    """
    one = source.one_trial(
        "identity", "position", "uav_position", "mode", "track_id", "track_status",
        "track_object", "track_state",
    ).transpose("slot", "object", "track", "state", "axis")  # fmt: skip
    vertical = source.scenario.array.axis == "vertical"
    uav = one["uav_position"].values[:, :1]
    true = one["position"].values[..., 0]
    along = one["track_state"].values[..., 1] * np.cos(one["track_state"].values[..., 0])
    true, along = (np.abs(true - uav), np.abs(along)) if vertical else (true, uav + along)
    id, status, about = (one[f"track_{name}"].values for name in ("id", "status", "object"))
    found = [track.within(source.stretch) for track in read_tracks(id, status, about, along)]
    found = [track for track in found if np.isfinite(track.x).any()]
    one = one.isel(slot=source.stretch)
    slots = one["slot"].values.astype(float)
    paths = Paths(found, [slots] * len(found), one["identity"].values, true[source.stretch],
                  np.broadcast_to(slots[:, None], true[source.stretch].shape))  # fmt: skip
    name = "|x| from the UAV, both sides as one" if vertical else "Position along the road"
    panel = Panel(
        source.slot_axis(), Axis(name, "m"), paths.series(),
        guides=omni_spells(one["mode"].values, slots), notes=_numbers(paths),
        empty="no object and no track",
    )  # fmt: skip
    return FigureData(
        "tracks", source.title, (panel,), source.setting(source.one_scheme(), one_trial=True),
        size=(7.16, 3.6), key=track_key(found),
    )  # fmt: skip


def read_tracks(id: IntArray, status: IntArray, about: IntArray, along: Array) -> list[Track]:
    """Return the tracks of one trial, in the order of their identities.

    Parameters
    ----------
    id, status, about, along
        ``(slot, track)``: identity, stage, object and position of the track in each column.
    """
    found, colours = [], cycle(_COLOURS)
    for one in np.unique(id[id != NOBODY]):
        own = id == one
        # one column at most in each slot: the largest value is that of the track
        x = np.where(own.any(axis=1), np.where(own, along, -np.inf).max(axis=1), np.nan)
        stage = np.where(own, status, Status.NONE).max(axis=1)
        whom = np.where(own, about, NOBODY).max(axis=1)
        colour = next(colours) if (whom != NOBODY).any() else VERMILION
        birth = int(np.argmax(own.any(axis=1)))
        found.append(Track(int(one), x, stage, whom, birth, colour))
    return found


def track_key(found: list[Track]) -> tuple[tuple[str, Look], ...]:
    """Return the legend of what is drawn."""
    entries = [("object", Look(BLACK))]
    for status, style in _LINES.items():
        if any((track.status == status).any() for track in found):
            entries.append((f"{status.name.lower()} track", Look(BLUE, "", style)))
    if any(track.colour == VERMILION for track in found):
        entries.append(("track never of an object", Look(VERMILION, "", DOTTED)))
    return tuple(entries)


def _track_series(track: Track, across: Array) -> list[Series]:
    """Return a dot at a track's birth and its line in parts, one for each stage of its life.

    The stage of a slot has the line up to the next slot. ``across`` is the other coordinate of the
    panel, ``(slot,)``.
    """
    colour, name, parts = track.colour, f"track {track.id}", []
    if track.birth >= 0:
        first = slice(track.birth, track.birth + 1)
        parts.append(Series(f"{name}, first slot", across[first], track.x[first],
                            look=Look(colour, "."), kind="points", legend=False))  # fmt: skip
    for status, style in _LINES.items():
        own = track.status == status
        spells = np.flatnonzero(np.diff(own, prepend=False, append=False)).reshape(-1, 2)
        if spells.size:
            at, x = (
                np.concatenate(
                    [np.append(values[start : end + 1], np.nan) for start, end in spells]
                )
                for values in (across, track.x)
            )
            parts.append(
                Series(f"{name}, {status.name.lower()}", at, x, look=Look(colour, "", style),
                       kind="line", width=_WIDTH, legend=False)
            )  # fmt: skip
    return parts


def _object_series(identity: IntArray, true: Array, across: Array) -> list[Series]:
    """Return the objects' paths, and their places when they appear and leave within the slots.

    All are ``(slot, object)``.
    """
    stays = [(k, one) for k in range(identity.shape[1]) for one in occupants(identity[:, k])]
    series = [
        Series(f"object {identity[stay.start, k] + 1}", across[stay, k], true[stay, k],
               look=Look(BLACK), kind="line", width=_TRUE_WIDTH, legend=False)
        for k, stay in stays
    ]  # fmt: skip
    ends = {
        "appears": (_APPEARS, [(stay.start, k) for k, stay in stays if stay.start > 0]),
        "leaves": (_LEAVES, [(stay.stop - 1, k) for k, stay in stays if stay.stop < len(true)]),
    }
    for name, (look, places) in ends.items():
        if places:
            at, column = np.array(places).T
            series.append(
                Series(
                    name,
                    across[at, column],
                    true[at, column],
                    look=look,
                    kind="points",
                    hollow=True,
                )
            )
    return series


def _false_series(found: list[Track], across: list[Array]) -> list[Series]:
    """Return the places of confirmed tracks that were about no object, if any."""
    some = [(track, at) for track, at in zip(found, across, strict=True) if track.false.any()]
    if not some:
        return []
    at = np.concatenate([at[track.false] for track, at in some])
    x = np.concatenate([track.x[track.false] for track, _ in some])
    return [Series("confirmed track of no object", at, x, look=_FALSE, kind="points")]


def _numbers(paths: Paths) -> tuple[Note, ...]:
    """Return the identities of the tracks beside their first slots, if they are few."""
    known = [
        (track, at)
        for track, at in zip(paths.found, paths.across, strict=True)
        if (track.status >= Status.CONFIRMED).any()
    ]
    if not 0 < len(known) <= _MOST_NUMBERS:
        return ()
    births = [int(np.flatnonzero(np.isfinite(track.x))[0]) for track, _ in known]
    first = np.array([track.x[i] for (track, _), i in zip(known, births, strict=True)])
    beside = np.where(first > first.mean(), -8.0, 8.0)  # on the inner side, within the panel
    return tuple(
        Note(str(track.id), float(at[i]), float(track.x[i]), "0.25", offset=(5.0, float(up)))
        for (track, at), i, up in zip(known, births, beside, strict=True)
    )


def omni_spells(mode: npt.NDArray[np.integer], slots: Array) -> tuple[Guide, ...]:
    """Return the slots of the trial without directional beams as shaded bands."""
    kinds = [one for one in (Mode.OMNI, Mode.PILOT) if (mode == one).any()]
    name = " or ".join(one.name.lower() for one in kinds) + " slot"
    return shaded(slots[np.isin(mode, kinds)], name)
