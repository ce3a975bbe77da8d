"""The benchmark's figures: a record per case and method, and a table to read."""

from __future__ import annotations

import math
import os
import platform
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from echobeam.benchmarking.cases import GROWTH
from echobeam.benchmarking.measure import CaseResult, Timed
from echobeam.values import Array
from echobeam.version import __version__

YARDSTICKS = ("cvxpy-scs", "cvxpy-clarabel", "sdp")
"""What times are compared with: the first of these that was run."""


@dataclass(frozen=True, slots=True)
class Record:
    """One case and method; what is not a number is None.

    Attributes
    ----------
    case, method
        Names.
    n_tx, objects
        N and K.
    seconds_median, seconds_p99
        Per problem, over the problems.
    objective
        bit/s/Hz: mean over the problems that every method of the case was given.
    violation
        Largest relative violation of any constraint on the full grid; of a stated fallback that
        of power and coverage.
    gap
        Largest relative certified gap, None where nothing was proved.
    """

    case: str
    method: str
    n_tx: int
    objects: int
    seconds_median: float
    seconds_p99: float
    objective: float | None
    violation: float | None
    gap: float | None


def records(results: Sequence[CaseResult]) -> list[Record]:
    """Return a record per case and method, in the order in which they were run."""
    return [_record(result, index) for result in results for index in range(len(result.timed))]


def documents(results: Sequence[CaseResult]) -> list[dict[str, object]]:
    """Return the records as strict JSON knows them."""
    return [{name: getattr(each, name) for name in Record.__slots__} for each in records(results)]


def _record(result: CaseResult, index: int) -> Record:
    timed, judged = result.timed[index], result.judged[index]
    proved = judged.gap[np.isfinite(judged.gap)]
    return Record(
        case=result.case.name,
        method=timed.method,
        n_tx=result.n_tx,
        objects=result.objects,
        seconds_median=float(np.median(timed.seconds)),
        seconds_p99=float(np.quantile(timed.seconds, 0.99)),
        objective=_number(float(np.mean(judged.objective[: result.common]))),
        violation=_number(float(np.max(judged.violation))),
        gap=float(np.max(proved)) if proved.size else None,
    )


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None


def header(repeat: int) -> str:
    """Return what was run where."""
    threads = os.environ.get("OPENBLAS_NUM_THREADS") or "all"
    return (
        f"echobeam {__version__} on {processor()}, {os.cpu_count()} cores, "
        f"Python {platform.python_version()}, NumPy {np.__version__}\n"
        f"BLAS threads: {threads}; median of {repeat} timed calls per problem after a warm-up; "
        f"times in ms per design; load of the machine at the end {_load()}"
    )


def _load() -> str:
    """Return the number of processes that wanted a core in the last minute."""
    return f"{os.getloadavg()[0]:.1f}" if hasattr(os, "getloadavg") else "unknown"


def processor() -> str:
    """Return the processor's name as the system gives it."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError):
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


COLUMNS = (
    "method",
    "problems",
    "median",
    "p99",
    "ratio",
    "objective",
    "below sdp",
    "violation",
    "gap",
)


def table(results: Sequence[CaseResult]) -> str:
    """Return all cases as tables, what was left out, and how times grow with K."""
    blocks = [_case_table(result) for result in results]
    grown = growth(results)
    if grown:
        blocks.append("\n".join(["growth of the median time from K to K, N = 64", *grown]))
    return "\n\n".join(blocks)


def _case_table(result: CaseResult) -> str:
    yardstick = next((name for name in YARDSTICKS if _named(result, name) is not None), None)
    ratio = f"x {yardstick}" if yardstick else "ratio"
    rows = [[ratio if column == "ratio" else column for column in COLUMNS]]
    rows += [_row(result, index, yardstick) for index in range(len(result.timed))]
    notes = [
        f"  {each.method}: floors not met, fallback beams, for {int(each.fallback.sum())} of "
        f"{each.fallback.size}"
        for each in result.timed
        if each.fallback.any()
    ]
    notes += [f"  {name} left out: {why}" for name, why in result.skipped.items()]
    title = f"{result.case.name}: {result.case.words}"
    return "\n".join([title, *_aligned(rows), *notes])


def _row(result: CaseResult, index: int, yardstick: str | None) -> list[str]:
    record, timed = _record(result, index), result.timed[index]
    return [
        timed.method,
        str(timed.seconds.size),
        f"{1e3 * record.seconds_median:.3g}",
        f"{1e3 * record.seconds_p99:.3g}",
        _faster(result, timed, yardstick),
        "-" if record.objective is None else f"{record.objective:.7g}",
        _below(result, index),
        _small(record.violation),
        _small(record.gap),
    ]


def _faster(result: CaseResult, timed: Timed, yardstick: str | None) -> str:
    """Return how many times faster than the yardstick a method is, on the problems of both."""
    slow = _named(result, yardstick)
    if slow is None:
        return "-"
    count = min(timed.seconds.size, result.timed[slow].seconds.size)
    ratio = np.median(result.timed[slow].seconds[:count]) / np.median(timed.seconds[:count])
    return f"{ratio:.3g}"


def shortfall(result: CaseResult, index: int) -> float | None:
    """Return the largest relative amount by which a method's objective lies below sdp's.

    On the problems of both; negative where it is above it in all. None without sdp.
    """
    sdp = _named(result, "sdp")
    if sdp is None:
        return None
    theirs, ours = result.judged[sdp].objective, result.judged[index].objective
    count = min(theirs.size, ours.size)
    return _number(float(np.max(1.0 - ours[:count] / theirs[:count])))


def _below(result: CaseResult, index: int) -> str:
    value = shortfall(result, index)
    return "-" if value is None else f"{value:.1e}"


def _small(value: float | None) -> str:
    return "-" if value is None else f"{value:.1e}"


def _named(result: CaseResult, name: str | None) -> int | None:
    names = [timed.method for timed in result.timed]
    return names.index(name) if name in names else None


def growth(results: Sequence[CaseResult]) -> list[str]:
    """Return per method the exponent p of K^p between the least and the largest growth case."""
    lines = []
    cases = {result.objects: result for result in results if result.case.name.startswith("growth-")}
    few, many = min(cases, default=0), max(cases, default=0)
    if few == many or not set(cases) <= set(GROWTH):
        return []
    for timed in cases[few].timed:
        other = _named(cases[many], timed.method)
        if other is not None:
            power = _exponent(timed.seconds, cases[many].timed[other].seconds, many / few)
            lines.append(f"  {timed.method}: K^{power:.2f} from {few} to {many}")
    return lines


def _exponent(before: Array, after: Array, factor: float) -> float:
    return float(np.log(np.median(after) / np.median(before)) / np.log(factor))


def _aligned(rows: list[list[str]]) -> list[str]:
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = [
        "  ".join(
            cell.ljust(width) if column == 0 else cell.rjust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        )
        for row in rows
    ]
    return [f"  {line}" for line in [lines[0], "-" * len(lines[0]), *lines[1:]]]
