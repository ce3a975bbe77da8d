"""Random beam design problems, each designed, examined and compared with the reduced relaxation.

``python benchmarks/random_problems.py [problems] [--file LINES]``: one line of
JSON per problem is appended to the file; problems that are in it are not solved again.
"""

from __future__ import annotations

import argparse
import json
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from echobeam.beamforming.certify.certificate import violation
from echobeam.beamforming.design import design_beams
from echobeam.beamforming.fast import batch_of, solve_examined
from echobeam.beamforming.problem import BeamProblem

SEED = 2026
PROBLEMS = 2000

CLOSE = 0.25
"""Part of the problems whose objects lie 2 to 6 degrees apart."""

FLOORS, OUT_OF_REACH = 0.25, 0.15
"""Parts of the problems with floors that are a part of, and a multiple of, what is reachable."""

FEASIBLE = 1e-6
WORSE = 1e-5

MOST_OBJECTS, MOST_SIZE = 4, 192
"""The relaxation is solved up to so many objects, and up to this K N."""


def draw(index: int) -> BeamProblem:
    """Return one problem; it depends on its index only."""
    rng = np.random.default_rng([SEED, index])
    n_tx = round(np.exp(rng.uniform(np.log(8), np.log(128))))
    count = int(rng.integers(1, min(8, n_tx // 2) + 1))
    if rng.random() < CLOSE:
        apart = np.cumsum(rng.uniform(2.0, 6.0, count))
        angles = rng.uniform(20.0, 160.0 - apart[-1]) + apart
    else:
        angles = rng.uniform(20.0, 160.0, count)
    distances = rng.uniform(100.0, 200.0, count)
    power = 10.0 ** rng.uniform(0.0, 5.0)
    alone = np.log2(1.0 + n_tx * power / (count * distances**2))
    asked = rng.random()
    if asked < FLOORS:
        floor = alone * rng.uniform(0.05, 0.6)
    elif asked < FLOORS + OUT_OF_REACH:
        floor = alone * rng.uniform(1.5, 3.0)
    else:
        floor = np.zeros(count)
    return BeamProblem(
        angles=np.radians(angles),
        distances=distances,
        coverage_halfwidths=np.radians(3.0 * 10.0 ** rng.uniform(-1.0, np.log10(3.0), count)),
        ripple=np.full(count, np.exp(rng.uniform(np.log(0.5), np.log(n_tx / 2)))),
        min_rate=floor,
        power=power,
        noise=1.0,
        n_tx=n_tx,
    )


def examined(index: int, sdp_seconds: float) -> dict[str, Any]:
    """Return what one problem shows."""
    problem = draw(index)
    begun = time.process_time()
    found, good = solve_examined(batch_of(problem))
    direct = time.process_time() - begun
    begun = time.process_time()
    answer = design_beams(problem)
    seconds = time.process_time() - begun
    row = {
        "index": index,
        **_parameters(problem),
        "status": answer.status,
        "message": answer.message,
        "objective": answer.objective,
        "violation": _kept(problem, answer),
        "seconds": seconds,
        "direct": bool(good[0]),
        "direct_seconds": direct,
        "direct_objective": float(found.objective[0]),
        "factor": float(found.floor_factor[0]),
        "sdp": None,
    }
    affordable = problem.n_objects <= MOST_OBJECTS
    affordable &= problem.n_objects * problem.n_tx <= MOST_SIZE
    if affordable and sdp_seconds > 0.0:
        row |= _relaxed(problem, sdp_seconds)
    return row


def _parameters(problem: BeamProblem) -> dict[str, Any]:
    return {
        "N": problem.n_tx,
        "K": problem.n_objects,
        "P": problem.power,
        "B": float(problem.ripple[0]),
        "angles": np.degrees(problem.angles).round(3).tolist(),
        "halfwidths": np.degrees(problem.coverage_halfwidths).round(3).tolist(),
        "floors": problem.min_rate.tolist(),
    }


def _kept(problem: BeamProblem, answer: Any) -> float:
    """Return the largest violation; where floors are out of reach, of the other constraints."""
    missed = violation(problem, answer.beams)
    return missed.largest if answer.status == "optimal" else max(missed.power, missed.coverage)


def _relaxed(problem: BeamProblem, seconds: float) -> dict[str, Any]:
    begun = time.process_time()
    try:
        with _limited(seconds):
            answer = design_beams(problem, method="sdp")
    except TimeoutError:
        return {"sdp": None, "sdp_status": "out of time", "sdp_seconds": seconds}
    return {
        "sdp": answer.objective,
        "sdp_status": answer.status,
        "sdp_violation": _kept(problem, answer),
        "sdp_least_rate": _least_part(problem, answer.rates),
        "sdp_seconds": time.process_time() - begun,
    }


def _least_part(problem: BeamProblem, rates: Any) -> float:
    asked = problem.min_rate > 0.0
    return float(np.min(rates[asked] / problem.min_rate[asked], initial=1.0))


@contextmanager
def _limited(seconds: float) -> Iterator[None]:
    """Raise `TimeoutError` in what runs longer."""

    def stop(*_: object) -> None:
        raise TimeoutError

    previous = signal.signal(signal.SIGALRM, stop)
    signal.setitimer(signal.ITIMER_REAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)
        signal.signal(signal.SIGALRM, previous)


def report(rows: list[dict[str, Any]]) -> str:
    """Return the table, and the problems that miss a target."""
    unnamed = [r for r in rows if r["status"] != "optimal" and not named(r["message"])]
    worst = max(r["violation"] for r in rows)
    compared = [r for r in rows if r["sdp"] is not None and comparable(r)]
    below = [r for r in compared if loss(r) > WORSE]
    times = np.quantile([r["seconds"] for r in rows], [0.5, 0.9, 0.99, 1.0])
    statuses = {s: sum(r["status"] == s for r in rows) for s in ("optimal", "fallback")}
    lines = [
        f"{len(rows)} problems: {statuses}; {sum(not r['direct'] for r in rows)} by the relaxation",
        f"unsolved without a name    {len(unnamed)}",
        f"largest violation          {worst:.1e}"
        f"  ({sum(r['violation'] > FEASIBLE for r in rows)} above {FEASIBLE:g})",
        f"below the relaxation by more than {WORSE:g}: {len(below)} of {len(compared)} compared"
        f" (largest {max((loss(r) for r in compared), default=0.0):.1e})",
        f"CPU seconds: median {times[0]:.3f}, 90 % {times[1]:.3f}, 99 % {times[2]:.3f},"
        f" most {times[3]:.3f}",
    ]
    lines += [f"unnamed: {_described(r)} {r['message']}" for r in unnamed]
    lines += [f"violation {r['violation']:.1e}: {_described(r)}" for r in rows
              if r["violation"] > FEASIBLE]  # fmt: skip
    lines += [f"below by {loss(r):.1e}: {_described(r)}" for r in below]
    lines += [f"left to the relaxation: {_described(r)}" for r in rows if not r["direct"]]
    return "\n".join(lines)


def named(message: str) -> bool:
    """Tell whether a message says which object is at fault."""
    return "object" in message


def comparable(row: dict[str, Any]) -> bool:
    """Tell whether the relaxation's answer keeps what the fast one keeps."""
    return row["sdp_status"] == "optimal" and row["sdp_violation"] <= FEASIBLE


def loss(row: dict[str, Any]) -> float:
    """Return by how much a row's objective lies below the relaxation's, relative."""
    if row["status"] != "optimal":
        return 1.0
    return 1.0 - row["objective"] / row["sdp"]


def _described(row: dict[str, Any]) -> str:
    floors = ", floors" if max(row["floors"]) > 0.0 else ""
    return (
        f"#{row['index']} N={row['N']} K={row['K']} P_T={row['P']:.3g} B={row['B']:.3g}"
        f" angles {row['angles']} half-widths {row['halfwidths']}{floors}"
        f" ({row['status']}, {row['seconds']:.2f} s)"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("problems", type=int, nargs="?", default=PROBLEMS)
    parser.add_argument("--file", type=Path, default=Path("random_problems.jsonl"))
    parser.add_argument("--sdp", type=float, default=20.0, help="seconds for the relaxation")
    options = parser.parse_args()
    rows = {}
    if options.file.exists():
        rows = {r["index"]: r for r in map(json.loads, options.file.read_text().splitlines())}
    with options.file.open("a") as lines:
        for index in range(options.problems):
            if index not in rows:
                rows[index] = examined(index, options.sdp)
                lines.write(json.dumps(rows[index]) + "\n")
                lines.flush()
    print(report([rows[index] for index in range(options.problems)]))


if __name__ == "__main__":
    main()
