"""Motion from files: what a traffic simulator or a log says that vehicles did.

A file becomes a stream of samples (`source`, over `fcd` and `table`); a first pass surveys it and
fits the road (`survey`, `road`), a second keeps what matters (`collect`); `motion` makes smooth
motion of the samples, and `service` chooses the vehicles that are served.
"""

from echobeam.traces.load import load_motion
from echobeam.traces.road import Road, RoadError, road_between
from echobeam.traces.sample import TraceError
from echobeam.traces.service import TraceMotion

__all__ = ["Road", "RoadError", "TraceError", "TraceMotion", "load_motion", "road_between"]
