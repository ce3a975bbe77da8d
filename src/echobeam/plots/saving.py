"""Pictures and their numbers as files: written atomically, and equal for equal figures."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from echobeam.plots.record import FigureData
from echobeam.plots.source import PlotError

PICTURES = ("png", "pdf", "svg")
FORMATS = (*PICTURES, "csv", "json")

# No dates in the metadata: equal pictures are equal files.
_METADATA: dict[str, dict[str, Any]] = {
    "png": {},
    "pdf": {"CreationDate": None, "ModDate": None},
    "svg": {"Date": None},
}


def file_format(suffix: str) -> str:
    """Return one of `FORMATS` for a suffix with or without its dot, in any case.

    Raises
    ------
    PlotError
        If the suffix is not one of them.
    """
    kind = suffix.lower().removeprefix(".")
    if kind not in FORMATS:
        accepted = ", ".join("." + one for one in FORMATS)
        raise PlotError(f"cannot write a figure as {suffix!r}; accepted: {accepted}")
    return kind


def picture_formats(suffixes: Sequence[str]) -> tuple[str, ...]:
    """Return some of `PICTURES` for suffixes; raise `PlotError` for any other."""
    names = tuple(suffix.lower().removeprefix(".") for suffix in suffixes)
    for name in set(names) - set(PICTURES):
        raise PlotError(f"cannot draw a picture as {name!r}; accepted: {', '.join(PICTURES)}")
    return names


def write(data: FigureData, path: Path, *, captions: bool = True) -> Path:
    """Write a figure in the format of its suffix, under a temporary name that is then renamed.

    Parameters
    ----------
    data
        Figure to write.
    path
        Path of the file; an existing one is replaced.
    captions
        Whether a picture contains title, setting and caption.

    Raises
    ------
    PlotError
        If the suffix is not one of `FORMATS`.
    OSError
        If the file cannot be written; no partial file remains.
    """
    kind = file_format(path.suffix)
    partial = path.with_name(f".{path.name}.{os.getpid()}.tmp")
    try:
        if kind in PICTURES:
            from echobeam.plots.drawing import draw, styled

            with styled():
                figure = draw(data, captions=captions)
                figure.savefig(partial, format=kind, metadata=_METADATA[kind])
        else:
            partial.write_text(data.csv() if kind == "csv" else data.json(), encoding="utf-8")
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
    return path
