"""What holds for every trace."""

import csv
import gzip
import io
import math
import tempfile
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echobeam.traces import TraceError, load_motion
from echobeam.traces.collect import RoadSamples
from echobeam.traces.motion import Sightings, sight
from echobeam.traces.service import serve
from echobeam.traces.source import read_samples

from .. import drives

pytestmark = pytest.mark.slow  # the quick selection stays under a minute

metres = st.floats(-1e6, 1e6)
speeds = st.floats(0, 100)
# XML cannot hold control characters, and spaces at the ends of an id do not count in CSV.
names = st.text(
    st.characters(codec="utf-8", exclude_categories=("C", "Z")), min_size=1, max_size=8
).filter(lambda name: name.strip() == name)


@st.composite
def traces(draw):
    """Rows (t, id, x, y, speed) by time, each vehicle at most once at each."""
    times = draw(st.lists(st.integers(0, 10**6), min_size=1, max_size=6, unique=True))
    ids = draw(st.lists(names, min_size=1, max_size=4, unique=True))
    return [
        (t / 1000, each, draw(metres), draw(metres), draw(speeds))
        for t in sorted(times)
        for each in draw(st.sets(st.sampled_from(ids)).map(sorted))
    ]


def as_csv(rows):
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerows([("t", "id", "x", "y", "speed"), *rows])
    return text.getvalue()


def as_fcd(rows):
    steps = "".join(
        f'<timestep time="{t!r}"><vehicle id={quoteattr(name)} x="{x!r}" y="{y!r}" '
        f'speed="{speed!r}"/></timestep>\n'
        for t, name, x, y, speed in rows
    )
    return f"<fcd-export>\n{steps}</fcd-export>\n"


def with_file(content, use):
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "trace"
        path.write_bytes(content)
        return use(path)


@given(traces(), st.sampled_from([as_csv, as_fcd]), st.booleans())
def test_what_is_written_is_read(rows, write, packed):
    content = write(rows).encode()
    content = gzip.compress(content) if packed else content
    read = with_file(content, lambda path: [tuple(sample)[:5] for sample in read_samples(path)])
    assert read == rows


def _outcome(path):
    try:
        motion = load_motion(path, [0.0, 1.0], uav_x=0.0, max_objects=2, range_m=50.0)
    except TraceError as error:
        return None, str(error), path
    return motion, None, path


@settings(max_examples=300)
@given(
    st.sampled_from([as_csv, as_fcd]),
    st.booleans(),
    st.lists(st.tuples(st.integers(0, 10**4), st.binary(max_size=3)), min_size=1, max_size=3),
    st.integers(0, 10**4),
)
def test_damaged_bytes_give_motion_or_a_clear_message_and_nothing_else(write, packed, edits, cut):
    rows = [(t / 2, name, 5.0 * t, 0.0, 10.0) for t in range(4) for name in ("a", "b")]
    content = bytearray(write(rows).encode())
    content = bytearray(gzip.compress(bytes(content))) if packed else content
    for place, new in edits:
        place %= len(content)
        content[place : place + len(new)] = new
    content = content[: cut % (2 * len(content)) + 1]

    motion, message, path = with_file(bytes(content), _outcome)
    if motion is None:
        assert message.startswith(str(path))
    else:
        assert np.isfinite(motion.position[motion.present]).all()
        assert np.isfinite(motion.velocity[motion.present]).all()


@st.composite
def smooth_drives(draw):
    """Speed over time as a few waves around a mean, that never stops: speed and position."""
    mean = draw(st.floats(8.0, 30.0))
    waves = [
        (share * 0.3 * mean, 2 * math.pi / period, phase)
        for share, period, phase in draw(
            st.lists(
                st.tuples(st.floats(0, 0.5), st.floats(20.0, 60.0), st.floats(0, 6.0)), max_size=2
            )
        )
    ]

    def speed(t):
        return mean + sum((size * np.cos(w * t + phase) for size, w, phase in waves), 0 * t)

    def position(t):
        return mean * t + sum(
            size / rate * (np.sin(rate * t + phase) - math.sin(phase))
            for size, rate, phase in waves
        )

    return speed, position


@settings(max_examples=100)
@given(
    smooth_drives(),
    st.sampled_from([0.025, 0.04, 0.1, 0.25, 0.5, 1.0]),
    st.sampled_from(["at", "before", "after", "none"]),
    st.sampled_from([2, 3]),
    st.sampled_from([drives.as_csv, drives.as_xml]),
)
def test_smooth_motion_as_simulators_write_it_is_read_back_within_a_per_cent(
    drive, step, speeds, digits, write
):
    speed, position = drive
    t = step * np.arange(round(20 / step) + 1)
    x = position(t)
    mean = np.diff(position(np.append(t, t[-1] + step))) / step  # over the step after each time
    given_speed = {"at": speed(t), "after": mean, "before": np.append(speed(0.0), mean[:-1])}
    rows = [
        drives.Row(
            f"{t[k] + 1e-9:.{digits}f}",
            "a",
            f"{x[k]:.2f}",
            "0.00",
            "" if speeds == "none" else f"{given_speed[speeds][k]:.2f}",
        )
        for k in range(t.size)
    ]
    clock = np.arange(2.0, 18.0, 0.05)
    motion = with_file(
        write(rows).encode(),
        lambda path: load_motion(
            path, clock, uav_x=0.0, max_objects=1, range_m=1e5, start=2.0, origin=0.0
        ),
    )
    assert motion.present.all()
    np.testing.assert_allclose(motion.velocity[:, 0], speed(clock), rtol=0.01)
    np.testing.assert_allclose(motion.position[:, 0], position(clock), atol=0.2)


@st.composite
def tracks(draw):
    """One vehicle's times, monotone or wandering positions, and speeds or none."""
    steps = draw(st.lists(st.floats(0.05, 0.24), min_size=1, max_size=12))
    time = np.cumsum([draw(st.floats(0, 1000)), *steps])
    moves = draw(st.lists(st.floats(-30, 30), min_size=len(steps), max_size=len(steps)))
    along = np.cumsum([draw(st.floats(-1e4, 1e4)), *moves])
    one = st.one_of(speeds, st.just(math.nan))
    speed = np.array(draw(st.lists(one, min_size=time.size, max_size=time.size)))
    zeros = np.zeros(time.size)
    return RoadSamples(("a",), zeros.astype(int), zeros.astype(int), time, along, zeros, speed)


@given(tracks())
def test_motion_goes_through_its_samples_and_stays_between_them(track):
    inner = np.linspace(track.time[:-1], track.time[1:], 7)[:-1].T.ravel()
    seen = sight(track, np.append(inner, track.time[-1]))
    assert seen.slot.size == 6 * (track.time.size - 1) + 1
    np.testing.assert_allclose(seen.position[::6], track.along, atol=1e-9)
    low = np.minimum(track.along[:-1], track.along[1:])[:, None]
    high = np.maximum(track.along[:-1], track.along[1:])[:, None]
    within = seen.position[:-1].reshape(-1, 6)
    assert (within >= low - 1e-9).all()
    assert (within <= high + 1e-9).all()
    direction = np.sign(np.diff(track.along))[:, None]
    assert (seen.velocity[:-1].reshape(-1, 6) * direction >= -1e-9).all()


@given(tracks())
def test_velocity_is_continuous_at_every_sample(track):
    step = 1e-7
    knots = track.time[1:-1]
    seen = sight(track, np.unique(np.concatenate([track.time[:1], knots - step, knots + step])))
    jump = seen.velocity[2::2] - seen.velocity[1::2]
    # Accelerations are at most 6 (3 + 3 + 2) / h times the chord: 8e5 m/s^2 for these tracks.
    chord = np.abs(np.diff(track.along) / np.diff(track.time)).max()
    steepest = 48 * chord / np.diff(track.time).min()
    assert (np.abs(jump) <= 2 * step * steepest + 1e-9).all()


@given(
    st.lists(st.floats(0.1, 0.4), min_size=1, max_size=10),
    st.floats(0.5, 40),
    st.floats(-3, 3),
    st.sampled_from([-1, 1]),
    st.booleans(),
)
def test_constant_acceleration_is_reproduced_where_speeds_are_given(steps, v, a, sign, backwards):
    time = np.cumsum([0.0, *steps])
    a = max(a, -v / time[-1])  # a car brakes to a stop and does not go on backwards
    along = sign * (v * time + a * time**2 / 2)
    speed = np.maximum(v + a * time, 0.0) * (-1 if backwards else 1)
    zeros = np.zeros(time.size)
    integers = zeros.astype(int)
    track = RoadSamples(("a",), integers, integers, time, along, zeros, speed)
    clock = np.linspace(0, time[-1], 50)
    seen = sight(track, clock)
    np.testing.assert_allclose(seen.position, sign * (v * clock + a * clock**2 / 2), atol=1e-9)
    np.testing.assert_allclose(seen.velocity, sign * (v + a * clock), atol=1e-9)


@given(
    st.integers(1, 12).flatmap(
        lambda slots: st.lists(
            st.lists(st.one_of(st.none(), st.integers(-6, 6)), min_size=slots, max_size=slots),
            min_size=1,
            max_size=6,
        )
    ),
    st.integers(0, 4),
    st.integers(1, 5),
)
def test_the_nearest_are_served_each_in_one_column(ways, max_objects, range_m):
    table = np.array([[math.nan if x is None else x for x in way] for way in ways])
    vehicle, slot = np.nonzero(~np.isnan(table))
    position = table[vehicle, slot]
    ids = tuple("abcdef"[: len(ways)])
    ground = np.zeros(table.shape[1])
    found = Sightings(slot, vehicle, position, -position)
    motion = serve(found, ids, np.zeros((len(ids), 1)), ground, max_objects, float(range_m))
    for n, column in enumerate(table.T):
        near = [i for i, x in enumerate(column) if abs(x) <= range_m]
        nearest = sorted(near, key=lambda i, column=column: (abs(column[i]), ids[i]))[:max_objects]
        occupants = motion.identity[n][motion.present[n]].tolist()
        assert sorted(occupants) == sorted(nearest)
        np.testing.assert_array_equal(motion.position[n][motion.present[n]], column[occupants])
        np.testing.assert_array_equal(motion.velocity[n][motion.present[n]], -column[occupants])
        if n:
            before, now = motion.identity[n - 1], motion.identity[n]
            stay = set(before[before >= 0]) & set(now[now >= 0])
            assert all(np.flatnonzero(before == i) == np.flatnonzero(now == i) for i in stay)
