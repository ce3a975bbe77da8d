"""Figures that summaries state, by their name: unit and meaning."""

from __future__ import annotations

from collections.abc import Container, Sequence

from echobeam.physics.road import ROAD_GEOMETRY
from echobeam.scenario.model import Scenario
from echobeam.schemes.configure import geometry_of

UNITS = {"angle": "rad", "distance": "m", "position": "m", "velocity": "m/s"}
"""Units of the errors that a geometry states, by their name."""

RATES = {
    "frame_rate_mean": ("bit/s/Hz", "mean sum rate over slots"),
    "frame_rate_q05": ("bit/s/Hz", "5 % quantile of a frame's mean sum rate"),
}
SCALARS = {
    "frame_nees": ("1", "normalised squared error of the posterior over all slots"),
    "frame_nis": ("1", "normalised squared innovation per component over all slots"),
    "coverage": ("1", "share of true directions inside the cover"),
    "outage": ("1", "share of objects and directional slots below min_rate"),
    "lost": ("1", "share of objects without a track in the last slot"),
    "fallbacks": ("1", "trial-slots with fallback beams"),
    "frame_rate_over_genie": ("1", "mean sum rate over slots, over the genie's"),
}
PER_SLOT = {
    "nees": ("1", "normalised squared error of the posterior; its components if honest"),
    "nis": ("1", "normalised squared innovation per component; 1 if honest"),
    "rate_over_genie": ("1", "mean sum rate over the genie's"),
}
"""Figures of a scheme by their name, of a run and of each slot: unit and meaning. Those of the
errors, which depend on the geometry, stand between the rates and these."""

TRACK_SCALARS = {
    "frame_gospa": ("m", "GOSPA of the confirmed tracks over all slots"),
    "detection_delay": ("1", "slots from an object's appearance to its confirmed track"),
    "false_tracks": ("1", "confirmed tracks of nobody, per 100 slots"),
    "identity_switches": ("1", "identity switches per trial"),
    "reacquisition": ("1", "mean length of the gaps in an object's tracks, slots"),
    "tracked": ("1", "share of objects and slots with a confirmed track"),
    "shared": ("1", "share of objects and slots with a beam shared in turns"),
    "rate_lost_to_delay": ("bit/s/Hz", "mean sum rate lost before objects are tracked"),
    "rate_lost_to_gaps": ("bit/s/Hz", "mean sum rate lost while objects are lost"),
    "rate_lost_to_false": ("bit/s/Hz", "mean sum rate lost to beams for nobody"),
}
TRACK_PER_SLOT = {
    "gospa": ("m", "GOSPA of the confirmed tracks"),
    "ospa": ("m", "OSPA of the confirmed tracks"),
    "gospa_localisation": ("m^2", "part of the squared GOSPA of tracks off their objects"),
    "gospa_missed": ("m^2", "part of the squared GOSPA of objects without a track"),
    "gospa_false": ("m^2", "part of the squared GOSPA of tracks without an object"),
}
"""The same of unlabelled runs, besides the others."""


Figures = dict[str, tuple[str, str]]
"""Figures by name: unit and meaning."""


def errors_of(*scenarios: Scenario) -> tuple[str, ...]:
    """Return the names of the errors that summaries of some scenarios state."""
    return tuple(dict.fromkeys(name for one in scenarios for name in geometry_of(one).errors))


def errors_in(names: Container[object]) -> tuple[str, ...]:
    """Return the names of the errors among the figures of a table."""
    return tuple(name for name in UNITS if f"{name}_rmse" in names)


def scalars(*, unlabelled: bool, errors: Sequence[str] = tuple(ROAD_GEOMETRY.errors)) -> Figures:
    """Return the figures of a run, by name: unit and meaning; ``errors`` as of `errors_of`."""
    stated = {
        f"frame_{name}_rmse": (UNITS[name], f"RMSE of the posterior {name} over all slots")
        for name in errors
    }
    figures = RATES | stated | SCALARS
    return figures | TRACK_SCALARS if unlabelled else figures


def per_slot(*, unlabelled: bool, errors: Sequence[str] = tuple(ROAD_GEOMETRY.errors)) -> Figures:
    """Return the figures of each slot, by name: unit and meaning."""
    figures = {"rate_mean": ("bit/s/Hz", "mean sum rate")}
    figures |= {f"{name}_rmse": (UNITS[name], f"RMSE of the posterior {name}") for name in errors}
    figures |= {
        f"{name}_over_bound": ("1", f"{name} RMSE over the posterior Cramer-Rao bound")
        for name in errors
    }
    figures |= PER_SLOT
    return figures | TRACK_PER_SLOT if unlabelled else figures


def interval_name(quantity: str) -> str:
    """Return the name of the variable that holds the interval of a figure of the whole run."""
    return "frame_rate_interval" if quantity == "frame_rate_mean" else f"{quantity}_interval"


def slot_means(errors: Sequence[str]) -> tuple[str, ...]:
    """Return the per-slot figures of which tables have the mean over the slots that have one."""
    return (*(f"{name}_over_bound" for name in errors), "nees", "nis")
