"""Largest gains under elliptic covers of planar arrays: one beam, two polarisations, any rank:
``python benchmarks/planar_shapes.py``. CPU ms of a whole examined decision, best of 5."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

import echobeam as eb
from echobeam.beamforming.relaxation.model import build_model
from echobeam.beamforming.relaxation.shape import best_shape

CASES = (
    (8, 8, 1.0, 0.7, 0.0, 0.1),
    (8, 8, 2.0, 1.4, 0.5, 0.1),
    (8, 8, 4.0, 2.8, 0.0, 0.1),
    (8, 8, 4.0, 2.8, 0.0, 0.3),
    (16, 4, 3.0, 2.1, 0.5, 0.1),
)
"""Rows, columns, standard deviations of u and v in hundredths of pi / 1.8 ("degrees"), their
correlation, and the ripple as a part of N. Ellipses are three standard deviations wide."""

RESOLUTION = np.radians(1.35)
REPEATS = 5


def problem(
    rows: int, columns: int, first: float, second: float, correlation: float, ripple: float, r: int
) -> eb.BeamProblem:
    """Return one object under an ellipse; its rate is log2(1 + gain)."""
    s, t = np.radians([first, second])
    cover = 9.0 * np.array([[s * s, correlation * s * t], [correlation * s * t, t * t]])
    array = eb.PlanarArray(rows, columns, polarisations=r)
    return eb.BeamProblem(
        [[0.1, -0.2]],
        [1.0],
        [cover],
        ripple * array.elements,
        0.0,
        1.0,
        1.0,
        array=array,
        resolution=RESOLUTION,
    )


def timed(stated: eb.BeamProblem) -> tuple[float, float, float]:
    """Return gain, ms, and the largest violation."""
    best = np.inf
    for _ in range(REPEATS):
        begun = time.process_time()
        answer = eb.design_beams(stated)
        best = min(best, time.process_time() - begun)
    return 2.0**answer.objective - 1.0, 1e3 * best, answer.max_violation.largest


def pair(warm: Any = None) -> eb.BeamProblem:
    """Return two objects under ellipses of one degree."""
    cover = 9.0 * np.diag(np.radians([1.0, 0.7]) ** 2)
    return eb.BeamProblem(
        [[0.1, -0.2], [-0.4, 0.3]],
        [103.5, 141.4],
        [cover, cover],
        6.4,
        0.0,
        1e4,
        1.0,
        array=eb.PlanarArray(8, 8),
        resolution=0.02,
        warm_start=warm,
    )


def main() -> None:
    print("| Array; standard deviations; ripple | Any rank | One beam | Loss | ms "
          "| Two polarisations | Loss | ms | Violation |")  # fmt: skip
    print("|---|---|---|---|---|---|---|---|---|")
    for rows, columns, first, second, correlation, ripple in CASES:
        one, two = (problem(rows, columns, first, second, correlation, ripple, r) for r in (1, 2))
        bound = best_shape(build_model(one).beams[0]).bound
        gain, ms, missed = timed(one)
        gain_two, ms_two, missed_two = timed(two)
        tilt = f", correlation {correlation}" if correlation else ""
        print(
            f"| {rows} x {columns}; {first:g}° x {second:g}°{tilt}; {ripple:g} N | {bound:.4f} "
            f"| {gain:.4f} | {1.0 - gain / bound:.1e} | {ms:.1f} "
            f"| {gain_two:.4f} | {1.0 - gain_two / bound:.1e} | {ms_two:.1f} "
            f"| {max(missed, missed_two):.1e} |"
        )
    beams = eb.design_beams(pair()).beams
    cold, warm = timed(pair()), timed(pair(beams))
    print(
        f"8 x 8, two objects under 1 degree: {cold[1]:.1f} ms cold, {warm[1]:.1f} warm; "
        f"violation {max(cold[2], warm[2]):.1e}"
    )


if __name__ == "__main__":
    main()
