"""Figures as records: the common source of the picture, the table and the JSON document."""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Literal

import numpy as np
import numpy.typing as npt

from echobeam.numerals import as_json
from echobeam.plots.field import Field
from echobeam.plots.looks import REFERENCE, Look
from echobeam.values import Array

Layout = tuple[tuple[int, ...], ...]


@dataclass(frozen=True, slots=True)
class Axis:
    """Axis of a panel.

    Attributes
    ----------
    name, unit
        Quantity and its unit; a picture may write the unit with a power of ten.
    log
        Whether the scale is logarithmic; values that are not positive are gaps there.
    limits
        Both ends; None for an end that follows from the data.
    ticks, names
        Positions and labels of the ticks; none where matplotlib chooses.
    """

    name: str
    unit: str = ""
    log: bool = False
    limits: tuple[float | None, float | None] = (None, None)
    ticks: tuple[float, ...] = ()
    names: tuple[str, ...] = ()

    def __str__(self) -> str:
        """Return the axis as a column heading."""
        return f"{self.name} ({self.unit})" if self.unit else self.name


@dataclass(frozen=True, slots=True)
class Series:
    """Values over values, optionally with an interval.

    Attributes
    ----------
    name
        Name in the legend and in the table.
    x, y
        ``(n,)``; NaN makes a gap.
    band
        ``(n, 2)``: the lower and upper end of the interval of ``y`` (of ``x`` if ``sideways``).
    look
        Colour, marker and line style; by default those of the scheme of this name.
    kind
        ``"curve"``: a line with markers; ``"line"``: a plain line; ``"points"``: markers with
        error bars; ``"band"``: the interval alone.
    width
        Width of a plain line, points.
    legend
        Whether the series is in the legend.
    arrow
        Whether the line ends in the head of an arrow.
    sideways
        Whether the intervals are those of ``x``.
    hollow
        Points whose markers are not filled.
    """

    name: str
    x: npt.NDArray[np.generic]
    y: npt.NDArray[np.generic]
    band: Array | None = None
    look: Look | None = None
    kind: Literal["curve", "line", "points", "band"] = "curve"
    width: float = 1.3
    legend: bool = True
    arrow: bool = False
    sideways: bool = False
    hollow: bool = False

    @property
    def empty(self) -> bool:
        """Whether the series holds no number."""
        found = self.band if self.kind == "band" and self.band is not None else self.y
        return not np.isfinite(np.asarray(found, dtype=float)).any()


@dataclass(frozen=True, slots=True)
class Guide:
    """Reference across a panel: a value of an axis, or the range between two.

    ``reach`` is the share of the panel that a single value's line crosses.
    """

    axis: Literal["x", "y"]
    at: float
    to: float | None = None
    look: Look = REFERENCE
    name: str = ""
    alpha: float = 1.0
    reach: float = 1.0


@dataclass(frozen=True, slots=True)
class Note:
    """Text in a panel, at a position in data or (``inside``) in shares of the panel.

    ``between`` draws a double arrow along ``y`` from one value to another.
    """

    text: str
    x: float
    y: float
    colour: str = "black"
    inside: bool = False
    offset: tuple[float, float] = (0.0, 0.0)
    align: Literal["left", "center", "right"] = "center"
    bold: bool = False
    between: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Panel:
    """Panel of a figure: one pair of axes.

    Attributes
    ----------
    empty
        Text shown if no series holds a number.
    equal
        Whether the two axes have equal scale.
    legend
        Whether the panel has a legend of its own.
    field
        Field below the series, in shades; its levels are those of all panels of a figure.
    """

    x: Axis
    y: Axis
    series: tuple[Series, ...]
    title: str = ""
    guides: tuple[Guide, ...] = ()
    notes: tuple[Note, ...] = ()
    empty: str = "nothing to show"
    equal: bool = False
    legend: bool = False
    field: Field | None = None


@dataclass(frozen=True, slots=True)
class FigureData:
    """Figure as a record: title, setting, and all numbers shown.

    Attributes
    ----------
    id
        Name of the figure.
    title, setting, caption
        Title; values of the scenario; meaning of bands and marks.
    panels
        In the order of ``layout``.
    layout
        Rows of the panels' numbers, a number repeated where a panel spans several cells and -1
        where a cell is empty; one row by default.
    widths, heights
        Ratios of columns and rows.
    size
        Inches without the title, see `looks.COLUMN` and `looks.PAGE`.
    share
        Axes that all panels share.
    band
        Meaning of shaded intervals, for the legend.
    key
        Further entries of the legend: text and look.
    """

    id: str
    title: str
    panels: tuple[Panel, ...]
    setting: str = ""
    caption: str = ""
    layout: Layout = ()
    widths: tuple[float, ...] = ()
    heights: tuple[float, ...] = ()
    size: tuple[float, float] = (3.5, 2.75)
    share: Literal["", "x", "y", "xy"] = ""
    band: str = ""
    key: tuple[tuple[str, Look], ...] = ()

    def csv(self) -> str:
        """Return all numbers as a tidy table, one row per value; a missing number is empty.

        A figure with fields has two more columns: their quantity and its value at x and y.
        """
        out = io.StringIO()
        writer = csv.writer(out, lineterminator="\n")
        columns = ("panel", "series", "x quantity", "x", "y quantity", "y", "low", "high")
        fields = any(panel.field is not None for panel in self.panels)
        writer.writerow((*columns, "quantity", "value") if fields else columns)
        writer.writerows((*row, "", "") if fields else row for row in self._rows())
        writer.writerows(self._field_rows())
        return out.getvalue()

    def json(self) -> str:
        """Return the whole record as a JSON document; a missing number is null."""
        return json.dumps(as_json(asdict(self)), indent=1, allow_nan=False) + "\n"

    def _rows(self) -> Iterator[tuple[str, ...]]:
        for number, panel in enumerate(self.panels):
            heading = _heading(panel, number)
            for one in panel.series:
                ends = one.band if one.band is not None else np.full((len(one.x), 2), np.nan)
                for x, y, (low, high) in zip(one.x, one.y, ends, strict=True):
                    numbers = (str(panel.x), _cell(x), str(panel.y), _cell(y))
                    yield (heading, one.name, *numbers, _cell(low), _cell(high))
            for guide in filter(lambda one: one.name, panel.guides):
                for at in (guide.at,) if guide.to is None else (guide.at, guide.to):
                    x, y = (_cell(at), "") if guide.axis == "x" else ("", _cell(at))
                    yield (heading, guide.name, str(panel.x), x, str(panel.y), y, "", "")

    def _field_rows(self) -> Iterator[tuple[str, ...]]:
        for number, panel in enumerate(self.panels):
            if (field := panel.field) is not None:
                heading = _heading(panel, number)
                for x, y, value in field.rows():
                    place = (str(panel.x), _cell(x), str(panel.y), _cell(y), "", "")
                    yield (heading, field.name, *place, str(field), _cell(value))


def interval_series(
    name: str, x: npt.ArrayLike, found: tuple[Array, Array], look: Look | None = None
) -> Series:
    """Return a curve from values ``(n,)`` and their intervals ``(n, 2)``."""
    return Series(name, np.asarray(x), *found, look)


def quantile_series(
    name: str, x: npt.ArrayLike, samples: Array, look: Look | None = None
) -> Series:
    """Return the median over the first axis, with the band between 5 % and 95 % quantiles."""
    low, centre, high = np.nanquantile(samples, [0.05, 0.5, 0.95], axis=0)
    return Series(name, np.asarray(x), centre, np.stack([low, high], axis=-1), look)


def grid(count: int, columns: int) -> Layout:
    """Return the layout of ``count`` panels in rows of ``columns``."""
    rows = math.ceil(count / columns)
    cells = [number if number < count else -1 for number in range(rows * columns)]
    return tuple(tuple(cells[row * columns : (row + 1) * columns]) for row in range(rows))


def _heading(panel: Panel, number: int) -> str:
    return panel.title.replace("\n", ", ") or str(number + 1)


def _cell(value: object) -> str:
    number = float(value)  # type: ignore[arg-type]
    return f"{number:.9g}" if math.isfinite(number) else ""
