"""The evolution model's approximation against exact geometry (the paper's approx)."""

from __future__ import annotations

import numpy as np

from echobeam.physics.motion import initial_distance
from echobeam.plots import style
from echobeam.reproduction import drawing as draw_as
from echobeam.reproduction.records import Figure, Picture
from echobeam.reproduction.results import Results
from echobeam.reproduction.tables import Table
from echobeam.scenario.load import load_scenario
from echobeam.scenario.model import Scenario
from echobeam.tracking.evolution import Evolution, evolve
from echobeam.values import Array

LOOKS = {"exact": style.Look(style.BLACK, "", "-"), "paper": draw_as.LOOKS[0]}
LABELS = {"exact": "exact geometry", "paper": "approximation, Eqs. (30) and (33) corrected"}


def scenario() -> Scenario:
    """Return the paper's level flight."""
    return load_scenario("paper-approximation")


def states(kind: Evolution) -> Array:
    """Return ``(slots + 1, 3)``: the state evolved again and again from slot 0, without noise."""
    setting = scenario()
    angle = setting.objects[0].angle
    start = [angle, initial_distance(angle, setting.uav.height), setting.objects[0].velocity]
    path = [np.array(start, dtype=float)]
    for _ in range(setting.n_slots):
        path.append(
            evolve(path[-1], setting.uav.speed, setting.uav.heading, setting.frame.slot, kind)
        )
    return np.array(path)


def tabulate() -> Table:
    """Return both models' angle and distance, slot by slot."""
    exact, paper = states("exact"), states("paper")
    rows = [
        (n, float(np.degrees(e[0])), float(np.degrees(p[0])), float(e[1]), float(p[1]))
        for n, (e, p) in enumerate(zip(exact, paper, strict=True))
    ]
    columns = ("slot", "angle exact (deg)", "angle approximate (deg)")
    return Table((*columns, "distance exact (m)", "distance approximate (m)"), rows)


@style.styled()
def draw(results: Results) -> Picture:
    """Draw angle and distance over the slots, and below each the approximation's error."""
    setting = scenario()
    exact, paper = states("exact"), states("paper")
    figure = style.new_figure(style.PAGE, 3.6)
    panels = figure.subplots(2, 2, sharex=True, height_ratios=[2, 1])
    slots = np.arange(len(exact))
    quantities = (("Angle θ (deg)", "Error (deg)", 180 / np.pi), ("Distance d (m)", "Error (m)", 1))
    handles = []
    for column, (name, error_name, scale) in enumerate(quantities):
        upper, lower = panels[:, column]
        handles = [
            style.draw_line(upper, slots, scale * path[:, column], LOOKS[kind], LABELS[kind])
            for kind, path in (("exact", exact), ("paper", paper))
        ]
        error = scale * (paper - exact)[:, column]
        style.draw_line(lower, slots, error, LOOKS["paper"], "error")
        lower.axhline(0.0, color="0.5", linewidth=0.8)
        upper.set_ylabel(name)
        lower.set_ylabel(error_name)
        lower.set_xlabel(f"Slot ({1e3 * setting.frame.slot:g} ms each)")
    draw_as.titled(
        figure,
        f"The evolution model's approximation, open loop over {setting.n_slots} slots",
        f"{draw_as.flight(setting, antennas=False)} (level, towards −x); "
        f"{draw_as.objects(setting)}",
    )
    style.add_legend(figure, handles)
    return Picture(figure, tabulate())


FIGURE = Figure("approx", "the evolution model's approximation against exact geometry", (), draw)
