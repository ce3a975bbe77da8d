"""Input of the simulator: nodes and edges of the road, and its vehicles, as SUMO's XML."""

from __future__ import annotations

from collections.abc import Sequence

from echobeam.traces.traffic.plan import CAR, FASTEST, GAP, HEADWAY, SLOWEST, SPREAD, Entry, Plan

_ROADS = ("eastbound", "westbound")
_TOP_SPEED = 100.0
"""Speed that no vehicle's desired speed reaches, m/s."""


def nodes(plan: Plan) -> str:
    """Return the two ends of the road; the middle is at x = 0."""
    half = plan.length / 2
    return (
        "<nodes>\n"
        f'  <node id="west" x="{-half:.3f}" y="0"/>\n'
        f'  <node id="east" x="{half:.3f}" y="0"/>\n'
        "</nodes>\n"
    )


def edges(plan: Plan) -> str:
    """Return the road; its speed limit is the mean desired speed. Drivers keep to the right."""
    ends = (("west", "east"), ("east", "west"))
    lines = [
        f'  <edge id="{name}" from="{begin}" to="{end}" numLanes="{plan.lanes}" '
        f'speed="{plan.speed:.3f}"/>\n'
        for name, (begin, end) in zip(_ROADS[: plan.roads], ends, strict=False)
    ]
    return f"<edges>\n{''.join(lines)}</edges>\n"


def routes(plan: Plan, found: Sequence[Entry]) -> str:
    """Return the vehicles: their type with its distribution of desired speeds, and their entries.

    A vehicle enters at its desired speed, or slower if it would be too close to the one ahead.
    """
    lines = [
        f'  <vType id="car" length="{CAR}" minGap="{GAP}" tau="{HEADWAY}" '
        f'maxSpeed="{_TOP_SPEED}" speedFactor="normc(1,{SPREAD},{SLOWEST},{FASTEST})"/>\n',
        *(f'  <route id="{name}" edges="{name}"/>\n' for name in _ROADS[: plan.roads]),
        *(
            f'  <vehicle id="{one.name}" type="car" route="{_ROADS[one.road]}" '
            f'depart="{one.time / 1e3:.3f}" departLane="{"best" if one.lane is None else one.lane}"'
            f' departPos="{one.position:.3f}" departSpeed="max"/>\n'
            for one in found
        ),
    ]
    return f"<routes>\n{''.join(lines)}</routes>\n"
