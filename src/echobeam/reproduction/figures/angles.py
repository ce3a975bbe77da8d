"""Angle estimates over the slots, proposed against pilot, for several arrays (the paper's t3)."""

from __future__ import annotations

import numpy as np

from echobeam.plots import style
from echobeam.reproduction import drawing as draw_as
from echobeam.reproduction.estimates import rms_with_band
from echobeam.reproduction.records import Figure, Picture
from echobeam.reproduction.results import Results
from echobeam.reproduction.setups import ANTENNAS, single
from echobeam.reproduction.tables import Table
from echobeam.values import Array

SCHEMES = {"temporal": "proposed (temporal)", "pilot": "pilot (held)"}
QUANTILES = (0.05, 0.5, 0.95)


def estimates(results: Results, n: int, scheme: str) -> Array:
    """Return ``(trial, slot)`` deg: the single object's estimated angle."""
    return np.asarray(np.degrees(results[single(n).name].of("estimated", scheme)[:, :, 0, 0]))


def rmse(results: Results, n: int, scheme: str) -> tuple[Array, Array]:
    """Return the estimate's error per slot, deg, and its 95 % band."""
    error = results[single(n).name].error(scheme, "angle")[:, :, 0]
    return rms_with_band(np.degrees(error))


def tabulate(results: Results) -> Table:
    """Return quantiles and errors of the estimates of every array, scheme and slot."""
    rows: list[tuple[str | int | float, ...]] = []
    for n in ANTENNAS:
        for scheme in SCHEMES:
            low, centre, high = np.quantile(estimates(results, n, scheme), QUANTILES, axis=0)
            error, band = rmse(results, n, scheme)
            rows += [
                (n, scheme, i + 1, *map(float, (low[i], centre[i], high[i], error[i], *band[i])))
                for i in range(len(error))
            ]
    names = ("estimate 5 %", "estimate median", "estimate 95 %", "RMSE", "RMSE low", "RMSE high")
    return Table(("antennas", "scheme", "slot", *(f"{name} (deg)" for name in names)), rows)


@style.styled()
def draw(results: Results) -> Picture:
    """Draw the estimates of the smallest and the largest array, and all arrays' errors."""
    figure = style.new_figure(style.PAGE, 3.1)
    *panels, last = figure.subplots(1, 3)
    handles = []
    for axes, n in zip(panels, (ANTENNAS[0], ANTENNAS[-1]), strict=True):
        outcome = results[single(n).name]
        truth = np.degrees(outcome.kept["truth"][0, :, 0, 0])
        slots = np.arange(1, len(truth) + 1)
        handles = axes.plot(slots, truth, color="black", linewidth=1.0, label="true angle")
        for scheme, label in SCHEMES.items():
            low, centre, high = np.quantile(estimates(results, n, scheme), QUANTILES, axis=0)
            look, band = style.SCHEME_LOOKS[scheme], np.stack([low, high], axis=-1)
            handles.append(draw_as.curve(axes, slots, centre, band, look, label))
        draw_as.slot_axis(axes, len(slots))
        axes.set_title(f"estimate, $N_t$ = $N_r$ = {n}")
        axes.set_ylabel("Angle estimate (deg)")
    panels[1].set_ylim(panels[0].get_ylim())
    for n in ANTENNAS:
        for scheme in SCHEMES:
            error, band = rmse(results, n, scheme)
            look = style.SCHEME_LOOKS[scheme]
            draw_as.curve(last, range(1, len(error) + 1), error, band, look, f"{n}")
            at = (float(len(error)), float(error[-1]))
            last.annotate(f"{n}", at, (4, 0), textcoords="offset points", va="center")
    style.scale_log(last)
    draw_as.slot_axis(last, 10)
    last.set_xlim(0.5, 11.6)
    last.set_title("error; at the lines: $N_t$ = $N_r$")
    last.set_ylabel("Angle RMSE (deg)")
    outcome = results[single().name]
    draw_as.titled(
        figure,
        "Angle tracking, proposed against pilot scheme",
        f"{draw_as.flight(outcome.scenario, antennas=False)}; {draw_as.objects(outcome.scenario)}",
        f"{outcome.point.trials} trials; estimates: medians with 5–95 % bands; errors: 95 % bands; "
        "shaded: omni or pilot slot",
    )
    style.add_legend(figure, handles)
    return Picture(figure, tabulate(results))


FIGURE = Figure(
    "t3",
    "angle estimates over the slots, proposed against pilot, for several arrays",
    tuple(single(n) for n in ANTENNAS),
    draw,
)
