"""Statistics of unlabelled tracks: set distances, delays, identities, and the rate they cost."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from echobeam.estimation.continuity import (
    detection_delay,
    false_tracks,
    identity_switches,
    reacquisition,
    tracked_objects,
)
from echobeam.estimation.set_distance import gospa, ospa
from echobeam.scenario.model import Scenario
from echobeam.simulation.scoring import CUTOFF, axis_of, distances
from echobeam.values import NOBODY, Array, BoolArray, IntArray, Status, with_beams

ORDER = 2.0
"""Order p of GOSPA and OSPA, which is the usual one; their cutoff c is that of the scores."""

NEEDED_OF_TRACKS = ("identity", "track_id", "track_status", "track_object", "track_state", "shared")
"""Arrays of unlabelled runs that these statistics are made of, besides those of all runs."""

ROUNDING = 1e-9
"""Share of the power below which what objects do not have is rounding."""

Arrays = Mapping[str, npt.NDArray[np.generic]]


def track_statistics(arrays: Arrays, scenario: Scenario) -> dict[str, Array]:
    """Return the statistics of the confirmed tracks of some trials.

    Parameters
    ----------
    arrays
        Named and laid out as in the result file of an unlabelled run.
    scenario
        The scenario that was run.

    Returns
    -------
    dict
        Sums over trials, (scheme, slot): ``gospa``, m, with its parts ``gospa_localisation``,
        ``gospa_missed``, ``gospa_false``, m^2, and ``ospa``, m. Of each trial, (scheme, trial):
        ``trial_gospa``, over slots; ``trial_delay`` and ``trial_detected``: sum of the delays and
        number of the objects detected; ``trial_switches``, ``trial_false``: identity switches
        and false tracks; ``trial_gap`` and ``trial_with_gaps``: mean gap in slots, and whether
        there is one; object-slots ``trial_present``, ``trial_tracked``, ``trial_before`` (without
        a rate, of an object not yet detected), ``trial_lost`` (of one detected before) and
        ``trial_shared``;
        ``trial_rate_tracked``: rate of the tracked ones; ``trial_rate_false``: see `_wasted`.
    """
    parts = [_of_scheme(arrays, index, scenario) for index in range(len(arrays["track_id"]))]
    return {name: np.stack([part[name] for part in parts]) for name in parts[0]}


def _of_scheme(arrays: Arrays, index: int, scenario: Scenario) -> dict[str, Array]:
    status = np.asarray(arrays["track_status"][index])
    confirmed: BoolArray = status >= Status.CONFIRMED
    state = np.asarray(arrays["track_state"][index], dtype=np.float64)
    truth = np.asarray(arrays["truth"], dtype=np.float64)
    present: BoolArray = np.asarray(arrays["present"], dtype=bool)
    figures = _set_distances(confirmed, state, truth, present, scenario)
    id = np.asarray(arrays["track_id"][index], dtype=np.int64)
    about = np.asarray(arrays["track_object"][index], dtype=np.int64)
    identity = np.asarray(arrays["identity"], dtype=np.int64)
    there = _by_identity(identity)
    about = np.where(confirmed, about, NOBODY)
    delay = detection_delay(confirmed, about, there)
    gap = reacquisition(confirmed, about, there)
    found = tracked_objects(confirmed, about, there)
    before = there & ~np.logical_or.accumulate(found, axis=-2)
    rate = np.nan_to_num(np.asarray(arrays["rate"][index], dtype=np.float64))
    tracked = (identity[..., None] == about[..., None, :]).any(axis=-1) & present
    early = np.take_along_axis(before, np.maximum(identity, 0), axis=-1)
    unserved = present & ~tracked & ~(rate > 0.0)  # a tentative track may have a beam
    shared = np.asarray(arrays["shared"][index], dtype=bool)
    return figures | {
        "trial_delay": np.nansum(delay, axis=-1),
        "trial_detected": np.isfinite(delay).sum(axis=-1).astype(float),
        "trial_switches": identity_switches(id, confirmed, about, there).astype(float),
        "trial_false": false_tracks(id, confirmed, about).astype(float),
        "trial_gap": np.nan_to_num(gap),
        "trial_with_gaps": np.isfinite(gap).astype(float),
        "trial_present": there.sum(axis=(-2, -1)).astype(float),
        "trial_tracked": found.sum(axis=(-2, -1)).astype(float),
        "trial_before": (unserved & early).sum(axis=(-2, -1)).astype(float),
        "trial_lost": (unserved & ~early).sum(axis=(-2, -1)).astype(float),
        "trial_shared": (shared & present).sum(axis=(-2, -1)).astype(float),
        "trial_rate_tracked": np.where(tracked, rate, 0.0).sum(axis=(-2, -1)),
        "trial_rate_false": _wasted(arrays, index, scenario.radio.power),
    }


def _set_distances(
    confirmed: BoolArray, state: Array, truth: Array, present: BoolArray, scenario: Scenario
) -> dict[str, Array]:
    apart = distances(state, truth, axis_of(scenario))
    apart = np.where(np.isfinite(apart), apart, CUTOFF)
    found = gospa(apart, confirmed, present, CUTOFF, ORDER)
    return {
        "gospa": found.total.sum(axis=0),
        "gospa_localisation": found.localisation.sum(axis=0),
        "gospa_missed": found.missed.sum(axis=0),
        "gospa_false": found.false.sum(axis=0),
        "ospa": ospa(apart, confirmed, present, CUTOFF, ORDER).sum(axis=0),
        "trial_gospa": found.total.sum(axis=-1),
    }


def _by_identity(identity: IntArray) -> BoolArray:
    """Return which objects are there, ``(trial, slot, identity)``, whatever their columns."""
    count = max(int(identity.max(initial=NOBODY)) + 1, 1)  # one that never comes, if nobody does
    there: BoolArray = (identity[..., None] == np.arange(count)).any(axis=-2)
    return there


def _wasted(arrays: Arrays, index: int, power: float) -> Array:
    """Return the rate of each trial that beams for nobody take, as far as noise limits it.

    It is what the objects' beams would carry more with the power of the others: with the share q
    of the others log2(1 + SINR / (1 - q)) - log2(1 + SINR), divided by the objects of a beam.
    Slots with all power on nobody are left out: their objects wait or are lost.
    """
    sinr = np.nan_to_num(np.asarray(arrays["sinr"][index], dtype=np.float64))
    beam = np.nan_to_num(np.asarray(arrays["beam"][index], dtype=np.float64))
    own = np.sum(beam**2, axis=(-2, -1))
    alike = (beam[..., :, None, :, :] == beam[..., None, :, :, :]).all(axis=(-2, -1))
    sharers = np.maximum(alike.sum(axis=-1), 1)  # a shared beam is sent once
    useful = np.minimum((own / sharers).sum(axis=-1, keepdims=True) / power, 1.0)
    useful = np.where(useful > 1.0 - ROUNDING, 1.0, useful)
    directional = with_beams(np.asarray(arrays["mode"][index]))[..., None]
    with np.errstate(divide="ignore", invalid="ignore"):
        more = np.log1p(sinr / useful) - np.log1p(sinr)
    lost = np.where(directional & (useful > 0.0), more / sharers, 0.0) / np.log(2.0)
    total: Array = lost.sum(axis=(-2, -1))
    return total
