"""Progress of the reading of long traces."""

from contextlib import contextmanager

import numpy as np
import pytest

from echobeam.traces import TraceError, load_motion
from echobeam.traces.progress import LONG, reading_shown, watched


@pytest.fixture
def long_trace(tmp_path):
    path = tmp_path / "long.csv"
    with path.open("w") as file:
        file.write("t,id,x,y,speed,comment\n")
        for k in range(3 * LONG // 200):
            file.write(f"{k / 2},a,{10 * k},0,20,{'.' * 180}\n")
    assert path.stat().st_size > LONG
    return path


def load(path):
    return load_motion(path, np.arange(5.0), uav_x=0.0, max_objects=1, range_m=100.0)


@pytest.mark.slow
def test_a_long_trace_shows_how_much_of_both_readings_is_done(long_trace):
    shown = []
    with watched(lambda done, total: shown.append((done, total))):
        load(long_trace)
    done, total = np.array(shown).T
    assert (total == 2 * long_trace.stat().st_size).all()
    assert (np.diff(done) > 0).all()
    assert done[0] < 0.1 * total[0]
    assert done[-1] == total[-1]
    before = len(shown)
    load(long_trace)
    assert len(shown) == before


def test_a_short_trace_shows_nothing(tmp_path):
    path = tmp_path / "short.csv"
    path.write_text("t,id,x,y\n" + "".join(f"{t},a,{20 * t},0\n" for t in range(5)))
    shown = []
    with watched(lambda done, total: shown.append(done)):
        load(path)
    assert shown == []


class Bars:
    """Bars as the command line has them: how often they were opened, closed and moved."""

    def __init__(self):
        self.events = []

    @contextmanager
    def __call__(self, label):
        self.events.append(label)
        try:
            yield lambda done, total: self.events.append(done / total)
        finally:
            self.events.append("closed")


def test_the_bar_of_the_reading_ends_with_the_reading(long_trace):
    bars = Bars()
    with reading_shown(bars):
        load(long_trace)
        assert bars.events[0] == "reading the trace"
        assert bars.events[-2:] == [1.0, "closed"]
    assert bars.events.count("closed") == 1


def test_a_fault_closes_the_bar(long_trace):
    with long_trace.open("a") as file:
        file.write("damaged\n")
    bars = Bars()
    with pytest.raises(TraceError, match="1 fields"), reading_shown(bars):
        load(long_trace)
    assert bars.events[-1] == "closed"


def test_a_short_trace_opens_no_bar(tmp_path):
    path = tmp_path / "short.csv"
    path.write_text("t,id,x,y\n" + "".join(f"{t},a,{20 * t},0\n" for t in range(5)))
    bars = Bars()
    with reading_shown(bars):
        load(path)
    assert bars.events == []
