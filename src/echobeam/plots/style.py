"""One look for every picture: sizes for a two-column paper, colours for every eye, grey too.

A scheme keeps its colour, marker and line style from picture to picture. Colours are those of
Okabe and Ito, which the colour-blind tell apart; markers and line styles carry the same
information once more, so that a copy in grey still reads.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, Literal

import matplotlib as mpl
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

COLUMN = 3.5
"""Width of a column in a two-column paper, inches."""

PAGE = 7.16
"""Width of both columns, inches."""

BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
YELLOW, BLUE, VERMILION, PURPLE = "#F0E442", "#0072B2", "#D55E00", "#CC79A7"

SHADE = "0.91"
FAINT = "0.45"

MAX_MARKERS = 20
"""Number of markers that a line has at most, however many slots a run has."""

_FIRST_MARKERS = 5

# Lines of more points than this are drawn finer: they go up and down with every frame.
_LONG_RUN, _FINE = 60, 0.9

_RC: dict[str, Any] = {
    "font.size": 8.0,
    "axes.titlesize": 8.0,
    "axes.labelsize": 8.0,
    "figure.titlesize": 8.5,
    "legend.fontsize": 7.5,
    "xtick.labelsize": 7.5,
    "ytick.labelsize": 7.5,
    "axes.linewidth": 0.6,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.titlepad": 4.0,
    "grid.linewidth": 0.4,
    "grid.color": "0.85",
    "lines.linewidth": 1.3,
    "lines.markersize": 4.0,
    "lines.markeredgewidth": 0.8,
    "patch.linewidth": 0.6,
    "xtick.major.width": 0.6,
    "ytick.major.width": 0.6,
    "xtick.major.size": 2.5,
    "ytick.major.size": 2.5,
    "ytick.minor.size": 1.5,
    "ytick.minor.width": 0.4,
    "xtick.direction": "in",
    "ytick.direction": "in",
    "legend.frameon": False,
    "legend.handlelength": 2.6,
    "legend.columnspacing": 1.2,
    "legend.labelspacing": 0.3,
    "figure.dpi": 100.0,
    "savefig.dpi": 300.0,
    "pdf.fonttype": 42,
    "svg.fonttype": "path",
    "svg.hashsalt": "echobeam",
    "path.simplify": True,
}

_MOST_COLUMNS = 6

# inches: two rows of a legend, for which the figures' heights are made.
_USUAL_LEGEND = 0.4

# Characters of a legend's text per inch of the figure; names of schemes were measured to have
# 15 to 17 at this size of type.
_CHARACTERS_PER_INCH = 13

LineStyle = Literal["-"] | tuple[float, tuple[float, ...]]


@dataclass(frozen=True, slots=True)
class Look:
    """Colour, marker and line style that tell a line from others, in colour and in grey."""

    colour: str
    marker: str
    line: LineStyle


_DASHED: LineStyle = (0, (4.0, 1.5))
_DASH_DOT: LineStyle = (0, (5.0, 1.2, 1.0, 1.2))
_DOTTED: LineStyle = (0, (1.0, 1.2))
_LONG: LineStyle = (0, (8.0, 2.0))
_DASH_DOT_DOT: LineStyle = (0, (4.0, 1.2, 1.0, 1.2, 1.0, 1.2))
_SHORT: LineStyle = (0, (2.5, 1.0))

SCHEME_LOOKS: dict[str, Look] = {
    "temporal": Look(BLUE, "o", "-"),
    "pilot": Look(VERMILION, "s", _DASHED),
    "water-filling": Look(GREEN, "^", _DASH_DOT),
    "genie": Look(BLACK, "D", _DOTTED),
    "omni": Look(SKY, "v", _LONG),
    "pilot-needle": Look(ORANGE, "<", _DASH_DOT_DOT),
    "pilot-predict": Look(PURPLE, ">", _SHORT),
}
"""Looks of the built-in schemes; users' schemes and variants take those of `_OTHERS`."""

_OTHERS = (
    Look(PURPLE, "X", "-"),
    Look(ORANGE, "P", _SHORT),
    Look(SKY, "p", _DASHED),
    Look(BLACK, "*", _LONG),
    Look(GREEN, "h", _DASH_DOT_DOT),
    Look(VERMILION, "8", _DASH_DOT),
    Look(BLUE, "d", _DOTTED),
)

_OBJECTS = (
    Look(BLUE, "o", "-"),
    Look(VERMILION, "s", _DASHED),
    Look(GREEN, "^", _DASH_DOT),
    Look(PURPLE, "D", _SHORT),
    Look(ORANGE, "v", _LONG),
    Look(BLACK, "<", _DOTTED),
    Look(SKY, ">", _DASH_DOT_DOT),
    Look("0.5", "P", "-"),
)

MAX_OBJECTS = len(_OBJECTS)
"""Objects that one picture can tell apart."""


@contextmanager
def styled() -> Iterator[None]:
    """Draw or save in this style, whatever the user's own matplotlib settings are."""
    # Typed as Any: newer matplotlib enumerates the keys, older ones take any text.
    settings: Any = {key: mpl.rcParamsDefault[key] for key in mpl.rcParamsDefault}
    settings = {key: value for key, value in settings.items() if "backend" not in key}
    with mpl.rc_context(settings | _RC):
        yield


def scheme_looks(names: Sequence[str]) -> dict[str, Look]:
    """Return the look of each scheme, the fixed one or, for all others, one that is free.

    Variants of a scheme (``temporal:ripple=1``) and users' schemes take colours and lines that the
    built-in schemes among ``names`` leave free, as long as there are any.
    """
    fixed = {name: SCHEME_LOOKS[name] for name in names if name in SCHEME_LOOKS}
    colours, lines = ({getattr(look, it) for look in fixed.values()} for it in ("colour", "line"))
    free = sorted(_OTHERS, key=lambda look: (look.colour in colours, look.line in lines))
    others = [name for name in names if name not in fixed]
    return fixed | {name: _other_look(free, i) for i, name in enumerate(others)}


def _other_look(looks: Sequence[Look], index: int) -> Look:
    """Return a look by its number: beyond the last one, markers and lines change places."""
    count = len(looks)
    turn = index // count
    colour, marker, line = (looks[(index + shift * turn) % count] for shift in range(3))
    return Look(colour.colour, marker.marker, line.line)


def object_look(index: int) -> Look:
    """Return the look of an object, counted from 0."""
    return _OBJECTS[index % MAX_OBJECTS]


def marker_step(points: int) -> int:
    """Return how many points lie from one marker to the next."""
    return max(1, math.ceil(points / MAX_MARKERS))


def marked_points(points: int) -> list[int]:
    """Return which points have markers if the beginning is what matters: all of the first few."""
    return sorted({*range(min(points, _FIRST_MARKERS)), *range(0, points, marker_step(points))})


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of this size in inches, outside pyplot's global state."""
    return Figure(figsize=(width, height), layout="constrained")


def draw_line(axes: Axes, x: Any, y: Any, look: Look, label: str, *, zorder: float = 2.0) -> Line2D:
    """Draw one line with its markers thinned and hollow enough to see what lies beneath."""
    (line,) = axes.plot(
        x,
        y,
        color=look.colour,
        linestyle=look.line,
        linewidth=_FINE if len(x) > _LONG_RUN else None,
        marker=look.marker,
        markevery=marker_step(len(x)),
        markerfacecolor="white",
        label=label,
        zorder=zorder,
    )
    return line


def scale_log(axes: Axes) -> None:
    """Give the axes a logarithmic scale with plain numbers, several of them on a short one."""
    axes.set_yscale("log")
    axes.margins(y=0.08)
    low, high = axes.get_ylim()
    finer = (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0) if high < 12.0 * low else (1.0, 2.0, 5.0)
    subs = finer if high < 200.0 * low else (1.0,)
    axes.yaxis.set_major_locator(LogLocator(subs=subs, numticks=12))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())


def add_note(axes: Axes, text: str, height: float = 0.5) -> None:
    """Say in the middle of the axes why there is nothing, or not everything, to see."""
    axes.text(
        0.5,
        height,
        text,
        transform=axes.transAxes,
        ha="center",
        va="center",
        color=FAINT,
        fontsize="medium",
        zorder=6,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 2.0},
    )


def add_legend(figure: Figure, handles: Sequence[Artist]) -> None:
    """Put the legend below the axes, where it covers no data, in as few rows as fit.

    Long labels are wrapped. The figure grows with a legend of many rows, so that the axes keep
    their size.
    """
    for handle in handles:
        most = int(_CHARACTERS_PER_INCH * figure.get_figwidth())
        handle.set_label(wrap_name(str(handle.get_label()), most))
    for columns in range(min(len(handles), _MOST_COLUMNS), 0, -1):
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
    """Break a name, after commas where possible, into lines of so many characters at most."""
    lines = [""]
    for piece in re.findall(rf"[^, ]{{1,{most}}}[, ]*|[, ]+", text):
        if lines[-1] and len(lines[-1] + piece.rstrip()) > most:
            lines.append("")
        lines[-1] += piece
    return "\n".join(line.rstrip() for line in lines)


def absent(look: Look, label: str) -> Line2D:
    """Return a legend entry for a line that could not be drawn."""
    return Line2D(
        [],
        [],
        color=look.colour,
        marker=look.marker,
        linestyle="",
        alpha=0.5,
        markerfacecolor="white",
        label=label,
    )
