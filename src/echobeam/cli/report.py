"""Summary of a run, as a table and as JSON."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from echobeam.cli.columns import aligned
from echobeam.numerals import as_json
from echobeam.scenario.model import Scenario
from echobeam.simulation.decisions import Decisions
from echobeam.simulation.link_budget import far_field
from echobeam.simulation.quantities import errors_of
from echobeam.simulation.summary import GENIE, SchemeSummary, improvement, summarise

if TYPE_CHECKING:
    import xarray as xr

MOST_ROWS = 60
MOST_DIGITS = 4
"""Largest number of decimals of a mean that is printed without a power of ten."""

DECISION_WORDS = "decision per trial and slot on this machine, ms, mean (99th percentile)"


def json_report(
    result: xr.Dataset, scenario: Scenario, path: Path, decisions: Decisions | None = None
) -> str:
    """Return the summary as strict JSON; NaN and infinity become null.

    Parameters
    ----------
    result, scenario, path
        Result, its scenario, and the path of its file.
    decisions
        Decision times of the schemes; None if the result existed already.
    """
    figures = summarise(result, scenario)
    headline = improvement(result)
    document = {
        "scenario": scenario.name,
        "seed": int(result.attrs["seed"]),
        "trials": result.sizes["trial"],
        "result": str(path),
        "schemes": {
            name: {
                key: value
                for key in SchemeSummary.__slots__
                if (value := getattr(figure, key)) is not None
            }
            for name, figure in figures.items()
        },
        "improvement": None
        if headline is None
        else {key: getattr(headline, key) for key in type(headline).__slots__},
        "decision_seconds": None if decisions is None else seconds(decisions),
    }
    return json.dumps(as_json(document), indent=1, allow_nan=False)


def seconds(decisions: Decisions) -> dict[str, dict[str, float]]:
    """Return the decision times of each scheme as in the JSON output."""
    return {name: {"mean": one.mean, "p99": one.p99} for name, one in decisions.items()}


def milliseconds(decisions: Decisions) -> dict[str, str]:
    """Return mean and 99th percentile of the decision time as text, for the schemes that decide."""
    return {
        name: f"{1e3 * one.mean:.3g} ({1e3 * one.p99:.3g})"
        for name, one in decisions.items()
        if math.isfinite(one.mean)
    }


def measured(mean: float, interval: tuple[float, float]) -> str:
    """Return a mean with the half-width of its interval to two digits.

    Small means are printed with a power of ten, ``(2.83 ± 0.12)e-05``.
    """
    half = (interval[1] - interval[0]) / 2
    if not math.isfinite(mean) or not half > 1e-9 * abs(mean):  # one trial, or equal trials
        return f"{mean:.4g}"
    digits = 1 - math.floor(math.log10(float(f"{half:.1e}")))  # 0.00999 is printed as 0.010
    power = min(0, math.floor(math.log10(abs(mean)))) if mean and digits > MOST_DIGITS else 0
    digits = max(0, digits + power)
    scaled = f"{mean * 10.0**-power:.{digits}f} ± {half * 10.0**-power:.{digits}f}"
    return scaled if power == 0 else f"({scaled})e{power:+03d}"


def text_report(
    result: xr.Dataset, scenario: Scenario, path: Path, decisions: Decisions | None = None
) -> str:
    """Return the table of mean sum rates with 95 % intervals, and the notes below it."""
    figures = summarise(result, scenario)
    exponent = _exponent(scenario)
    unit = "bit/s/Hz" if exponent == 0 else f"10^{exponent} bit/s/Hz"
    trials = result.sizes["trial"]
    interval = ", with 95 % interval" if trials > 1 else ""
    lines = [
        f"{scenario.name}: mean sum rate over {trials} trial{'s' * (trials > 1)}, {unit}{interval}",
        "",
        *_ruled([["slot", *figures], *_rows(result, figures, scenario, 10.0**-exponent)]),
        "",
    ]
    if scenario.unlabelled:
        lines += _track_notes(figures)
    headline = improvement(result)
    if headline is not None:
        lines.append(str(headline))
    fallbacks = {name: figure.fallbacks for name, figure in figures.items() if figure.fallbacks}
    if fallbacks:
        slots = result.sizes["trial"] * result.sizes["slot"]
        said = ", ".join(f"{name} {count}" for name, count in fallbacks.items())
        said += f" of {slots} slots in all trials"
        lines.append(f"slots with fallback beams (rate floors out of reach, or flat beams): {said}")
    lost = {name: figure.lost for name, figure in figures.items() if figure.lost > 0}
    if lost:
        said = ", ".join(f"{name} {100 * share:.3g} %" for name, share in lost.items())
        lines.append(f"objects without a track in the last slot: {said}")
    lines += _notes(figures, scenario)
    taken = milliseconds(decisions or {})
    if taken:
        said = ", ".join(f"{name} {one}" for name, one in taken.items())
        lines.append(f"{DECISION_WORDS}: {said}")
    lines.append(f"result: {path}")
    return "\n".join(lines)


def far_field_warning(result: xr.Dataset, scenario: Scenario) -> str | None:
    """Return a warning if an object of a result is nearer than the far-field distance."""
    start = far_field(scenario)
    offset = (result["position"] - result["uav_position"]).transpose(..., "axis").to_numpy()
    distance = np.sqrt(np.sum(offset**2, axis=-1))
    nearest = distance[np.isfinite(distance)].min(initial=np.inf)
    if nearest >= start:
        return None
    return (
        f"warning: the far field of the array begins at {start:.0f} m (2 D^2 / lambda): objects as"
        f" near as {nearest:.0f} m are simulated with plane waves nevertheless"
    )


def _notes(figures: Mapping[str, SchemeSummary], scenario: Scenario) -> list[str]:
    """Return lines on the genie, the bound and the coverage probability, where known."""
    width = scenario.coverage.width
    error, *_ = errors_of(scenario)
    if scenario.geometry == "road":
        nominal, covered = math.erf(width / math.sqrt(2)), "true angles in the covered interval"
    else:
        nominal, covered = 1.0 - math.exp(-0.5 * width**2), "true directions in the covered ellipse"
    listed = {
        "mean sum rate over the genie's": {
            name: f"{100 * figure.frame_rate_over_genie:.3g} %"
            for name, figure in figures.items()
            if name != GENIE and math.isfinite(figure.frame_rate_over_genie)
        },
        f"{error} RMSE over the posterior Cramer-Rao bound, mean over slots": {
            name: f"{np.nanmean(getattr(figure, f'{error}_over_bound')):.2f}"
            for name, figure in figures.items()
            if np.isfinite(getattr(figure, f"{error}_over_bound")).any()
        },
        f"{covered} (nominal {100 * nominal:.4g} %)": {
            name: f"{100 * figure.coverage:.4g} %"
            for name, figure in figures.items()
            if math.isfinite(figure.coverage)
        },
    }
    return [
        f"{what}: {', '.join(f'{name} {value}' for name, value in values.items())}"
        for what, values in listed.items()
        if values
    ]


def _track_notes(figures: Mapping[str, SchemeSummary]) -> list[str]:
    """Return a table of how the objects were found and tracked, for an unlabelled run."""
    rows = [["", *figures]]
    for label, name, scale in _TRACK_ROWS:
        values = [getattr(figure, name) for figure in figures.values()]
        rows.append([label, *(f"{scale * value:.3g}" for value in values)])
    return [*aligned(rows), ""]


_TRACK_ROWS = (
    ("GOSPA, m", "frame_gospa", 1.0),
    ("slots until an object is tracked", "detection_delay", 1.0),
    ("objects and slots with a track, %", "tracked", 100.0),
    ("false tracks per 100 slots", "false_tracks", 1.0),
    ("identity switches per trial", "identity_switches", 1.0),
    ("slots until a lost object is tracked again", "reacquisition", 1.0),
    ("objects and slots with a shared beam, %", "shared", 100.0),
    ("rate lost to delay, bit/s/Hz", "rate_lost_to_delay", 1.0),
    ("rate lost to gaps, bit/s/Hz", "rate_lost_to_gaps", 1.0),
    ("rate lost to beams for nobody, bit/s/Hz", "rate_lost_to_false", 1.0),
)
"""Rows of that table: label, figure and factor."""


def _exponent(scenario: Scenario) -> int:
    """Return the power of ten, a multiple of three, by which printed rates are scaled.

    It follows from the rate of a matched beam at the distance of the UAV's height, so that it is
    the same for all runs of a scenario, whatever their schemes and trials.
    """
    radio, height = scenario.radio, scenario.uav.start(scenario.geometry)[2]
    snr = scenario.array.n_tx * radio.power * radio.alpha0**2 / (radio.noise * height**2)
    best = math.log1p(snr) / math.log(2.0)
    return 0 if not 0.0 < best < math.inf else min(0, 3 * math.floor(math.log10(best) / 3))


def _rows(
    result: xr.Dataset, figures: Mapping[str, SchemeSummary], scenario: Scenario, scale: float
) -> list[list[str]]:
    """Return a row per slot, or per frame if there are many slots, and the row of the mean."""
    n_slots, per_frame = result.sizes["slot"], scenario.frame.slots_per_frame
    rows = []
    if n_slots <= MOST_ROWS:
        for slot in range(n_slots):
            cells = [
                _cell(scale * figure.rate_mean[slot], scale * figure.rate_interval[slot])
                for figure in figures.values()
            ]
            rows.append([str(slot + 1), *cells])
    else:
        frames = -(-n_slots // per_frame)
        per_row = per_frame * -(-frames // MOST_ROWS)
        for first in range(0, n_slots, per_row):
            cells = [
                f"{scale * figure.rate_mean[first : first + per_row].mean():.3f}"
                for figure in figures.values()
            ]
            rows.append([f"{first + 1}-{min(first + per_row, n_slots)}", *cells])
    means = [
        _cell(scale * figure.frame_rate_mean, scale * np.array(figure.frame_rate_interval))
        for figure in figures.values()
    ]
    return [*rows, ["mean", *means]]


def _cell(mean: float, interval: np.ndarray[tuple[int, ...], np.dtype[np.float64]]) -> str:
    half = (interval[1] - interval[0]) / 2
    return f"{mean:.3f}" if np.isnan(half) else f"{mean:.3f} ± {half:.3f}"


def _ruled(rows: list[list[str]]) -> list[str]:
    """Return a table with a rule below the headings and one above the last row."""
    lines = aligned(rows)
    rule = "-" * len(lines[0])
    return [lines[0], rule, *lines[1:-1], rule, lines[-1]]
