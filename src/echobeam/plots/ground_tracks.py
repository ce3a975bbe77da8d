"""Tracks and objects of one trial of unlabelled detections on the ground: a map, and over slots."""

from __future__ import annotations

import numpy as np

from echobeam.plots.looks import Look
from echobeam.plots.record import Axis, FigureData, Note, Panel, Series
from echobeam.plots.scene import framed
from echobeam.plots.source import Source
from echobeam.plots.tracks import Paths, omni_spells, read_tracks, track_key
from echobeam.values import Array

_MARGIN, _LEAST = 0.08, 5.0
_NAMES = ("x", "y")


def ground_tracks(source: Source) -> FigureData:
    """Return the objects of one trial and the tracks of one scheme, seen from above and over slots.

    Looks are those of `tracks`.
    """
    one = source.one_trial(
        "identity", "position", "uav_position", "mode", "track_id", "track_status",
        "track_object", "track_state",
    ).transpose("slot", "object", "track", "state", "axis")  # fmt: skip
    id, status, about = (one[f"track_{name}"].values for name in ("id", "status", "object"))
    places = [
        read_tracks(id, status, about, one["track_state"].values[..., axis]) for axis in range(2)
    ]
    shown = [[track.within(source.stretch) for track in tracks] for tracks in places]
    there = [np.isfinite(track.x).any() for track in shown[0]]
    x, y = ([track for track, some in zip(tracks, there, strict=True) if some] for tracks in shown)
    one = one.isel(slot=source.stretch)
    slots = one["slot"].values.astype(float)
    true, identity = one["position"].values[..., :2], one["identity"].values
    at = np.broadcast_to(slots[:, None], identity.shape)
    guides = omni_spells(one["mode"].values, slots)
    above = Paths(y, [track.x for track in x], identity, true[..., 1], true[..., 0])
    panels = [_map(above, one["uav_position"].values[:, :2])]
    panels += [
        Panel(
            source.slot_axis(), Axis(name, "m"),
            Paths(own, [slots] * len(own), identity, true[..., axis], at).series(),
            guides=guides, empty="no object and no track",
        )
        for axis, (name, own) in enumerate(zip(_NAMES, (x, y), strict=True))
    ]  # fmt: skip
    return FigureData(
        "tracks", source.title, tuple(panels), source.setting(source.one_scheme(), one_trial=True),
        layout=((0, 1), (0, 2)), widths=(1.15, 1.0), size=(7.16, 3.8), key=track_key(y),
    )  # fmt: skip


def _map(paths: Paths, uav: Array) -> Panel:
    """Return tracks and objects seen from above, around the objects and the UAV."""
    flown = Series("UAV", uav[:, 0], uav[:, 1], look=Look("0.5"), kind="line", legend=False,
                   arrow=True)  # fmt: skip
    objects = np.stack([paths.at, paths.true], axis=-1).reshape(-1, 2)
    low, high = framed(np.concatenate([uav, objects]), _MARGIN, _LEAST)
    x, y = (
        Axis(name, "m", limits=(float(low[i]), float(high[i]))) for i, name in enumerate(_NAMES)
    )
    notes = (Note("UAV", float(uav[-1, 0]), float(uav[-1, 1]), "0.4", offset=(0.0, 9.0)),)
    return Panel(x, y, (flown, *paths.series()), notes=notes, equal=True)
