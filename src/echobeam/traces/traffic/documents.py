"""Input of the simulator: nodes and edges of the road, and its vehicles, as SUMO's XML."""

from __future__ import annotations

from collections.abc import Sequence

from echobeam.traces.traffic.plan import (
    CAR,
    FASTEST,
    GAP,
    HEADWAY,
    SLOWEST,
    SPREAD,
    TURNS,
    Entry,
    Plan,
)

_ROADS = ("eastbound", "westbound", "northbound", "southbound")
_ENDS = (("west", "east"), ("east", "west"), ("south", "north"), ("north", "south"))
"""Directions of travel, and where each begins and ends."""

_TO = ((3, 0, 2), (2, 1, 3), (0, 2, 1), (1, 3, 0))
"""Direction after an intersection, by that before it and the turn of `TURNS`."""

_TOP_SPEED = 100.0
"""Speed that no vehicle's desired speed reaches, m/s."""


def nodes(plan: Plan) -> str:
    """Return the ends of the roads; the middle is at x = 0, with lights where two roads cross."""
    half = plan.length / 2
    if plan.kind == "intersection":
        places = {"west": (-half, 0.0), "east": (half, 0.0), "south": (0.0, -half)}
        places |= {"north": (0.0, half), "middle": (0.0, 0.0)}
        lights = {"middle": ' type="traffic_light"'}
        lines = [
            f'  <node id="{name}" x="{x:.3f}" y="{y:.3f}"{lights.get(name, "")}/>\n'
            for name, (x, y) in places.items()
        ]
        return f"<nodes>\n{''.join(lines)}</nodes>\n"
    return (
        "<nodes>\n"
        f'  <node id="west" x="{-half:.3f}" y="0"/>\n'
        f'  <node id="east" x="{half:.3f}" y="0"/>\n'
        "</nodes>\n"
    )


def edges(plan: Plan) -> str:
    """Return the roads; their speed limit is the mean desired speed. Drivers keep to the right."""
    found = dict(zip(_ROADS[: plan.roads], _ENDS, strict=False))
    if plan.kind == "intersection":
        into = {name: (begin, "middle") for name, (begin, _) in found.items()}
        found = into | {f"{name}-on": ("middle", end) for name, (_, end) in found.items()}
    lines = [
        f'  <edge id="{name}" from="{begin}" to="{end}" numLanes="{plan.lanes}" '
        f'speed="{plan.speed:.3f}"/>\n'
        for name, (begin, end) in found.items()
    ]
    return f"<edges>\n{''.join(lines)}</edges>\n"


def routes(plan: Plan, found: Sequence[Entry]) -> str:
    """Return the vehicles: their type with its distribution of desired speeds, and their entries.

    A vehicle enters at its desired speed, or slower if it would be too close to the one ahead.
    """
    lines = [
        f'  <vType id="car" length="{CAR}" minGap="{GAP}" tau="{HEADWAY}" '
        f'maxSpeed="{_TOP_SPEED}" speedFactor="normc(1,{SPREAD},{SLOWEST},{FASTEST})"/>\n',
        *(f'  <route id="{name}" edges="{way}"/>\n' for name, way in _routes(plan).items()),
        *(
            f'  <vehicle id="{one.name}" type="car" route="{_route(plan, one)}" '
            f'depart="{one.time / 1e3:.3f}" departLane="{"best" if one.lane is None else one.lane}"'
            f' departPos="{one.position:.3f}" departSpeed="max"/>\n'
            for one in found
        ),
    ]
    return f"<routes>\n{''.join(lines)}</routes>\n"


def _routes(plan: Plan) -> dict[str, str]:
    """Return the edges of each route by its name."""
    if plan.kind == "road":
        return {name: name for name in _ROADS[: plan.roads]}
    return {
        f"{name}-{turn}": f"{name} {_ROADS[after]}-on"
        for name, ways in zip(_ROADS, _TO, strict=True)
        for turn, after in zip(TURNS, ways, strict=True)
    }


def _route(plan: Plan, entry: Entry) -> str:
    """Return the name of a vehicle's route."""
    name = _ROADS[entry.road]
    return name if plan.kind == "road" else f"{name}-{TURNS[entry.turn]}"
