"""The clock: every method on the same problems, one after the other, with a warm-up before."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from echobeam.benchmarking.cases import Case
from echobeam.benchmarking.judgement import Judged, bounds_of, judge
from echobeam.benchmarking.methods import Method
from echobeam.benchmarking.problems import CaseProblems, on_the_road
from echobeam.values import Array, BoolArray, ComplexArray, IntArray

BUDGET = 2.0
"""s: about what one method may take for one case; it gets fewer problems if they are slow. A method
that takes many together gets more of them until a call takes so long."""

PREPARING = 15.0
"""s: about what the slot before may take to design; so many problems get a warm start."""

PROBE, GROWTH = 4, 4
"""Problems of the first call of a method that takes many together, and by what calls grow while
they can be afforded: a small batch costs more per problem."""


@dataclass(frozen=True, slots=True, eq=False)
class Timed:
    """What one method did with the first problems of a case.

    Attributes
    ----------
    method
        Its name.
    seconds
        ``(P,)`` per problem: median over the repeats; problems of one call share its time evenly.
    beams
        P times ``(K, n_tx)``, or None where it failed.
    fallback
        ``(P,)``: the beams are a stated fallback.
    """

    method: str
    seconds: Array
    beams: list[ComplexArray | None]
    fallback: BoolArray


@dataclass(frozen=True, slots=True, eq=False)
class CaseResult:
    """What all methods did with one case.

    Attributes
    ----------
    case
        What was run.
    n_tx, objects
        N and K.
    timed, judged
        One of each per method.
    skipped
        Why a method was left out, by its name.
    """

    case: Case
    n_tx: int
    objects: int
    timed: list[Timed]
    judged: list[Judged]
    skipped: dict[str, str]

    @property
    def common(self) -> int:
        """Number of problems, counted from the first, that every method was given."""
        return min((each.seconds.size for each in self.timed), default=0)


def run_case(
    case: Case, methods: Sequence[Method], repeat: int, asked: Sequence[str] = ()
) -> CaseResult:
    """Time and judge methods on the same problems.

    Parameters
    ----------
    case, methods
        What to run.
    repeat
        Calls that are timed per problem, at least one.
    asked
        Methods named by the user: they are run whatever the size of the problems.
    """
    problems = case.make()
    if any(method.warm for method in methods):
        problems = problems.with_warm_start(PREPARING)
    skipped: dict[str, str] = {}
    timed = []
    for method in methods:
        why = _why_not(method, problems, method.name in asked)
        if why:
            skipped[method.name] = why
        else:
            timed.append(time_method(method, problems, repeat))
    bounds = bounds_of(problems.batch, max((each.seconds.size for each in timed), default=0))
    judged = [judge(problems.batch, each.beams, each.fallback, bounds) for each in timed]
    return CaseResult(
        case, problems.batch.n_tx, problems.batch.active.shape[1], timed, judged, skipped
    )


def time_method(method: Method, problems: CaseProblems, repeat: int) -> Timed:
    """Return one method's times over as many of a case's problems as it can be given.

    If the first call takes longer than the budget, it is the only one, whatever ``repeat`` says.
    """
    _load(method)
    total = min(len(problems.batch), method.most)
    if method.warm and problems.warm_start is not None:
        total = min(total, len(problems.warm_start))
    size = min(total, PROBE if method.together > 1 else 1)
    first = _timed(method, problems, np.arange(size), 1)
    if _spent(first) > BUDGET:
        return first
    if method.together == 1:
        count = int(np.clip(BUDGET / (repeat * _spent(first)), 1, total))
        return _joined(
            [_timed(method, problems, np.array([trial]), repeat) for trial in range(count)]
        )
    while size < total and _spent(first) < BUDGET:
        size = min(total, method.together, GROWTH * size)
        first = _timed(method, problems, np.arange(size), 1)
    return _timed(method, problems, np.arange(size), repeat)


def _spent(timed: Timed) -> float:
    """Return the seconds that one call for all these problems takes."""
    return float(np.sum(timed.seconds))


def _why_not(method: Method, problems: CaseProblems, asked: bool) -> str:
    """Return why a method is left out of a case, nothing if it is not."""
    missing = method.requires()
    if missing:
        return f"{missing} is not installed (pip install {missing})"
    if method.warm and not problems.has_warm_start:
        return "there is no slot before to start from"
    if not asked and not method.suits(problems.batch):
        return f"takes minutes here; --method {method.name} runs it"
    return ""


def _timed(method: Method, problems: CaseProblems, trials: IntArray, repeat: int) -> Timed:
    batch = problems.warm(trials) if method.warm else problems.cold(trials)
    call = method.prepare(batch)
    seconds = []
    for _ in range(repeat):
        begun = time.perf_counter()
        designed = call()
        seconds.append(time.perf_counter() - begun)
    each = np.full(trials.size, np.median(seconds) / trials.size)
    return Timed(method.name, each, designed.beams, designed.fallback)


def _joined(parts: list[Timed]) -> Timed:
    return Timed(
        method=parts[0].method,
        seconds=np.concatenate([part.seconds for part in parts]),
        beams=[beams for part in parts for beams in part.beams],
        fallback=np.concatenate([part.fallback for part in parts]),
    )


def _load(method: Method) -> None:
    """Let a method import what it needs, on a problem that takes no time."""
    tiny = on_the_road(4, 1, 1.0)
    method.prepare(tiny.cold(np.arange(1)))()


Progress = Callable[[int, int], None]


def run_cases(
    cases: Sequence[Case],
    methods: Sequence[Method],
    repeat: int,
    asked: Sequence[str] = (),
    progress: Progress = lambda done, total: None,
) -> list[CaseResult]:
    """Run cases one after the other; see `run_case`."""
    results = []
    for done, case in enumerate(cases):
        progress(done, len(cases))
        results.append(run_case(case, methods, repeat, asked))
    progress(len(cases), len(cases))
    return results
