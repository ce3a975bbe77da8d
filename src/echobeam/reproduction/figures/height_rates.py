"""Rates against water-filling over the UAV's height (the paper's t7-1)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from echobeam.estimation.intervals import mean_interval
from echobeam.plots.looks import SCHEME_LOOKS, Look
from echobeam.plots.record import Axis, FigureData, Panel, Series, interval_series
from echobeam.reproduction.captions import omni_slots, setting, slot_axis
from echobeam.reproduction.estimates import bootstrap
from echobeam.reproduction.records import Figure
from echobeam.reproduction.results import Results
from echobeam.reproduction.setups import HEIGHTS, height
from echobeam.values import Array

SCHEMES = {
    "temporal": "proposed (temporal)",
    "water-filling": "water-filling",
    "posterior": "posterior",
}
COMPARED = ("temporal", "water-filling")
"""The two that the paper compares."""

SHOWN = (100, 105, 110)
TAIL = 0.05


def frame_rate(results: Results, metres: int, scheme: str) -> Array:
    """Return ``(trial,)`` bit/s/Hz: the mean rate over a trial's frame."""
    return np.asarray(results[height(metres).name].sum_rate(scheme).mean(axis=-1))


def data(results: Results) -> FigureData:
    """Return a panel per height of the paper, and mean and tail of the frame over all heights."""
    outcome = results[height(SHOWN[0]).name]
    rates = {
        metres: {scheme: results[height(metres).name].sum_rate(scheme) for scheme in SCHEMES}
        for metres in SHOWN
    }
    top = 1.1 * max(float(one.mean(axis=0).max()) for each in rates.values() for one in
                    each.values())  # fmt: skip
    axis = Axis("Rate", "bit/s/Hz", limits=(0.0, top))
    panels = [
        Panel(slot_axis(10), axis, _curves(range(1, 11), each), f"$h$ = {metres} m",
              guides=omni_slots())
        for metres, each in rates.items()
    ]  # fmt: skip
    frames = {
        scheme: np.stack([frame_rate(results, metres, scheme) for metres in HEIGHTS], axis=1)
        for scheme in SCHEMES
    }
    over = Axis("Height $h$", "m", ticks=tuple(map(float, HEIGHTS)))
    panels.append(Panel(over, axis, _curves(HEIGHTS, frames), "mean over the frame, by height"))
    return FigureData(
        "t7-1",
        "Rates of the proposed scheme and of water-filling over the height",
        tuple(panels),
        setting(outcome.scenario, height=False),
        f"{outcome.point.trials} trials: means (with markers) and 5 % quantiles over the trials "
        "(plain)",
        layout=((0, 1), (2, 3)),
        size=(7.16, 4.2),
        band="95 % interval",
    )


def _curves(x: npt.ArrayLike, samples: dict[str, Array]) -> tuple[Series, ...]:
    """Return mean and 5 % quantile of samples ``(trial, n)`` of each scheme."""
    means = [
        interval_series(SCHEMES[scheme], x, mean_interval(one), SCHEME_LOOKS[scheme])
        for scheme, one in samples.items()
    ]
    return (*means, *(_tail(scheme, x, one) for scheme, one in samples.items()))


def _tail(scheme: str, x: npt.ArrayLike, samples: Array) -> Series:
    """Return the 5 % quantile at each x with its bootstrap's interval."""
    tails = [bootstrap(lambda one: np.quantile(one, TAIL, axis=-1), values) for values in samples.T]
    band = np.array([(one.low, one.high) for one in tails])
    look: Look = SCHEME_LOOKS[scheme].plain()
    return Series(
        f"{SCHEMES[scheme]}, 5 % quantile", np.asarray(x), np.array([one.value for one in tails]),
        band, look, kind="line", width=0.8, legend=False,
    )  # fmt: skip


FIGURE = Figure(
    "t7-1",
    "rates against water-filling over the UAV's height",
    tuple(height(metres) for metres in HEIGHTS),
    data,
    place=9,
)
