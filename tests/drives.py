"""Traces written for tests: vehicles of known motion, in every format that is read."""

from __future__ import annotations

import gzip
import warnings
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from echobeam.traces import TraceError, TraceWarning, load_motion

INVALID = -1073741824.0
"""SUMO's mark for a value that it does not have."""


@dataclass(frozen=True)
class Row:
    """One row of a trace; texts, so that a test says how numbers are printed."""

    t: str
    id: str
    x: str
    y: str
    speed: str = ""


def drive(name, velocity, n=21, step=0.5, x=-100.0, y=0.0, a=0.0, digits=2):
    """Rows of a car at constant acceleration, with the speeds at the samples' times."""
    return [
        Row(
            f"{k * step:.3f}",
            name,
            f"{x + velocity * k * step + a * (k * step) ** 2 / 2:.{digits}f}",
            f"{y:.{digits}f}",
            f"{velocity + a * k * step:.{digits}f}",
        )
        for k in range(n)
    ]


def with_columns(rows, **change):
    """Rows with columns replaced by a function of their number, or by a text."""
    changed = []
    for row in rows:
        new = {
            column: value if isinstance(value, str) else f"{value(float(getattr(row, column))):.9g}"
            for column, value in change.items()
        }
        changed.append(Row(**(row.__dict__ | new)))
    return changed


def as_csv(rows):
    return "t,id,x,y,speed\n" + "".join(f"{r.t},{r.id},{r.x},{r.y},{r.speed}\n" for r in rows)


def as_xml(rows):
    text = "<fcd-export>\n"
    for time, group in groupby(sorted(rows, key=lambda r: float(r.t)), key=lambda r: r.t):
        text += f'<timestep time="{time}">\n'
        for r in group:
            speed = f' speed="{r.speed}"' if r.speed else ""
            text += f'<vehicle id="{r.id}" x="{r.x}" y="{r.y}"{speed}/>\n'
        text += "</timestep>\n"
    return text + "</fcd-export>\n"


def as_sumo_csv(rows):
    """SUMO's own table: a step without vehicles, and a person among the vehicles."""
    head = "timestep_time;vehicle_id;vehicle_x;vehicle_y;vehicle_angle;vehicle_type;vehicle_speed;"
    text = head + "vehicle_pos;vehicle_lane;vehicle_edge;vehicle_slope\n-1.00;;;;;;;;;;\n"
    for r in sorted(rows, key=lambda r: float(r.t)):
        text += f"{r.t};{r.id};{r.x};{r.y};90.00;car;{r.speed};5.10;r_0;;0.00\n"
    return text + f"{rows[-1].t};walker;1.0;900.0;90.00;DEFAULT_PEDTYPE;1.20;0.00;;r;0.00\n"


def packed(write):
    """The same format, gzip-compressed."""
    return lambda rows: gzip.compress(write(rows).encode())


FORMATS = {"csv": as_csv, "xml": as_xml, "sumo csv": as_sumo_csv, "xml.gz": packed(as_xml)}


@dataclass(frozen=True)
class Read:
    """What was read of a trace."""

    motion: object
    notes: list[str]

    def velocity(self, name):
        """Velocities of a vehicle in the slots in which it is there."""
        motion = self.motion
        return motion.velocity[motion.identity == motion.names.index(name)]

    def times(self, name, slot=0.1):
        """Times of those slots."""
        here = (self.motion.identity == self.motion.names.index(name)).any(axis=1)
        return slot * np.flatnonzero(here)


def read(folder, content, slot=0.1, seconds=10.0, **options):
    """Write a trace and load its motion; every vehicle is served."""
    path = folder / "trace"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        motion = load_motion(
            path,
            slot * np.arange(round(seconds / slot) + 1),
            **({"uav_x": 0.0, "max_objects": 20, "range_m": 1e7} | options),
        )
    ours = [each for each in caught if issubclass(each.category, TraceWarning)]
    assert len(ours) == len(caught)
    return Read(motion, [str(each.message).removeprefix(str(path)) for each in ours])


def refusal(folder, content, **options):
    """The message with which a trace is refused, without the file's name."""
    try:
        read(folder, content, **options)
    except TraceError as error:
        return str(error).removeprefix(str(folder / "trace"))
    raise AssertionError("was read")
