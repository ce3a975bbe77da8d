"""Reproduction of the paper's figures and claims: the command `echobeam reproduce`."""

from __future__ import annotations

import json
from collections.abc import Sequence
from functools import partial
from os import PathLike
from pathlib import Path
from typing import Any, SupportsIndex

from echobeam.commands.asking import Settings, job_count, setting_texts
from echobeam.commands.progress import Bar, interactive_bar
from echobeam.faults import InputError
from echobeam.plots.saving import picture_formats
from echobeam.reproduction.records import Finding
from echobeam.reproduction.run import QUICK_TRIALS, TRIALS, Reproduction
from echobeam.reproduction.run import reproduce as draw_and_judge
from echobeam.simulation.run import check_count
from echobeam.store.workers import Workers

FEWEST_TRIALS = 2
"""Trials that have an interval, by which claims are judged."""


def reproduce(
    ids: str | Sequence[str] = (),
    *,
    out: str | PathLike[str] = "reproduction",
    trials: SupportsIndex | None = None,
    quick: bool = False,
    seed: SupportsIndex = 0,
    set: Settings | None = None,
    formats: str | Sequence[str] | None = None,
    jobs: SupportsIndex = 1,
    dask: str | None = None,
    resume: bool = False,
    force: bool = False,
    quiet: bool = False,
    format: str | Sequence[str] | None = None,
) -> list[dict[str, Any]]:
    """Reproduce the paper's figures and judge its claims: `echobeam reproduce`.

    Parameters
    ----------
    ids
        Figures, such as ``["t1", "t4"]``; all by default.
    out
        Directory of pictures, data, ``claims.json`` and ``claims.md``.
    trials
        Trials per point, at least 2; 200 by default.
    quick
        A quick look: 20 trials per point.
    set
        Keys of the scenarios that differ from the paper's, ``{"radar.target": "3gpp-vehicle"}``.
    formats, format
        Formats of the pictures: some of ``png`` (the default), ``pdf`` and ``svg``, as a list or as
        on the command line, ``"png,pdf"``; the latter two have no captions.
    seed, jobs, dask, resume, force, quiet
        As for `run`.

    Returns
    -------
    list of dict
        The claims as in ``claims.json``: id, figure, text, paper, ours, interval, reading, verdict.

    Raises
    ------
    InputError
        If an id is unknown, a setting is not accepted, or a file exists already.
    RunError
        If the run could not be finished; its finished blocks are stored for ``resume``.
    """
    place = Path(out)
    record_figures(
        (ids,) if isinstance(ids, str) else tuple(ids),
        place,
        trials=trials,
        quick=quick,
        seed=seed,
        settings=setting_texts(set),
        workers=Workers(job_count(jobs), dask),
        resume=resume,
        force=force,
        formats=_formats(formats, format),
        bar=partial(interactive_bar, quiet=quiet),
    )
    claims: list[dict[str, Any]] = json.loads((place / "claims.json").read_text("utf-8"))["claims"]
    return claims


def _formats(
    formats: str | Sequence[str] | None, format: str | Sequence[str] | None
) -> Sequence[str]:
    """Return the pictures' formats, given under either word."""
    if formats is not None and format is not None:
        raise InputError("formats and format are one; give one of the two")
    asked = format if formats is None else formats
    if asked is None:
        return ("png",)
    return asked.split(",") if isinstance(asked, str) else asked


def record_figures(
    ids: tuple[str, ...],
    out: Path,
    *,
    trials: SupportsIndex | None,
    quick: bool,
    seed: SupportsIndex,
    settings: tuple[str, ...],
    workers: Workers,
    resume: bool,
    force: bool,
    formats: Sequence[str],
    bar: Bar,
) -> list[Finding]:
    """Reproduce figures to their directory, for the command and `reproduce` alike."""
    count, seed = check_count(
        (QUICK_TRIALS if quick else TRIALS) if trials is None else trials, seed
    )
    if count < FEWEST_TRIALS:
        raise InputError(f"trials: {count} is not accepted; expected {FEWEST_TRIALS} or more")
    suffixes = picture_formats([suffix.strip() for suffix in formats])
    task = Reproduction(ids, out, count, seed, suffixes, workers, resume, force, settings)
    with bar("reproduce") as progress:
        return draw_and_judge(task, progress)
