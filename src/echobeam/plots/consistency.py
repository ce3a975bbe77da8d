"""Consistency of the filters, slot by slot: their errors beside those that they promise."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from echobeam.estimation.consistency import chi_square_band, share_band
from echobeam.plots import style
from echobeam.plots.setting import check_variables, read_scenario, read_setting
from echobeam.plots.slot_axis import label_slots, limit_slots, shade_phases
from echobeam.schemes.configure import system_for
from echobeam.simulation.statistics import NEEDED, Statistics, of_scheme
from echobeam.simulation.summary import GENIE, over_bound, ratio_of_means, result_statistics

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from echobeam.scenario.model import Scenario
    from echobeam.values import Array

MOST_SLOTS = 60
"""Longer runs are shown frame by frame: a curve through hundreds of slots is but a smear."""

_BOUNDED = ("angle", "distance")
_BAND = "0.78"
_MOST_NAMED = 2
_TITLE = 40  # characters that a panel is wide
_OWN_PROMISE: dict[str, Any] = {"linewidth": 0.8, "linestyle": (0, (1.0, 1.0)), "zorder": 1.4}
_NARROW = 4.0
_LEAST_SHARE = 98.0


class Curves(NamedTuple):
    """Values of one panel for every scheme, at slots or frames.

    ``values`` is ``(scheme, n)``, NaN where there is none; ``expected`` is what an honest
    filter gives, one number or ``(scheme,)`` where schemes differ; ``band`` ``(n, 2)`` is where
    95 % of honest means lie, or None; ``intervals`` ``(scheme, n, 2)`` those of the values
    themselves, or None.
    """

    values: Array
    expected: float | Array
    band: Array | None = None
    intervals: Array | None = None


class Panel(NamedTuple):
    """A panel: its label, what it shows, and what it says if there is nothing."""

    label: str
    curves: Curves
    empty: str


@style.styled()
def draw(result: xr.Dataset) -> Figure:
    """Draw what the filters promise and keep, slot by slot, every scheme in its colour.

    - NEES and NIS (per measured component) with the 95 % band of a mean of independent chi-square
      variables, over trials and objects. Where schemes have different numbers of them the band
      is that of the fewest. Known objects are not measured in omnidirectional slots: NIS has a
      gap there, and NEES is that of the prediction.
    - The share of true angles inside the interval of (38f) that the beams were designed to
      cover, with the 95 % band of a binomial share, and what a Gaussian promises for its width.
      Where schemes have widths of their own the promise is in their colours, without a band.
    - RMSE of angle and distance over the posterior Cramer-Rao bound, see `over_bound`.
    - Mean sum rate over the genie's, with the 95 % interval over paired trials.

    A run of more than `MOST_SLOTS` slots is shown frame by frame. Estimates of one frame hang
    together, so the bands of NEES and of the share stay those of one slot; innovations do not.

    Parameters
    ----------
    result
        A result of a run; what it cannot show is said in the panel.

    Raises
    ------
    PlotError
        If the result lacks variables of a run.
    """
    check_variables(result, *NEEDED)
    setting, scenario = read_setting(result), read_scenario(result)
    figure = style.new_figure(style.PAGE, 4.8)
    figure.suptitle(setting.title())
    axes = list(figure.subplots(2, 3, sharex=True).flat)
    handles: list[Artist] = []
    long = result.sizes["slot"] > MOST_SLOTS
    if scenario is None or result.sizes["object"] == 0:
        why = "the result does not say its scenario" if scenario is None else "no objects to track"
        style.add_note(axes[1], why)
    else:
        handles = _draw_panels(axes, result, scenario, by_frame=long)
    if not long:
        shades = [shade_phases(one, result) for one in axes]
        handles += shades[0]
    for one in axes[-3:]:
        label_slots(one, setting.slot)
    limit_slots(axes[0], result, ticks=6 if long else 10)
    style.add_legend(figure, handles)
    return figure


def _draw_panels(
    axes: Sequence[Axes], result: xr.Dataset, scenario: Scenario, *, by_frame: bool
) -> list[Artist]:
    """Draw all panels and return the legend's entries."""
    names = [str(name) for name in result["scheme"].values]
    looks = style.scheme_looks(names)
    whole, slots = result_statistics(result, scenario), result["slot"].values.astype(float)
    pooled = scenario.frame.slots_per_frame if by_frame else 1
    parts = [_pooled(of_scheme(whole, index), pooled, scenario) for index in range(len(names))]
    centres = slots.reshape(-1, pooled).mean(axis=1)
    drawn: dict[str, Line2D] = {}
    for one, panel in zip(axes, panels(parts, names, scenario, pooled), strict=True):
        drawn |= _draw_panel(one, panel, centres, looks, names)
    return [*(drawn[name] for name in names if name in drawn), *_legend(parts, pooled)]


def _pooled(part: Statistics, pooled: int, scenario: Scenario) -> Statistics:
    """Return sums over each frame instead of each slot, and the errors over their bound."""

    def over_frames(values: Array) -> Array:
        return values.reshape(*values.shape[:-1], -1, pooled)

    sums = ("nees", "nees_count", "nis", "nis_degrees", "inside", "covered", "sum_rate")
    found = {name: over_frames(part[name]).sum(axis=-1) for name in sums}
    for component in _BOUNDED:
        squares = over_frames(over_bound(part, component, scenario) ** 2)
        there = np.isfinite(squares)
        mean = _ratio(np.where(there, squares, 0.0).sum(axis=-1), there.sum(axis=-1))
        found[component] = np.sqrt(mean)
    return found


def panels(
    parts: Sequence[Statistics], names: Sequence[str], scenario: Scenario, pooled: int = 1
) -> list[Panel]:
    """Return what is drawn, from every scheme's sums over ``pooled`` slots each."""
    widths = np.array([system_for(scenario, name).coverage.width for name in names])
    trace = scenario.trace is not None
    unbound = "the objects of\na trace come and go" if trace else "\nnothing is predicted"
    bounds = [np.stack([part[component] for part in parts]) for component in _BOUNDED]
    return [
        Panel("NEES", nees_curves(parts, pooled), "no estimate in doubt"),
        Panel("NIS per component", nis_curves(parts), "no prediction was measured"),
        Panel(*cover_curves(parts, widths, pooled), "nothing covered"),
        Panel("Angle RMSE / bound", Curves(bounds[0], 1.0), f"no bound: {unbound}"),
        Panel("Distance RMSE / bound", Curves(bounds[1], 1.0), f"no bound: {unbound}"),
        Panel("Sum rate / genie's", genie_curves(parts, names), "no genie among\nthe schemes"),
    ]


def nees_curves(parts: Sequence[Statistics], pooled: int = 1) -> Curves:
    """Return the normalised estimation errors squared; 3 state components."""
    count = np.stack([part["nees_count"] for part in parts])
    values = _ratio(np.stack([part["nees"] for part in parts]), count)
    return Curves(values, 3.0, _band(count / pooled, lambda n: chi_square_band(3, n)))


def nis_curves(parts: Sequence[Statistics]) -> Curves:
    """Return the normalised innovations squared per measured component."""
    degrees = np.stack([part["nis_degrees"] for part in parts])
    values = _ratio(np.stack([part["nis"] for part in parts]), degrees)
    return Curves(values, 1.0, _band(degrees, lambda n: chi_square_band(1, n)))


def cover_curves(parts: Sequence[Statistics], widths: Array, pooled: int = 1) -> tuple[str, Curves]:
    """Return the panel's label and the shares of true angles inside the covered interval, per cent.

    Parameters
    ----------
    parts
        Every scheme's sums.
    widths
        ``(scheme,)``: half-widths of their covers in standard deviations.
    pooled
        Slots behind each sum.
    """
    from scipy.special import erf

    covered = np.stack([part["covered"] for part in parts])
    values = 100.0 * _ratio(np.stack([part["inside"] for part in parts]), covered)
    promised = erf(widths / np.sqrt(2.0))
    differ = np.unique(widths[(covered > 0).any(axis=-1)])
    if differ.size > 1:
        return "Inside the cover (%)", Curves(values, 100.0 * promised)
    width = differ[0] if differ.size else widths[0]
    share = float(erf(width / np.sqrt(2.0)))
    band = _band(covered / pooled, lambda n: share_band(share, max(1, round(n))))
    return f"Inside ±{width:g}σ (%)", Curves(values, 100.0 * share, 100.0 * band)


def genie_curves(parts: Sequence[Statistics], names: Sequence[str]) -> Curves:
    """Return the other schemes' mean sum rates over the genie's, over paired trials."""
    shape = (len(names), parts[0]["sum_rate"].shape[1])
    values, intervals = np.full(shape, np.nan), np.full((*shape, 2), np.nan)
    if GENIE in names:
        best = parts[names.index(GENIE)]["sum_rate"]
        others = [i for i, name in enumerate(names) if name != GENIE]
        for slot in np.flatnonzero(best.mean(axis=0) > 0):
            for i in others:
                found = ratio_of_means(parts[i]["sum_rate"][:, slot], best[:, slot])
                values[i, slot], intervals[i, slot] = found
    return Curves(values, 1.0, intervals=intervals)


def _ratio(total: Array, count: Array) -> Array:
    """Return total over count, NaN where there is nothing to count."""
    return np.where(count > 0, total, np.nan) / np.where(count > 0, count, 1.0)


def _band(count: Array, band: Callable[[float], tuple[float, float]]) -> Array:
    """Return the band ``(slot, 2)`` for the fewest samples that a scheme has in the slot."""
    fewest = np.min(np.where(count > 0, count, np.inf), axis=0)
    known = {samples: band(samples) for samples in np.unique(fewest[np.isfinite(fewest)])}
    return np.array([known.get(samples, (np.nan, np.nan)) for samples in fewest])


def _draw_panel(
    axes: Axes, panel: Panel, slots: Array, looks: dict[str, style.Look], names: Sequence[str]
) -> dict[str, Line2D]:
    """Draw one panel and return its lines by scheme."""
    curves = panel.curves
    axes.set_title(panel.label)
    seen = [i for i in range(len(names)) if np.isfinite(curves.values[i]).any()]
    if not seen:
        style.add_note(axes, panel.empty)
        return {}
    if curves.band is not None:
        _draw_band(axes, slots, curves.band)
    if isinstance(curves.expected, float):
        axes.axhline(curves.expected, color="0.25", linewidth=0.8, zorder=1.4)
    else:
        for i in seen:
            axes.axhline(curves.expected[i], color=looks[names[i]].colour, **_OWN_PROMISE)
    lines = {}
    for i in seen:
        look = looks[names[i]]
        if curves.intervals is not None:
            low, high = curves.intervals[i].T
            axes.fill_between(
                slots, low, high, color=look.colour, alpha=0.22, linewidth=0, zorder=1.5
            )
        lines[names[i]] = style.draw_line(axes, slots, curves.values[i], look, names[i])
    _scale(axes, panel)
    _name_absent(axes, panel, [name for i, name in enumerate(names) if i not in seen])
    return lines


def _scale(axes: Axes, panel: Panel) -> None:
    """Let small and large ratios be seen, and shares beside what was promised."""
    values = panel.curves.values[np.isfinite(panel.curves.values)]
    if panel.label.startswith("Inside"):
        seen = np.isfinite(panel.curves.values).any(axis=-1)
        promised = np.broadcast_to(panel.curves.expected, seen.shape)[seen]
        low = min(float(values.min()), float(promised.min()), _LEAST_SHARE)
        axes.set_ylim(low - 0.06 * (100.0 - low), 100.0 + 0.06 * (100.0 - low))
    elif panel.label.startswith("Sum"):
        axes.set_ylim(-0.04, max(1.06, 1.06 * float(values.max())))
    elif values.min() > 0.0 and values.max() > _NARROW * values.min():
        style.scale_log(axes)


def _name_absent(axes: Axes, panel: Panel, absent: list[str]) -> None:
    """Say in the title for which schemes there is no such thing."""
    others = [name for name in absent if (name, panel.label[:3]) != (GENIE, "Sum")]
    if others:
        said = ", ".join(others) if len(others) <= _MOST_NAMED else f"{len(others)} schemes"
        axes.set_title(f"{panel.label}\n{style.wrap_name(f'(none for {said})', _TITLE)}")


def _draw_band(axes: Axes, slots: Array, band: Array) -> None:
    """Fill the band slot by slot: it changes with the number of samples."""
    step = float(slots[1] - slots[0]) if len(slots) > 1 else 1.0
    edges = np.repeat(slots, 2) + np.tile([-0.5 * step, 0.5 * step], len(slots))
    low, high = np.repeat(band, 2, axis=0).T
    axes.fill_between(edges, low, high, color=_BAND, linewidth=0, zorder=1.2)


def _legend(parts: Sequence[Statistics], pooled: int) -> list[Artist]:
    """Return what the band and the line mean, with the degrees of freedom."""
    nees = 3 * np.concatenate([part["nees_count"] for part in parts]) / pooled
    nis = np.concatenate([part["nis_degrees"] for part in parts])
    degrees = f"NEES {_range(nees)}, NIS {_range(nis)} degrees of freedom"
    return [
        Patch(facecolor=_BAND, label=f"95 % band (χ²: {degrees})"),
        Line2D([], [], color="0.25", linewidth=0.8, label="honest filter, bound, genie"),
    ]


def _range(counts: Array) -> str:
    some = counts[counts > 0]
    if not some.size:
        return "no"
    low, high = round(some.min()), round(some.max())
    return f"{low}" if low == high else f"{low} to {high}"
