"""Errors of the posterior per slot, against the posterior Cramer-Rao bound."""

from __future__ import annotations

import numpy as np

from echobeam.estimation.intervals import quotient
from echobeam.plots.looks import DOTTED, FAINT, Look
from echobeam.plots.record import Axis, FigureData, Panel, Series
from echobeam.plots.source import Source, empty_figure
from echobeam.schemes.configure import geometry_of
from echobeam.simulation.quantities import errors_of
from echobeam.simulation.statistics import squares_of
from echobeam.simulation.summary import pooled_bound
from echobeam.values import Array

_UNITS = {
    "angle": ("deg", 180.0 / np.pi),
    "distance": ("m", 1.0),
    "position": ("m", 1.0),
    "velocity": ("m/s", 1.0),
}
"""Units of the errors that a geometry states, and their factors."""

_ZERO = 1e-9  # deg, m: smaller errors are rounding errors of the genie, which knows the truth
BOUND = "posterior Cramér–Rao bound"


def tracking(source: Source) -> FigureData:
    """Return the errors that the geometry states of every scheme, slot by slot.

    They are those of angle and distance, on the ground those of position and velocity.

    The root mean square is over trials and the objects in the scene. The bound has the colour of
    its scheme, see `bound_of`; it applies to filters, not to a scheme that repeats an old
    estimate.
    """
    source.check("truth", "estimated")
    if not source.result.sizes["object"]:
        return empty_figure(source, "tracking", "no objects: nothing to track")
    panels = tuple(_panel(source, error) for error in errors_of(source.scenario))
    bounded = any(one.name.startswith(BOUND) for panel in panels for one in panel.series)
    return FigureData(
        "tracking", source.title, panels, source.setting(), layout=((0,), (1,)), size=(3.5, 3.8),
        share="x", key=((BOUND, Look(FAINT, "", DOTTED)),) if bounded else (),
    )  # fmt: skip


def _panel(source: Source, error: str) -> Panel:
    series, bounds = [], []
    unit, factor = _UNITS[error]
    components = geometry_of(source.scenario).errors[error]
    for scheme in source.names:
        part, look = source.parts[scheme], source.looks[scheme]
        squares = source.pool(squares_of(part, components).sum(axis=-1))
        root = factor * np.sqrt(quotient(squares, source.pool(part["errors"].sum(axis=-1))))
        series.append(Series(scheme, source.x, _positive(root), look=look))
        square, count = pooled_bound(part, error, source.scenario)
        bound = factor * np.sqrt(quotient(source.pool(square), source.pool(count)))
        bounds.append(
            Series(
                f"{BOUND}, {scheme}", source.x, _positive(bound), look=look.plain(DOTTED),
                kind="line", width=1.0, legend=False,
            )
        )  # fmt: skip
    found = [one for one in bounds if not one.empty]
    return Panel(
        source.slot_axis(), Axis(f"{error.capitalize()} RMSE", unit, log=True), (*found, *series),
        guides=source.omni_guides(), empty="no estimates, or none with an error",
    )  # fmt: skip


def _positive(values: Array) -> Array:
    """Return the values with NaN where a logarithmic axis cannot show them."""
    positive: Array = np.where(values > _ZERO, values, np.nan)
    return positive
