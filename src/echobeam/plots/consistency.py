"""Consistency of the filters per slot: their errors against the errors stated by covariances."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from echobeam.estimation.consistency import chi_square_band, share_band
from echobeam.estimation.intervals import quotient, ratio_of_means
from echobeam.plots.looks import AREA, BAND, DOTTED, Look
from echobeam.plots.record import Axis, FigureData, Guide, Panel, Series, grid, interval_series
from echobeam.plots.source import Source, empty_figure
from echobeam.schemes.configure import geometry_of, system_for
from echobeam.simulation.quantities import errors_of
from echobeam.simulation.statistics import needed, squares_of
from echobeam.simulation.summary import GENIE, pooled_bound
from echobeam.values import Array

_EXPECTED = Look("0.25", "", "-")
_EXPECTED_NAME = "consistent filter, bound, genie"
_NARROW = 4.0
_LEAST_SHARE = 98.0


def consistency(source: Source) -> FigureData:
    """Return the errors of the filters against their stated errors, one colour per scheme.

    - NEES and NIS (per measured component) with the 95 % band of a mean of independent chi-square
    variables; if the schemes' sample sizes differ, the band of the smallest.
    - The share of true directions inside the cover of (38f), beside that of a Gaussian.
    - RMSE of angle and distance, on the ground of position and velocity, over the posterior
    Cramer-Rao bound, see `bound_of`.
    - Mean sum rate over the genie's, with the 95 % interval over paired trials.

    A quantity that the result lacks is named below the title. Estimates within a frame are
    correlated, so in long runs the bands of NEES and of the share remain those of one slot.
    """
    source.check(*needed(source.scenario))
    if not source.result.sizes["object"]:
        return empty_figure(source, "consistency", "no objects to track")
    panels = [_nees(source), _nis(source), _cover(source)]
    panels += [_over_bound(source, error) for error in errors_of(source.scenario)]
    panels.append(_over_genie(source))
    shown = tuple(panel for panel in panels if not all(one.empty for one in panel.series))
    without = [
        f"{panel.y.name}: {panel.empty}" for panel in panels if panel.y.name not in
        {one.y.name for one in shown}
    ]  # fmt: skip
    columns = 3 if len(shown) > 4 or len(shown) == 3 else 2
    layout = grid(max(len(shown), 1), min(columns, max(len(shown), 1)))
    return FigureData(
        "consistency", source.title, shown or (panels[0],), source.setting(),
        caption=("not shown: " + "; ".join(without)) if without else "",
        layout=layout, size=(7.16, 0.7 + 1.9 * len(layout)), share="x",
        key=(("95 % band of a consistent filter", Look(BAND, AREA)),),
    )  # fmt: skip


def _panel(
    source: Source,
    name: str,
    values: dict[str, Array],
    expected: float,
    band: Array | None = None,
    unit: str = "",
    empty: str = "",
) -> Panel:
    """Return a panel with a curve per scheme, the expected value and its band."""
    curves = [
        Series(scheme, source.x, value, look=source.looks[scheme])
        for scheme, value in values.items()
        if np.isfinite(value).any()
    ]
    found = [one for one in curves if not one.empty]
    log = False
    if found and not unit:
        low = min(float(np.nanmin(one.y)) for one in found)
        high = max(float(np.nanmax(one.y)) for one in found)
        log = low > 0.0 and high > _NARROW * low
    bands = [] if band is None or not found else [_band_series(source, band)]
    guide = Guide("y", expected, look=_EXPECTED, name=_EXPECTED_NAME)
    return Panel(
        source.slot_axis(), Axis(name, unit, log=log), (*bands, *curves),
        guides=(*source.omni_guides(), guide), empty=empty,
    )  # fmt: skip


def _band_series(source: Source, band: Array) -> Series:
    """Return the band per slot: its width depends on the number of samples."""
    step = float(source.pooled)
    edges = np.repeat(source.x, 2) + np.tile([-0.5 * step, 0.5 * step], source.x.size)
    ends = np.repeat(band, 2, axis=0)
    look = Look(BAND)
    return Series("95 % band", edges, ends.mean(axis=1), ends, look, kind="band", legend=False)


def _sums(source: Source, name: str) -> dict[str, Array]:
    return {scheme: source.pool(source.parts[scheme][name]) for scheme in source.names}


def _ratios(source: Source, total: str, count: str) -> tuple[dict[str, Array], Array]:
    """Return each scheme's quotient of two sums, and the smallest sample size."""
    totals, counts = _sums(source, total), _sums(source, count)
    values = {name: quotient(totals[name], counts[name]) for name in source.names}
    stacked = np.stack(list(counts.values()))
    return values, np.min(np.where(stacked > 0, stacked, np.inf), axis=0)


def _band(fewest: Array, band: Callable[[float], tuple[float, float]]) -> Array:
    """Return the band ``(n, 2)`` for the number of samples at each place."""
    known = {samples: band(samples) for samples in np.unique(fewest[np.isfinite(fewest)])}
    return np.array([known.get(samples, (np.nan, np.nan)) for samples in fewest])


def _nees(source: Source) -> Panel:
    """Return the normalised estimation errors squared, of as many as the state has components."""
    size = geometry_of(source.scenario).space.size
    values, fewest = _ratios(source, "nees", "nees_count")
    band = _band(fewest / source.pooled, lambda n: chi_square_band(size, n))
    return _panel(source, "NEES", values, float(size), band, empty="no estimate has a covariance")


def _nis(source: Source) -> Panel:
    """Return the normalised innovations squared per measured component."""
    values, fewest = _ratios(source, "nis", "nis_degrees")
    band = _band(fewest, lambda n: chi_square_band(1, n))
    return _panel(
        source, "NIS per component", values, 1.0, band, empty="no prediction was measured"
    )


def _cover(source: Source) -> Panel:
    """Return the shares of true directions inside the cover, %."""
    from scipy.special import erf

    values, fewest = _ratios(source, "inside", "covered")
    widths = {name: system_for(source.scenario, name).coverage.width for name in source.names}
    shown = {name: width for name, width in widths.items() if np.isfinite(values[name]).any()}
    differ = sorted(set(shown.values()) or {source.scenario.coverage.width})
    ground = source.scenario.geometry == "ground"
    shares = {
        width: float(1.0 - np.exp(-0.5 * width**2) if ground else erf(width / np.sqrt(2.0)))
        for width in differ
    }
    first = shares[differ[0]]
    band = _band(fewest / source.pooled, lambda n: share_band(first, max(1, round(n))))
    name = f"Inside ±{differ[0]:g}σ" if len(differ) == 1 else "Inside the cover"
    panel = _panel(
        source, name, {one: 100.0 * value for one, value in values.items()}, 100.0 * first,
        100.0 * band if len(differ) == 1 else None, "%", "no beam has a cover",
    )  # fmt: skip
    lowest = [100.0 * min(shares.values()), _LEAST_SHARE]
    lowest += [float(np.nanmin(one.y)) for one in panel.series if not one.empty]
    room = 0.06 * (100.0 - min(lowest))
    own = tuple(
        Guide("y", 100.0 * shares[width], look=source.looks[one].plain(DOTTED))
        for one, width in shown.items()
        if len(differ) > 1
    )
    guides = panel.guides if len(differ) == 1 else (*panel.guides[:-1], *own)
    axis = Axis(name, "%", limits=(min(lowest) - room, 100.0 + room))
    return Panel(panel.x, axis, panel.series, guides=guides, empty=panel.empty)


def _over_bound(source: Source, error: str) -> Panel:
    """Return RMSE over the posterior Cramer-Rao bound, for objects with a bound."""
    values, components = {}, geometry_of(source.scenario).errors[error]
    for name in source.names:
        part = source.parts[name]
        least, _ = pooled_bound(part, error, source.scenario)
        found = squares_of(part, components).sum(axis=-1)
        squares = np.where(least > 0, found, 0.0)
        values[name] = np.sqrt(quotient(source.pool(squares), source.pool(least)))
    why = "the objects of a trace come and go" if source.scenario.trace else "nothing is predicted"
    return _panel(source, f"{error.capitalize()} RMSE / bound", values, 1.0, empty=why)


def _over_genie(source: Source) -> Panel:
    """Return the other schemes' mean sum rates over the genie's, over paired trials."""
    others = [name for name in source.names if name != GENIE]
    guides = (*source.omni_guides(), Guide("y", 1.0, look=_EXPECTED, name=_EXPECTED_NAME))
    series = []
    if source.genie_rates is not None:
        best = source.pool(source.genie_rates)
        for name in others:
            rates = source.pool(source.parts[name]["sum_rate"])
            found = [
                ratio_of_means(rates[:, i], best[:, i])
                if best[:, i].mean() > 0
                else (np.nan, (np.nan, np.nan))
                for i in range(best.shape[1])
            ]
            value, ends = (np.array(one) for one in zip(*found, strict=True))
            series.append(interval_series(name, source.x, (value, ends), source.looks[name]))
    high = max((float(np.nanmax(one.y)) for one in series if not one.empty), default=1.0)
    axis = Axis("Sum rate / genie's", limits=(-0.04, max(1.06, 1.06 * high)))
    return Panel(
        source.slot_axis(), axis, tuple(series), guides=guides, empty="no genie among the schemes"
    )
