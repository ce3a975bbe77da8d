"""Drawing of figures with matplotlib: one style, without pyplot's global state."""

from __future__ import annotations

import io
import math
import re
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from echobeam.plots.axes import CHARACTERS_PER_INCH, label_outer, set_axis
from echobeam.plots.looks import AREA, BAR, FAINT, RING, SHADE, Look, scheme_looks
from echobeam.plots.record import FigureData, Guide, Note, Panel, Series
from echobeam.plots.shading import add_bar, shade
from echobeam.values import BoolArray

_RC: dict[str, Any] = {
    "font.size": 8.0, "axes.titlesize": 8.0, "axes.labelsize": 8.0, "figure.titlesize": 8.5,
    "legend.fontsize": 7.5, "xtick.labelsize": 7.5, "ytick.labelsize": 7.5,
    "axes.linewidth": 0.6, "axes.grid": True, "axes.axisbelow": True, "axes.titlepad": 4.0,
    "grid.linewidth": 0.4, "grid.color": "0.85", "lines.linewidth": 1.3,
    "lines.markersize": 4.0, "lines.markeredgewidth": 0.8, "patch.linewidth": 0.6,
    "xtick.major.width": 0.6, "ytick.major.width": 0.6, "xtick.major.size": 2.5,
    "ytick.major.size": 2.5, "ytick.minor.size": 1.5, "ytick.minor.width": 0.4,
    "xtick.direction": "in", "ytick.direction": "in", "legend.frameon": False,
    "legend.handlelength": 2.6, "legend.columnspacing": 1.2, "legend.labelspacing": 0.3,
    "figure.dpi": 100.0, "savefig.dpi": 300.0, "pdf.fonttype": 42, "svg.fonttype": "path",
    "svg.hashsalt": "echobeam", "path.simplify": True,
}  # fmt: skip

_MARKERS = 20  # largest number on a line
_LONG, _FINE = 60, 0.9  # points of a long line, and its width
_LEGEND_COLUMNS = 6
_USUAL_LEGEND = 0.4  # inches: two rows, as assumed in the figures' heights
_LINE_HEIGHT = 0.13  # inches per line of the title


class Picture(Figure):
    """Figure that a notebook displays, whether or not pyplot was imported."""

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        with styled():
            self.savefig(buffer, format="png", dpi=150)
        return buffer.getvalue()


@contextmanager
def styled() -> Iterator[None]:
    """Draw or save in this style, whatever the user's matplotlib settings."""
    # Typed as Any: newer matplotlib enumerates the keys, older ones take any text.
    settings: Any = {key: mpl.rcParamsDefault[key] for key in mpl.rcParamsDefault}
    settings = {key: value for key, value in settings.items() if "backend" not in key}
    with mpl.rc_context(settings | _RC):
        yield


@styled()
def draw(data: FigureData, *, captions: bool = True) -> Picture:
    """Draw a figure.

    Parameters
    ----------
    data
        Figure to draw.
    captions
        Whether title, setting and caption are written above the panels.

    Returns
    -------
    matplotlib.figure.Figure
        Independent of pyplot: no need to close it.
    """
    lines = _heading(data) if captions else []
    width, height = data.size
    figure = Picture((width, height + _LINE_HEIGHT * len(lines)), layout="constrained")
    if lines:
        figure.suptitle("\n".join(lines))
    layout = data.layout or (tuple(range(len(data.panels))),)
    places = figure.subplot_mosaic(
        [[str(number) for number in row] for row in layout],
        sharex="x" in data.share,
        sharey="y" in data.share,
        width_ratios=data.widths or None,
        height_ratios=data.heights or None,
        empty_sentinel="-1",
    )
    looks = _looks(data)
    panels = [(places[str(number)], panel) for number, panel in enumerate(data.panels)]
    drawn = [_draw_panel(axes, panel, looks) for axes, panel in panels]
    _shade(figure, panels)
    for axes, panel in panels:  # after all data are drawn, since panels may share their axes
        set_axis(axes, panel.x, "x")
        set_axis(axes, panel.y, "y")
    entries: dict[str, Artist] = {}
    for (axes, panel), found in zip(panels, drawn, strict=True):
        if panel.legend:
            axes.legend(handles=list(found.values()), loc="best")
        else:
            entries = found | entries
    if data.share:
        label_outer([axes for axes, _ in panels], data.share)
    for text, look in data.key:
        entries[text] = _entry(text, look)
    series = [one for panel in data.panels for one in panel.series if one.band is not None]
    banded = [one for one in series if np.isfinite(np.asarray(one.band)).any()]
    if data.band and banded:
        bars = all(_lone(one).any() for one in banded)
        entries[data.band] = _entry(data.band, Look("0.4", BAR, "") if bars else Look("0.8", AREA))
    if entries:
        _add_legend(figure, list(entries.values()))
    return figure


def _shade(figure: Figure, panels: Sequence[tuple[Axes, Panel]]) -> None:
    """Draw the panels' fields and the colour bar that they share."""
    shaded = [(axes, panel.field) for axes, panel in panels if panel.field is not None]
    if shaded:
        found = [shade(axes, field) for axes, field in shaded]
        add_bar(figure, [axes for axes, _ in shaded], found[0], shaded[0][1])


def _entry(text: str, look: Look) -> Artist:
    """Return a legend entry that belongs to no series."""
    if look.marker == AREA:
        return Patch(facecolor=look.colour, label=text)
    if look.marker == RING:
        return Patch(facecolor="none", edgecolor=look.colour, label=text)
    return Line2D(
        [], [], color=look.colour, linestyle=look.line, marker=look.marker, linewidth=1.0,
        markerfacecolor="white", markersize=9 if look.marker == BAR else 4, label=text,
    )  # fmt: skip


def _heading(data: FigureData) -> list[str]:
    """Return the lines above the panels, wrapped at the figure's width."""
    most = int(1.1 * CHARACTERS_PER_INCH * data.size[0])
    texts = (data.title, data.setting, *data.caption.split("\n"))
    return [line for text in texts if text for line in textwrap.wrap(text, most)]


def _looks(data: FigureData) -> dict[str, Look]:
    """Return the looks of the series that define none, by name."""
    names = [one.name for panel in data.panels for one in panel.series if one.look is None]
    return scheme_looks(list(dict.fromkeys(names)))


def _draw_panel(axes: Axes, panel: Panel, looks: dict[str, Look]) -> dict[str, Artist]:
    """Draw a panel and return the legend entries by name."""
    inches = axes.get_window_extent().width / axes.figure.dpi
    axes.set_title(_in_lines(panel.title, max(12, int(1.2 * CHARACTERS_PER_INCH * inches))))
    entries: dict[str, Artist] = {}
    for guide in panel.guides:
        artist = _draw_guide(axes, guide)
        if guide.name:
            entries.setdefault(guide.name, artist)
    drawn: dict[str, Artist] = {}
    for one in panel.series:
        artist = _draw_series(axes, one, one.look or looks[one.name], log=panel.y.log)
        if one.legend:
            drawn.setdefault(one.name, artist)
    if panel.field is None and all(one.empty for one in panel.series):
        _write(axes, Note(panel.empty, 0.5, 0.5, FAINT, inside=True))
    for note in panel.notes:
        _write(axes, note)
    if panel.equal:
        axes.set_aspect("equal")
    return drawn | entries


def _lone(one: Series) -> BoolArray:
    """Return where an interval is a bar: at points, and where none beside it makes an area."""
    found: BoolArray = np.isfinite(np.asarray(one.band)).all(axis=1)
    beside = np.pad(found, 1)
    return found if one.kind == "points" else found & ~(beside[:-2] | beside[2:])


def _draw_series(axes: Axes, one: Series, look: Look, *, log: bool) -> Artist:
    """Draw one series and return its legend entry."""
    if one.empty:
        return Line2D(
            [], [], color=look.colour, marker=look.marker, linestyle="", alpha=0.5,
            markerfacecolor="white", label=f"{one.name} (none)",
        )  # fmt: skip
    y = np.where(np.asarray(one.y) > 0, one.y, np.nan) if log else one.y
    if one.kind == "points":
        return _draw_points(axes, one, look)
    if one.band is not None:
        low, high = one.band.T
        strength = 1.0 if one.kind == "band" else 0.2 if one.width >= 1.0 else 0.1
        axes.fill_between(
            np.asarray(one.x, dtype=float), low, high, color=look.colour, alpha=strength,
            linewidth=0, zorder=1.2 if one.kind == "band" else 1.5,
        )  # fmt: skip
        lone, ends = _lone(one), np.abs(one.band.T - np.asarray(one.y))
        axes.errorbar(one.x[lone], one.y[lone], ends[:, lone], fmt="none", ecolor=look.colour,
                      capsize=2, elinewidth=0.9)  # fmt: skip
    if one.kind == "band":
        return Patch(facecolor=look.colour, label=one.name)
    long = len(one.x) > _LONG
    width = _FINE if long and one.kind == "curve" else one.width
    marker = look.marker if one.kind == "curve" else ""
    (line,) = axes.plot(
        one.x, y, color=look.colour, linestyle=look.line, linewidth=width, marker=marker,
        markevery=max(1, math.ceil(len(one.x) / _MARKERS)), markerfacecolor="white",
        label=one.name, zorder=2.5,
    )  # fmt: skip
    if one.arrow:
        _draw_arrow(axes, one, look.colour)
    return line


def _draw_points(axes: Axes, one: Series, look: Look) -> Artist:
    face = "white" if one.hollow else look.colour
    looks: dict[str, Any] = {
        "color": look.colour, "marker": look.marker, "markerfacecolor": face, "label": one.name,
        "linestyle": look.line, "zorder": 3,
    }  # fmt: skip
    if one.band is None:
        return axes.plot(one.x, one.y, **looks)[0]
    centre = np.asarray(one.x if one.sideways else one.y, dtype=float)
    ends = np.abs(one.band.T - centre)
    errors = {"xerr" if one.sideways else "yerr": ends}
    bars: Any = axes.errorbar(one.x, one.y, capsize=2, **errors, **looks)
    return bars  # type: ignore[no-any-return]


def _draw_arrow(axes: Axes, one: Series, colour: str) -> None:
    """Draw an arrow of fixed size along the end of a line, or a dot if the line is a point."""
    path = np.stack([np.asarray(one.x, dtype=float), np.asarray(one.y, dtype=float)], axis=-1)
    path = path[np.isfinite(path).all(axis=1)]
    step = path[-1] - path[max(len(path) - 10, 0)]
    length = float(np.hypot(*step))
    if length < 1e-6:
        axes.plot(*path[-1:].T, color=colour, marker="o", linestyle="", zorder=4)
        return
    tail = tuple(-14.0 * step / length)
    arrow = {
        "arrowstyle": "-|>", "color": colour, "linewidth": 1.2, "shrinkA": 0, "shrinkB": 0,
        "mutation_scale": 9,
    }  # fmt: skip
    axes.annotate(
        "", tuple(path[-1]), xytext=tail, textcoords="offset points", zorder=4, arrowprops=arrow
    )


def _draw_guide(axes: Axes, guide: Guide) -> Artist:
    """Draw a reference line or range and return its legend entry."""
    look = guide.look
    if guide.to is not None:
        span = axes.axvspan if guide.axis == "x" else axes.axhspan
        span(guide.at, guide.to, color=look.colour, alpha=guide.alpha, linewidth=0, zorder=0.5)
        edge = "0.7" if look.colour == SHADE else look.colour
        return Patch(facecolor=look.colour, alpha=guide.alpha, edgecolor=edge, label=guide.name)
    style: dict[str, Any] = {
        "color": look.colour, "linestyle": look.line, "linewidth": 0.8, "alpha": guide.alpha,
    }  # fmt: skip
    if guide.axis == "x":
        axes.axvline(guide.at, ymax=guide.reach, zorder=1.6, **style)
    else:
        axes.axhline(guide.at, xmax=guide.reach, zorder=1.4, **style)
    return Line2D([], [], label=guide.name, **style)


def _write(axes: Axes, note: Note) -> None:
    if note.between is not None:
        low, high = note.between
        arrow = {"arrowstyle": "<->", "color": "0.25", "linewidth": 0.8, "shrinkA": 2, "shrinkB": 2}
        axes.annotate("", (note.x, high), (note.x, low), arrowprops=arrow, zorder=4)
    axes.annotate(
        note.text, (note.x, note.y), note.offset, textcoords="offset points",
        xycoords="axes fraction" if note.inside else "data", color=note.colour, ha=note.align,
        va="center", fontweight="bold" if note.bold else "normal", zorder=6,
        bbox={"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 1.0},
    )  # fmt: skip


def _in_lines(text: str, most: int) -> str:
    """Return a text with its lines broken where they are too long."""
    signs = sum(text.count(sign) for sign in "$_{}")  # of formulas, which are not drawn
    return "\n".join(textwrap.fill(line, most + signs) for line in text.split("\n"))


def _add_legend(figure: Figure, handles: Sequence[Artist]) -> None:
    """Add the legend below the axes, in as few rows as possible.

    Long labels are wrapped. The figure grows with a legend of many rows, so that the axes keep
    their size.
    """
    most = int(CHARACTERS_PER_INCH * figure.get_figwidth())
    for handle in handles:
        handle.set_label(wrap_name(str(handle.get_label()), most))
    for columns in range(min(len(handles), _LEGEND_COLUMNS), 0, -1):
        legend = figure.legend(
            handles=list(handles), loc="outside lower center", ncols=columns, borderaxespad=0.2
        )
        extent = legend.get_window_extent()
        if columns == 1 or extent.width <= 0.93 * figure.bbox.width:
            extra = extent.height / figure.dpi - _USUAL_LEGEND
            figure.set_figheight(figure.get_figheight() + max(0.0, extra))
            return
        legend.remove()


def wrap_name(text: str, most: int) -> str:
    """Break a name, after commas where possible, into lines of at most ``most`` characters."""
    lines = [""]
    for piece in re.findall(rf"[^, ]{{1,{most}}}[, ]*|[, ]+", text):
        if lines[-1] and len(lines[-1] + piece.rstrip()) > most:
            lines.append("")
        lines[-1] += piece
    return "\n".join(line.rstrip() for line in lines)
