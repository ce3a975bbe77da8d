"""Approximation of the evolution model against exact geometry (the paper's approx)."""

from __future__ import annotations

import numpy as np

from echobeam.physics.motion import initial_distance
from echobeam.plots.looks import BLACK, VERMILION, Look
from echobeam.plots.record import Axis, FigureData, Guide, Panel, Series
from echobeam.reproduction.captions import setting
from echobeam.reproduction.records import Figure
from echobeam.reproduction.results import Results
from echobeam.scenario.load import load_scenario
from echobeam.scenario.model import Scenario
from echobeam.tracking.evolution import Evolution, evolve
from echobeam.values import Array

LOOKS = {"exact": Look(BLACK), "paper": Look(VERMILION, "s", (0, (4.0, 1.5)))}
LABELS = {"exact": "exact geometry", "paper": "approximation, Eqs. (30) and (33) corrected"}
QUANTITIES = (("Angle θ", "deg", 180 / np.pi), ("Distance d", "m", 1.0))


def scenario() -> Scenario:
    """Return the paper's level flight."""
    return load_scenario("paper-approximation")


def states(kind: Evolution) -> Array:
    """Return ``(slots + 1, 3)``: the state evolved slot by slot from slot 0, without noise."""
    flight = scenario()
    angle, velocity, _ = flight.objects[0].along_road
    start = [angle, initial_distance(angle, flight.uav.height), velocity]
    path = [np.array(start, dtype=float)]
    for _ in range(flight.n_slots):
        path.append(evolve(path[-1], flight.uav.speed, flight.uav.heading, flight.frame.slot, kind))
    return np.array(path)


def data(results: Results) -> FigureData:
    """Return angle and distance over the slots, and below each the approximation's error."""
    flight = scenario()
    exact, paper = states("exact"), states("paper")
    slots = np.arange(len(exact))
    axis = Axis("Slot", f"{1e3 * flight.frame.slot:g} ms each")
    above, below = [], []
    for column, (name, unit, scale) in enumerate(QUANTITIES):
        curves = tuple(
            Series(LABELS[kind], slots, scale * path[:, column], look=LOOKS[kind])
            for kind, path in (("exact", exact), ("paper", paper))
        )
        above.append(Panel(axis, Axis(name, unit), curves))
        error = scale * (paper - exact)[:, column]
        off = Series(f"error of {name}", slots, error, look=LOOKS["paper"], legend=False)
        below.append(Panel(axis, Axis("Error", unit), (off,), guides=(Guide("y", 0.0),)))
    return FigureData(
        "approx",
        f"The evolution model's approximation, open loop over {flight.n_slots} slots",
        (*above, *below),
        f"{setting(flight, antennas=False)}; the UAV flies level, towards −x",
        layout=((0, 1), (2, 3)),
        heights=(2.0, 1.0),
        size=(7.16, 3.3),
        share="x",
    )


FIGURE = Figure(
    "approx", "the evolution model's approximation against exact geometry", (), data, place=1
)
