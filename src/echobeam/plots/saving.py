"""Pictures as files: whole or not at all, and the same bytes for the same picture."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from echobeam.plots import style
from echobeam.plots.setting import PlotError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FORMATS = ("png", "pdf", "svg")

# No dates inside: the same picture is the same file.
_METADATA: dict[str, dict[str, Any]] = {
    "png": {},
    "pdf": {"CreationDate": None, "ModDate": None},
    "svg": {"Date": None},
}


def picture_format(suffix: str) -> str:
    """Return ``"png"``, ``"pdf"`` or ``"svg"`` for a suffix with or without its dot, in any case.

    Raises
    ------
    PlotError
        If the suffix is none of them.
    """
    kind = suffix.lower().removeprefix(".")
    if kind not in FORMATS:
        accepted = ", ".join("." + one for one in FORMATS)
        raise PlotError(f"cannot write a picture as {suffix!r}; accepted: {accepted}")
    return kind


def save(figure: Figure, path: str | os.PathLike[str]) -> Path:
    """Write a picture in the format of its suffix, under a temporary name that is then renamed.

    Parameters
    ----------
    figure
        The picture.
    path
        Where to: ``.png``, ``.pdf`` or ``.svg``; what is there is replaced.

    Raises
    ------
    PlotError
        If the suffix is none of these.
    OSError
        If the file cannot be written; nothing is left behind.
    """
    target = Path(path)
    kind = picture_format(target.suffix)
    partial = target.with_name(f".{target.name}.{os.getpid()}.tmp")
    try:
        with style.styled():
            figure.savefig(partial, format=kind, metadata=_METADATA[kind])
        partial.replace(target)
    finally:
        partial.unlink(missing_ok=True)
    return target
