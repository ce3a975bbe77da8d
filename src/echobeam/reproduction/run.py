"""Reproduction of chosen figures to a directory of pictures, data and verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from echobeam.faults import InputError
from echobeam.plots.saving import picture_formats, write
from echobeam.reproduction import mapping
from echobeam.reproduction.catalogue import CLAIMS, choose
from echobeam.reproduction.figures import sensitivity
from echobeam.reproduction.records import Figure, Finding
from echobeam.reproduction.report import write_claims
from echobeam.reproduction.results import Outcome, Results
from echobeam.reproduction.setups import Setup
from echobeam.scenario.load import load_scenario
from echobeam.store.work import Progress
from echobeam.store.workers import HERE, Workers
from echobeam.store.writing import StoreError, clear_leftovers, make_writable
from echobeam.sweeps.points import Point, run_study, study_in

TRIALS, QUICK_TRIALS = 200, 20
"""Number of trials per point, by default and with ``quick``."""

DATA = ("csv", "json")
"""Suffixes of the figures' numbers."""

BLOCKS = "blocks"
CLAIM_FILES = ("claims.json", "claims.md")

_OF_SETUPS = ("name", "description", "schemes", "trials")
"""Keys of a scenario that a setup gives in another way."""


@dataclass(frozen=True, slots=True)
class Reproduction:
    """Figures to reproduce, and their directory.

    Attributes
    ----------
    ids
        Figures' ids; none means all.
    out
        Directory of the pictures, made if necessary, with the finished blocks in ``blocks``.
    trials, seed
        Trials per point, and the seed of all randomness.
    formats
        Suffixes of the pictures; PDF and SVG are for papers and contain no captions.
    workers
        Processes on this machine, or a cluster.
    resume, force
        Continue an interrupted run; replace existing files.
    settings
        Texts ``KEY=VALUE``: keys of every setup that differ from the paper's.
    """

    ids: tuple[str, ...] = ()
    out: Path = Path("reproduction")
    trials: int = TRIALS
    seed: int = 0
    formats: tuple[str, ...] = ("png",)
    workers: Workers = HERE
    resume: bool = False
    force: bool = False
    settings: tuple[str, ...] = ()


def reproduce(task: Reproduction, progress: Progress = lambda done, total: None) -> list[Finding]:
    """Run, draw and judge; return the findings, which are also in ``claims.json``.

    Raises
    ------
    InputError
        If an id is unknown, or a file exists already.
    RunError
        If the run could not be finished; its finished blocks stay on disk.
    """
    figures = choose(task.ids)
    picture_formats(task.formats)
    points = _points(task, figures)
    _check(task, figures)
    results = _run(task, points, progress)
    for path in outputs(task, figures):
        clear_leftovers(path)
    for figure in figures:
        data = figure.data(results)
        for suffix in (*task.formats, *DATA):
            write(data, task.out / f"{figure.id}.{suffix}", captions=suffix == "png")
    chosen = {figure.id for figure in figures}
    findings = [
        Finding(claim, claim.measure(results)) for claim in CLAIMS if claim.figure in chosen
    ]
    mapped = mapping.entries(results) if sensitivity.FIGURE.id in chosen else []
    write_claims(findings, results, task.out, mapped)
    return findings


def outputs(task: Reproduction, figures: Sequence[Figure]) -> list[Path]:
    """Return every file that a reproduction writes, besides its blocks."""
    suffixes = (*task.formats, *DATA)
    names = [f"{figure.id}.{suffix}" for figure in figures for suffix in suffixes]
    return [task.out / name for name in (*names, *CLAIM_FILES)]


def setups_of(figures: Sequence[Figure]) -> list[Setup]:
    """Return the distinct setups of some figures."""
    return list({setup.name: setup for figure in figures for setup in figure.points}.values())


def _check(task: Reproduction, figures: Sequence[Figure]) -> None:
    """Make the directory; refuse to overwrite files without ``force``."""
    make_writable(task.out)
    there = [path for path in outputs(task, figures) if path.exists()]
    if there and not (task.force or task.resume):
        raise StoreError(
            f"{there[0]}: exists already; give another --out, --resume to continue an "
            "earlier run, or --force to start again"
        )


def _points(task: Reproduction, figures: Sequence[Figure]) -> list[Point]:
    """Return the points of some figures with the task's settings.

    Raises
    ------
    InputError
        If a setting is not accepted, or is of a key that a figure itself sets.
    """
    keys = [text.partition("=")[0].strip() for text in task.settings]
    points = []
    for setup in setups_of(figures):
        for key in keys:
            for own in (*_OF_SETUPS, *(name for name, _ in setup.overrides)):
                if f"{own}.".startswith(f"{key}.") or f"{key}.".startswith(f"{own}."):
                    raise InputError(f"--set {key}: the figures set {own}; choose another key")
        point = setup.point(task.trials)
        if task.settings:
            point = replace(point, scenario=load_scenario(point.scenario, task.settings))
        points.append(point)
    return points


def _run(task: Reproduction, points: list[Point], progress: Progress) -> Results:
    if not points:
        return Results([], task.trials, task.seed, task.settings)
    study = study_in(task.out / BLOCKS, points, task.seed)
    run_study(
        study,
        workers=task.workers,
        resume=task.resume,
        force=task.force,
        progress=progress,
    )
    outcomes = [
        Outcome(point, study.statistics_of(index), study.kept(index) if point.keep else {})
        for index, point in enumerate(points)
    ]
    return Results(outcomes, task.trials, task.seed, task.settings)
