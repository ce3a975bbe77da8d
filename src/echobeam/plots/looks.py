"""Looks of lines, distinct in colour and in grey, and the same in every picture.

Colours are those of Okabe and Ito, distinct to colour-blind readers; markers and line styles carry
the same information, so that a grey copy remains readable.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

COLUMN = 3.5
"""Width of a column in a two-column paper, inches."""

PAGE = 7.16
"""Width of both columns, inches."""

BLACK, ORANGE, SKY, GREEN = "#000000", "#E69F00", "#56B4E9", "#009E73"
BLUE, VERMILION, PURPLE = "#0072B2", "#D55E00", "#CC79A7"

SHADE, BAND, FAINT = "0.91", "0.78", "0.45"
"""Greys of shaded slots, of a band of expected values, and of references."""

AREA = "area"
"""Marker of a legend entry that is a filled area."""

BAR = "|"
"""Marker of a legend entry that is an error bar."""

RING = "ring"
"""Marker of a legend's entry that is an outline."""

LineStyle = Literal["-", ""] | tuple[float, tuple[float, ...]]

DASHED: LineStyle = (0, (4.0, 1.5))
DASH_DOT: LineStyle = (0, (5.0, 1.2, 1.0, 1.2))
DOTTED: LineStyle = (0, (1.0, 1.2))
LONG: LineStyle = (0, (8.0, 2.0))
DASH_DOT_DOT: LineStyle = (0, (4.0, 1.2, 1.0, 1.2, 1.0, 1.2))
SHORT: LineStyle = (0, (2.5, 1.0))


@dataclass(frozen=True, slots=True)
class Look:
    """Colour, marker and line style of a line."""

    colour: str
    marker: str = ""
    line: LineStyle = "-"

    def plain(self, line: LineStyle | None = None) -> Look:
        """Return the look without a marker, its line replaced if one is given."""
        return Look(self.colour, "", self.line if line is None else line)


REFERENCE = Look(FAINT)
"""Look of a reference line."""

SCHEME_LOOKS: dict[str, Look] = {
    "temporal": Look(BLUE, "o", "-"),
    "pilot": Look(VERMILION, "s", DASHED),
    "water-filling": Look(GREEN, "^", DASH_DOT),
    "posterior": Look(PURPLE, "X", "-"),
    "genie": Look(BLACK, "D", DOTTED),
    "omni": Look(SKY, "v", LONG),
    "pilot-needle": Look(ORANGE, "<", DASH_DOT_DOT),
    "pilot-predict": Look(PURPLE, ">", SHORT),
}
"""Looks of the built-in schemes; users' schemes and variants use those of `_OTHERS`."""

_OTHERS = (
    Look(PURPLE, "H", "-"),
    Look(ORANGE, "P", SHORT),
    Look(SKY, "p", DASHED),
    Look(BLACK, "*", LONG),
    Look(GREEN, "h", DASH_DOT_DOT),
    Look(VERMILION, "8", DASH_DOT),
    Look(BLUE, "d", DOTTED),
)

_OBJECTS = (
    Look(BLUE, "o", "-"),
    Look(VERMILION, "s", DASHED),
    Look(GREEN, "^", DASH_DOT),
    Look(PURPLE, "D", SHORT),
    Look(ORANGE, "v", LONG),
    Look(BLACK, "<", DOTTED),
    Look(SKY, ">", DASH_DOT_DOT),
    Look("0.5", "P", "-"),
)

PARAMETER_LOOKS = (
    Look(SKY, "v", LONG),
    Look(GREEN, "^", DASHED),
    Look(BLACK, "o", "-"),
    Look(PURPLE, "D", DASH_DOT),
    Look(ORANGE, "s", SHORT),
    Look(BLUE, "<", DOTTED),
    Look(VERMILION, "X", DASH_DOT_DOT),
)
"""Looks of lines that differ by a parameter, not by scheme or object."""

MOST_LINES = len(PARAMETER_LOOKS) ** 2
"""Largest number of lines with distinct looks for a parameter's values."""

MAX_OBJECTS = len(_OBJECTS)
"""Largest number of objects with distinct looks in one picture."""


def scheme_looks(names: Sequence[str]) -> dict[str, Look]:
    """Return the look of each scheme: its fixed look, or a free one for all others.

    Variants of a scheme (``temporal:ripple=1``) and users' schemes get colours and lines unused by
    the built-in schemes among ``names``, as long as there are any.
    """
    fixed = {name: SCHEME_LOOKS[name] for name in names if name in SCHEME_LOOKS}
    colours, lines = ({getattr(look, it) for look in fixed.values()} for it in ("colour", "line"))
    free = sorted(_OTHERS, key=lambda look: (look.colour in colours, look.line in lines))
    others = [name for name in names if name not in fixed]
    return fixed | {name: _other_look(free, i) for i, name in enumerate(others)}


def _other_look(looks: Sequence[Look], index: int) -> Look:
    """Return a look by its number: beyond the last one, markers and lines are recombined."""
    count = len(looks)
    turn = index // count
    colour, marker, line = (looks[(index + shift * turn) % count] for shift in range(3))
    return Look(colour.colour, marker.marker, line.line)


def object_look(index: int) -> Look:
    """Return the look of an object, counted from 0."""
    return _OBJECTS[index % MAX_OBJECTS]


def parameter_look(index: int) -> Look:
    """Return the look of a parameter's value, counted from 0."""
    return _other_look(PARAMETER_LOOKS, index)
