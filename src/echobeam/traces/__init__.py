"""Motion from files: what a traffic simulator or a log says that vehicles did.

A file becomes a stream of samples (`source`, over `chunks`, `fcd` and `table`), cut where no
vehicle can have gone (`breaks`). A first pass surveys it (`survey`, `totals`): it fits the road
(`road`, `outline`), and compares speeds, times and positions (`speeds`, `clock`), so that a trace
that contradicts itself is refused (`check`, `causes`). A second pass keeps what matters
(`collect`), which `repair` makes fit for motion; `motion` makes smooth motion of it, and `service`
chooses the vehicles that are served. `load` does all this.
"""

from echobeam.traces.load import load_motion
from echobeam.traces.road import Road, RoadError, road_between
from echobeam.traces.sample import TraceError, TraceWarning
from echobeam.traces.service import TraceMotion

__all__ = [
    "Road",
    "RoadError",
    "TraceError",
    "TraceMotion",
    "TraceWarning",
    "load_motion",
    "road_between",
]
