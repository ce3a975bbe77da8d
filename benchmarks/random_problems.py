"""Random beam design problems over all that may be asked, each designed, examined, and restarted.

``python benchmarks/random_problems.py [problems] [--planar] [--file LINES] [--against OTHER]``: one
line of JSON per problem is appended to the file; problems that are in it are not solved again. Only
the public interface is called, so that the same file runs under another edition of echobeam
(``--plain`` leaves the restarts out), and ``--against`` compares with the lines that it wrote.
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

import echobeam as eb

SEED = 2027
PROBLEMS = {False: 2000, True: 200}

FEASIBLE = 1e-7
WORSE = 1e-6
LONG = 0.5
FINER = 3
"""Refinement of the lattice on which covers of planar arrays are examined, and (`FINER_EXCESS`) the
excess over the ripple that it may show."""

FINER_EXCESS = 0.05

MOST_SECONDS = 60.0
"""Time for a problem, for editions without a limit."""


def draw(index: int) -> eb.BeamProblem:
    """Return one problem for a linear array; it depends on its index only."""
    rng = np.random.default_rng([SEED, index])
    n_tx = round(np.exp(rng.uniform(np.log(4), np.log(128))))
    count = int(rng.integers(1, 13))
    angles = rng.uniform(5.0, 175.0, count)
    kind = rng.choice(["spread", "close", "mirrored", "identical"], p=[0.55, 0.25, 0.1, 0.1])
    if kind == "close":
        angles = rng.uniform(20.0, 140.0) + np.cumsum(rng.uniform(0.2, 3.0, count))
    elif kind == "mirrored" and count > 1:
        angles[1] = 180.0 - angles[0]
    elif kind == "identical" and count > 1:
        angles[1] = angles[0]
    distances = 10.0 ** rng.uniform(1.3, 2.5, count)
    power = 10.0 ** rng.uniform(-3.0, 6.0)
    alone = np.log2(1.0 + n_tx * power / (count * distances**2))
    asked = rng.random()
    floor = np.zeros(count)
    if asked < 0.25:
        floor = alone * rng.uniform(0.05, 0.6)
    elif asked < 0.35:
        floor = alone * rng.uniform(1.5, 3.0)
    widths = np.where(rng.random(count) < 0.1, 0.0, 10.0 ** rng.uniform(-1.0, np.log10(40), count))
    return eb.BeamProblem(
        angles=np.radians(angles),
        distances=distances,
        coverage_halfwidths=np.radians(widths),
        ripple=np.exp(rng.uniform(np.log(0.01), np.log(n_tx), count)),
        min_rate=floor,
        power=power,
        noise=1.0,
        n_tx=n_tx,
        spacing=rng.uniform(0.3, 1.0),
        axis=str(rng.choice(["vertical", "horizontal"])),
    )


def draw_planar(index: int, polarisations: int = 1) -> eb.BeamProblem:
    """Return one problem for a planar array, 4 x 4 to 8 x 16, with elliptic covers."""
    rng = np.random.default_rng([SEED, 1, index])
    rows, columns = [(4, 4), (4, 8), (8, 4), (8, 8), (8, 16)][int(rng.integers(5))]
    count = int(rng.integers(1, 5))
    radius, turn = np.sqrt(rng.uniform(0.0, 0.8, count)), rng.uniform(0.0, 2.0 * np.pi, count)
    axes = np.radians(np.exp(rng.uniform(np.log(0.5), np.log(10.0), (count, 2))))
    tilt = rng.uniform(0.0, np.pi, count)
    root = np.array([[np.cos(tilt), -np.sin(tilt)], [np.sin(tilt), np.cos(tilt)]]).transpose(
        2, 0, 1
    )
    covers = (root * axes[:, np.newaxis] ** 2) @ root.transpose(0, 2, 1)
    distances = 10.0 ** rng.uniform(1.7, 2.3, count)
    power = 10.0 ** rng.uniform(0.0, 5.0)
    alone = np.log2(1.0 + rows * columns * power / (count * distances**2))
    floor = alone * rng.uniform(0.05, 0.3) if rng.random() < 0.3 else np.zeros(count)
    return eb.BeamProblem(
        angles=np.stack([radius * np.cos(turn), radius * np.sin(turn)], axis=-1),
        distances=distances,
        coverage_halfwidths=0.5 * (covers + covers.transpose(0, 2, 1)),
        ripple=rows * columns * np.exp(rng.uniform(np.log(0.03), np.log(0.5), count)),
        min_rate=floor,
        power=power,
        noise=1.0,
        array=eb.PlanarArray(rows, columns, polarisations=polarisations),
        resolution=0.25 / max(rows, columns),
    )


def restarted(problem: eb.BeamProblem, beams: Any, resolution: float = 0.0) -> eb.BeamProblem:
    """Return a problem with beams to start from, and perhaps another grid."""
    return eb.BeamProblem(
        problem.angles,
        problem.distances,
        problem.coverage_halfwidths,
        problem.ripple,
        problem.min_rate,
        problem.power,
        problem.noise,
        array=problem.array,
        resolution=resolution or problem.resolution,
        warm_start=beams,
    )


def examined(index: int, planar: bool, plain: bool) -> dict[str, Any]:
    """Return what one problem shows."""
    problem = draw_planar(index) if planar else draw(index)
    row: dict[str, Any] = {"index": index, "N": problem.n_tx, "K": problem.n_objects}
    row |= {"P": problem.power, "floors": bool(problem.min_rate.any())}
    try:
        with _limited(MOST_SECONDS):
            begun = time.process_time()
            answer = eb.design_beams(problem)
            row["seconds"] = time.process_time() - begun
    except TimeoutError:
        return row | {"seconds": MOST_SECONDS, "status": "out of time", "objective": 0.0}
    row |= _told(problem, answer)
    if planar:
        return row | _planar(index, problem, answer)
    if not plain:
        row |= _restarts(index, problem, answer)
    return row


def _told(problem: eb.BeamProblem, answer: Any) -> dict[str, Any]:
    missed = answer.max_violation
    least = 1.0
    if problem.min_rate.any():
        asked = problem.min_rate > 0.0
        least = min(1.0, float(np.min(answer.rates[asked] / problem.min_rate[asked])))
    return {
        "status": answer.status,
        "outcome": getattr(answer, "outcome", ""),
        "message": answer.message,
        "objective": answer.objective,
        "floors_met": least,
        "violation": max(missed.power, missed.coverage)
        if answer.status != "optimal"
        else missed.largest,
    }


def _restarts(index: int, problem: eb.BeamProblem, answer: Any) -> dict[str, Any]:
    """Return what is lost from the answer's own beams, and from beams near them."""
    if answer.status != "optimal" or not answer.objective > 0.0:
        return {}
    own = eb.design_beams(restarted(problem, answer.beams))
    rng = np.random.default_rng([SEED, 2, index])
    noise = rng.standard_normal(answer.beams.shape) + 1j * rng.standard_normal(answer.beams.shape)
    size = 0.05 * np.abs(answer.beams).mean(axis=-1, keepdims=True)
    near = eb.design_beams(restarted(problem, answer.beams + size * noise))
    return {
        "lost_own": 1.0 - own.objective / answer.objective,
        "lost_near": 1.0 - near.objective / answer.objective,
    }


def _planar(index: int, problem: eb.BeamProblem, answer: Any) -> dict[str, Any]:
    """Return the excess on a finer lattice, the gap, and what two polarisations reach."""
    from echobeam.beamforming.certify.certificate import violation

    finer = restarted(problem, None, problem.resolution / FINER)
    begun = time.process_time()
    gap = answer.gap
    bound_seconds = time.process_time() - begun
    twice = draw_planar(index, 2)
    begun = time.process_time()
    second = eb.design_beams(twice)
    return {
        "finer": violation(finer, answer.beams).coverage,
        "gap": gap,
        "bound_seconds": bound_seconds,
        "two": second.objective,
        "two_seconds": time.process_time() - begun,
        "two_status": second.status,
        "two_violation": second.max_violation.largest,
        "two_gap": second.gap,
    }


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


def report(rows: list[dict[str, Any]], other: dict[int, dict[str, Any]]) -> str:
    """Return the table, and the problems that miss a target."""
    unnamed = [r for r in rows if r["status"] == "fallback" and not r["message"]]
    outcomes = {s: sum(r["outcome"] == s for r in rows) for s in {r["outcome"] for r in rows}}
    lines = [
        f"{len(rows)} problems: {outcomes}; fallbacks without a message {len(unnamed)}",
        f"largest violation {max(r['violation'] for r in rows):.1e}"
        f" ({sum(r['violation'] > FEASIBLE for r in rows)} above {FEASIBLE:g})",
        _times("CPU seconds", [r["seconds"] for r in rows]),
    ]
    for key, words in (("lost_own", "own answer"), ("lost_near", "beams near it")):
        lost = [r[key] for r in rows if key in r]
        if lost:
            worse = sum(x > WORSE for x in lost)
            lines.append(
                f"restarted from {words}: {worse} of {len(lost)} lose more than {WORSE:g}"
                f" (most {max(lost):.1e}), {sum(x < -WORSE for x in lost)} gain more"
            )
    if "gap" in rows[0]:
        lines += _planar_lines(rows)
    if other:
        lines += _against(rows, other)
    return "\n".join(lines)


def _times(what: str, seconds: list[float]) -> str:
    times = np.quantile(seconds, [0.5, 0.9, 0.99, 1.0])
    return (
        f"{what}: median {times[0]:.4f}, 90 % {times[1]:.3f}, 99 % {times[2]:.3f},"
        f" most {times[3]:.3f}; {sum(s > LONG for s in seconds)} above {LONG:g}"
    )


def _planar_lines(rows: list[dict[str, Any]]) -> list[str]:
    kept = [r for r in rows if r["status"] == "optimal"]
    above = sum(r["finer"] > FINER_EXCESS for r in kept)
    gaps = np.quantile([r["gap"] for r in kept], [0.5, 0.9, 1.0])
    twice = np.quantile([r["two_gap"] for r in kept], [0.5, 0.9, 1.0])
    won = [r["two"] / r["objective"] - 1.0 for r in kept]
    worst = max(r["finer"] for r in kept)
    return [
        f"on a lattice {FINER} times finer {above} of {len(kept)} exceed the ripple by more than"
        f" {FINER_EXCESS:g} of it (most {worst:.3f})",
        f"gap to the bound, one polarisation: median {gaps[0]:.1e}, 90 % {gaps[1]:.1e},"
        f" most {gaps[2]:.1e}; two: {twice[0]:.1e}, {twice[1]:.1e}, {twice[2]:.1e}",
        f"two polarisations win: mean {np.mean(won):.2e}, most {max(won):.2e},"
        f" least {min(won):.1e}; largest violation {max(r['two_violation'] for r in kept):.1e}",
        _times("CPU seconds of bounds", [r["bound_seconds"] for r in rows]),
        _times("CPU seconds, two polarisations", [r["two_seconds"] for r in rows]),
    ]


def _against(rows: list[dict[str, Any]], other: dict[int, dict[str, Any]]) -> list[str]:
    pairs = [(r, other[r["index"]]) for r in rows if r["index"] in other]
    both = [(r, o) for r, o in pairs if r["status"] == o["status"] == "optimal"]
    change = np.array([r["objective"] / max(o["objective"], 1e-300) - 1.0 for r, o in both])
    short = [
        (r, o)
        for r, o in pairs
        if o["status"] != "out of time" and r["floors_met"] < o["floors_met"] - WORSE
    ]
    lines = [
        f"against the other edition, {len(both)} of {len(pairs)} that both solved: "
        f"{int(np.sum(change < -WORSE))} below by more than {WORSE:g}"
        f" (most {max(-change.min(), 0.0):.1e}), {int(np.sum(change > WORSE))} above"
        f" (most {change.max():.1e}); {len(short)} meet a smaller part of the floors",
        _times("CPU seconds of the other", [o["seconds"] for _, o in pairs]),
        f"solved there, not here: {sum(r['status'] != 'optimal' == o['status'] for r, o in pairs)}"
        f"; here, not there: {sum(o['status'] != 'optimal' == r['status'] for r, o in pairs)}",
    ]
    below = [pair for pair, x in zip(both, change, strict=True) if x < -WORSE] + short
    return lines + [
        f"below: #{r['index']} N={r['N']} K={r['K']} P={r['P']:.3g} {r['objective']:.9g}"
        f" ({r['outcome']}) against {o['objective']:.9g}"
        for r, o in below
    ]


def _read(path: Path | None) -> dict[int, dict[str, Any]]:
    if path is None or not path.exists():
        return {}
    return {row["index"]: row for row in map(json.loads, path.read_text().splitlines())}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("problems", type=int, nargs="?")
    parser.add_argument("--planar", action="store_true")
    parser.add_argument("--plain", action="store_true", help="no restarts")
    parser.add_argument("--file", type=Path, default=Path("random_problems.jsonl"))
    parser.add_argument("--against", type=Path)
    options = parser.parse_args()
    rows = _read(options.file)
    indices = range(options.problems or PROBLEMS[options.planar])
    with options.file.open("a") as lines:
        for index in indices:
            if index not in rows:
                rows[index] = examined(index, options.planar, options.plain)
                lines.write(json.dumps(rows[index]) + "\n")
                lines.flush()
    print(report([rows[index] for index in indices], _read(options.against)))


if __name__ == "__main__":
    main()
