"""Motion from files: traces of vehicles from a traffic simulator or a log.

Read `load` first. A file becomes a stream of samples (`source`, with `chunks`, `fcd` and `table`),
split at impossible steps (`breaks`). A first pass surveys it (`survey`, `totals`): it fits the road
(`road`, `outline`) and compares speeds, times and positions (`speeds`, `clock`), so that an
inconsistent trace is refused (`check`, `causes`). A second pass selects the samples of the slots
(`collect`), notes how vehicles stand (`standing`) and corrects the samples (`repair`); `motion`
interpolates them, and `service` chooses the vehicles that are served. `traffic` makes such files
with a traffic simulator.
"""

from echobeam.traces.load import load_motion
from echobeam.traces.road import PLANE, Road, RoadError, road_between
from echobeam.traces.sample import TraceError, TraceWarning
from echobeam.traces.service import TraceMotion

__all__ = [
    "PLANE",
    "Road",
    "RoadError",
    "TraceError",
    "TraceMotion",
    "TraceWarning",
    "load_motion",
    "road_between",
]
