"""The road's axis, given and fitted."""

import math
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import ConvexHull

from echobeam.traces.outline import convex_hull
from echobeam.traces.road import Road, RoadError, road_between
from echobeam.traces.sample import Sample, TraceError
from echobeam.traces.survey import survey_trace

from ..drives import Row, as_csv, drive, read

PATH = Path("trace.csv")


def samples(tracks, every=1.0):
    """Samples of vehicles given as lists of (x, y), so many seconds apart."""
    return [
        Sample(every * t, name, float(x), float(y), math.nan, 0)
        for name, track in tracks.items()
        for t, (x, y) in enumerate(track)
    ]


def straight(heading, offset, lengths, about=(0.0, 0.0)):
    """Points of a line with a heading, at an offset to its left."""
    u = np.array([math.cos(heading), math.sin(heading)])
    n = np.array([-u[1], u[0]])
    return np.array(about) + offset * n + np.outer(lengths, u)


@pytest.mark.parametrize("heading", [0.0, 0.3, 1.2, 2.5, -1.0, math.pi])
def test_along_and_across_turn_the_plane_by_the_heading(heading):
    road = Road(10.0, -20.0, heading)
    turned = (complex(37.0, 5.0) - complex(10.0, -20.0)) * np.exp(-1j * heading)
    assert road.along(37.0, 5.0) == pytest.approx(turned.real, abs=1e-12)
    assert road.across(37.0, 5.0) == pytest.approx(turned.imag, abs=1e-12)


def test_road_between_two_points_starts_at_the_first_and_heads_for_the_second():
    road = road_between((1.0, 1.0), (4.0, 5.0))
    assert road.along(1.0, 1.0) == 0.0
    assert road.along(4.0, 5.0) == pytest.approx(5.0)
    assert road.across(4.0, 5.0) == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize(
    "wrong",
    [
        lambda: road_between((1.0, 1.0), (1.0, 1.0)),
        lambda: road_between((1.0, 1.0), (math.nan, 1.0)),
        lambda: Road(0.0, 0.0, math.inf),
        lambda: Road(0.0, 0.0, 0.0, half_width=0.0),
        lambda: Road(0.0, 0.0, 0.0, half_width=math.nan),
    ],
)
def test_roads_that_make_no_sense_are_refused(wrong):
    with pytest.raises(RoadError):
        wrong()


def test_fit_of_one_vehicle_is_the_singular_vector_of_its_positions():
    rng = np.random.default_rng(3)
    track = straight(0.4, 0.0, np.linspace(0, 200, 60), (500, -80)) + rng.normal(0, 2, (60, 2))
    road = survey_trace(PATH, samples({"a": track})).road
    centred = track - track.mean(axis=0)
    axis = np.linalg.svd(centred)[2][0]
    axis *= np.sign(axis[0])
    assert road.heading == pytest.approx(math.atan2(axis[1], axis[0]), abs=1e-9)
    offsets = [road.across(x, y) for x, y in track]
    assert np.mean(offsets) == pytest.approx(0.0, abs=1e-9)


def test_lanes_do_not_turn_the_fitted_axis():
    tracks = {
        "a": straight(0.7, 0.0, np.linspace(0, 40, 9)),
        "b": straight(0.7, 7.0, np.linspace(30, 90, 9)),
    }
    assert survey_trace(PATH, samples(tracks)).road.heading == pytest.approx(0.7, abs=1e-12)


def test_vehicles_that_all_stand_are_fitted_by_their_places():
    track = straight(0.2, 3.0, [0.0, 50.0, 120.0])
    tracks = {str(i): [point, point] for i, point in enumerate(track)}
    assert survey_trace(PATH, samples(tracks)).road.heading == pytest.approx(0.2, abs=1e-12)


def test_one_standing_vehicle_is_at_one_place_whatever_the_axis():
    survey = survey_trace(PATH, samples({"a": [(3.7, 0.1)] * 3}))
    assert survey.road.heading == 0.0
    assert survey.extent == (3.7, 3.7)


@pytest.mark.parametrize(
    ("heading", "points"),
    [(0.1, 0.1), (math.pi + 0.1, 0.1), (math.pi / 2 + 0.1,) * 2, (-math.pi / 2 + 0.1,) * 2],
)
def test_fitted_axis_points_where_its_larger_component_is_positive(heading, points):
    track = straight(heading, 0.0, np.linspace(0, 100, 5))
    fitted = survey_trace(PATH, samples({"a": track})).road.heading
    points = points if points > 0 else points + math.pi
    assert fitted == pytest.approx(points, abs=1e-12)


def test_road_along_x_keeps_the_traces_x():
    track = [(x, -4.8) for x in (300.0, 310.0, 325.0)]
    survey = survey_trace(PATH, samples({"a": track}))
    assert survey.extent == pytest.approx((300.0, 325.0))
    assert survey.road.across(0.0, -4.8) == pytest.approx(0.0, abs=1e-9)


def test_map_coordinates_in_the_millions_lose_no_accuracy():
    track = straight(0.7, 0.0, np.linspace(0, 100, 11), (4.6e5, 5.4e6))
    road = survey_trace(PATH, samples({"a": track})).road
    assert road.heading == pytest.approx(0.7, abs=1e-9)
    along = np.array([road.along(x, y) for x, y in track])
    np.testing.assert_allclose(np.diff(along), 10.0, atol=1e-7)


def test_roundabout_is_refused_as_a_road():
    angle = np.linspace(0, 2 * math.pi, 40)
    circle = 30 * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    with pytest.raises(TraceError, match=r"trace\.csv: .*straight road.*road given"):
        survey_trace(PATH, samples({"a": circle}))


def test_vehicles_on_other_roads_do_not_turn_the_fitted_one():
    tracks = {
        **{f"a{i}": straight(0.3, 3.5 * i, np.linspace(0, 200, 11)) for i in range(6)},
        "parallel": straight(0.3, 300.0, np.linspace(0, 200, 11)),
        "crossing": straight(0.3 + math.pi / 2, 0.0, np.linspace(-60, 60, 11), (100, 30)),
    }
    road = survey_trace(PATH, samples(tracks)).road
    assert road.heading == pytest.approx(0.3, abs=1e-12)
    assert road.half_width == 30.0
    middle = straight(0.3, 3.5 * 2.5, [50.0])[0]
    assert road.across(*middle) == pytest.approx(0.0, abs=1e-9)


def test_two_carriageways_within_the_roads_width_are_one_road():
    tracks = {
        "east": straight(0.1, -20.0, np.linspace(0, 200, 11)),
        "west": straight(0.1, 20.0, np.linspace(200, 0, 11)),
    }
    survey = survey_trace(PATH, samples(tracks))
    assert survey.road.heading == pytest.approx(0.1, abs=1e-12)
    assert survey.extent is not None


def test_two_roads_that_carry_as_much_are_refused():
    tracks = {
        "one": straight(0.1, 0.0, np.linspace(0, 200, 11)),
        "other": straight(0.1, 200.0, np.linspace(0, 200, 11)),
    }
    with pytest.raises(TraceError, match=r"within 30 m of the best-fitting one.*road given"):
        survey_trace(PATH, samples(tracks))


def test_extent_is_that_of_the_samples_on_the_fitted_road(tmp_path):
    rows = [
        *drive("a", 20.0),
        *drive("b", 15.0, y=3.0),
        *drive("c", 15.0, y=6.0),
        *drive("far", 20.0, x=500.0, y=90.0),
    ]
    found = read(tmp_path, as_csv(rows))
    # On the road from -100 m to 100 m; the far one reaches to 700 m.
    at_first = {found.motion.names[i]: x for i, x in zip(*first_slot(found.motion), strict=True)}
    assert at_first == pytest.approx({"a": -100.0, "b": -100.0, "c": -100.0})
    (note,) = found.notes
    assert "1 of 4 vehicles is off the road (more than 30 m from its axis, up to 87 m)" in note
    assert "first 'far' in line 65: not served there" in note


def first_slot(motion):
    here = motion.present[0]
    return motion.identity[0][here], motion.position[0][here]


def test_a_crossing_car_is_served_only_while_it_is_on_the_road(tmp_path):
    # Seven cars along x, one across at 10 m/s.
    rows = [row for i in range(7) for row in drive(f"a{i}", 20.0, y=3.0 * i)]
    across = [Row(f"{k / 2}", "b", "0", f"{-50 + 5 * k}", "10") for k in range(21)]
    found = read(tmp_path, as_csv([*rows, *across]))
    y = -50 + 10 * found.times("b")
    assert np.abs(y - 9.0).max() <= 30.0
    assert found.velocity("a3").size == 101
    np.testing.assert_allclose(found.velocity("a3"), 20.0)
    assert "1 of 8 vehicles is off the road" in found.notes[0]


def test_given_road_counts_only_the_vehicles_on_it():
    tracks = {
        "here": [(0.0, 2.0), (80.0, 2.0)],
        "parallel": [(-500.0, 100.0), (500.0, 100.0)],
    }
    survey = survey_trace(PATH, samples(tracks), road_between((0.0, 0.0), (1.0, 0.0)))
    assert survey.extent == (0.0, 80.0)


def test_given_road_without_vehicles_is_refused():
    road = road_between((0.0, 500.0), (1.0, 500.0))
    with pytest.raises(TraceError, match="no vehicle comes within 30 m of the road"):
        survey_trace(PATH, samples({"a": [(0, 0), (9, 0)]}), road)


def test_hull_has_the_corners_that_qhull_finds():
    points = np.random.default_rng(1).normal(size=(300, 2))
    ours = convex_hull([tuple(point) for point in points.tolist()])
    theirs = points[ConvexHull(points).vertices]
    assert sorted(ours) == sorted(map(tuple, theirs.tolist()))


def test_hull_of_points_on_a_line_is_its_two_ends():
    assert sorted(convex_hull([(float(i), 2.0 * i) for i in range(50)])) == [(0, 0), (49, 98)]


def test_extent_and_axis_of_a_long_trace_are_those_of_all_its_points():
    rng = np.random.default_rng(5)
    track = straight(-0.5, 0.0, rng.uniform(-300, 300, 10_000)) + rng.normal(0, 3, (10_000, 2))
    survey = survey_trace(PATH, samples({"a": track}, every=100.0))
    along = [survey.road.along(x, y) for x, y in track]
    assert survey.extent == pytest.approx((min(along), max(along)), abs=1e-9)
    axis = np.linalg.svd(track - track.mean(axis=0), full_matrices=False)[2][0]
    assert math.tan(survey.road.heading) == pytest.approx(axis[1] / axis[0], rel=1e-9)
