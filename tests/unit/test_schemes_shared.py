"""Shared beams: who shares one by rates worked out by hand, groups, and what the cover reaches."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.schemes.configure import system_of
from echobeam.schemes.shared import share
from echobeam.testing.conformance import small_scenario
from echobeam.values import NOBODY, Status, Tracks

N, NOISE = 8, 1.0


def system(power=1e4, axis="vertical"):
    return system_of(small_scenario(1).replace({"radio.power": power, "array.axis": axis}))


def tracks_of(angles, distances=None) -> Tracks:
    """Tracks of one trial at some angles, NaN for an empty column."""
    angle = np.array(angles, dtype=float)[None]
    known = np.isfinite(angle)
    far = 100.0 / np.sin(angle) if distances is None else np.array(distances, dtype=float)[None]
    mean = np.stack([angle, np.where(known, far, np.nan), 0.0 * angle], axis=-1)
    cov = np.where(known[..., None, None], np.eye(3), np.nan)
    status = np.where(known, Status.CONFIRMED, Status.NONE).astype(np.int8)
    return Tracks(mean, cov, status, np.where(known, np.arange(angle.size) + 10, NOBODY))


def by_hand(angles, distances, power, axis):
    """Return what two beams and one in turns reach, with loops over the antennas."""
    spread = np.sin if axis == "vertical" else np.cos
    product = sum(
        np.exp(1j * np.pi * m * (spread(angles[0]) - spread(angles[1]))) for m in range(N)
    )
    square = abs(product / N) ** 2
    x = N * (power / 2.0) / (NOISE * max(distances) ** 2)
    # Matched beams of half the power disturb each other by r^2; beams with a zero at the other's
    # angle do not, and lose r^2 of their gain.
    sinr = max(x * (1.0 - square), x / (1.0 + x * square))
    return 2.0 * np.log2(1.0 + sinr), np.log2(1.0 + 2.0 * x)


@pytest.mark.parametrize("axis", ["vertical", "horizontal"])
@pytest.mark.parametrize("power", [1e2, 1e4, 1e6])
def test_two_tracks_share_a_beam_where_that_gives_more(axis, power):
    rng = np.random.default_rng(4)
    shared = 0
    for _ in range(100):
        first = rng.uniform(0.4, 2.7)
        angles = np.array([first, np.clip(first + rng.normal(0.0, 0.15), 0.2, 2.9)])
        distances = rng.uniform(50.0, 200.0, 2)
        two, one = by_hand(angles, distances, power, axis)
        if abs(two - one) < 1e-9 * one:
            continue
        found = share(tracks_of(angles, distances), system(power, axis))
        assert found.leader.tolist() == [[0, 0 if one > two else 1]]
        shared += one > two
    assert 5 < shared < 95


def test_the_criterion_is_right_about_beams_as_they_are_sent():
    """The SINR of matched and of zero-forcing beams, computed from their vectors."""
    for apart in (0.01, 0.1, 0.3):
        angles = np.array([1.0, 1.0 + apart])
        steering = np.exp(1j * np.pi * np.arange(N) * np.sin(angles)[:, None])
        power, loss = 1e4, NOISE * 100.0**2
        matched = steering * np.sqrt(power / 2.0 / N)
        inverse = np.linalg.pinv(steering.conj()).T
        zeros = inverse / np.linalg.norm(inverse, axis=1, keepdims=True) * np.sqrt(power / 2.0)
        best = 0.0
        for beams in (matched, zeros):
            gain = np.abs(beams @ steering.conj().T) ** 2
            sinr = np.diag(gain) / (gain.sum(axis=0) - np.diag(gain) + loss)
            best = max(best, float(np.log2(1.0 + sinr).sum()))
        two, one = by_hand(angles, [100.0, 100.0], power, "vertical")
        assert best == pytest.approx(two, rel=1e-9)
        alone = steering[0] * np.sqrt(power / N)
        turns = np.log2(1.0 + abs(alone @ steering[0].conj()) ** 2 / loss)
        assert turns == pytest.approx(one, rel=1e-9)


def test_mirror_images_share_a_beam_of_a_vertical_array_alone():
    for axis, leader in (("vertical", [[0, 0]]), ("horizontal", [[0, 1]])):
        assert share(tracks_of([0.9, np.pi - 0.9]), system(axis=axis)).leader.tolist() == leader


def test_a_beam_for_mirror_images_is_aimed_at_their_direction_and_not_between_them():
    angles = [0.9, np.pi - 0.9, np.pi - 0.91]
    found = share(tracks_of(angles), system())
    assert found.leader.tolist() == [[0, 0, 0]]
    served = found.applied(tracks_of(angles)).mean[0, 0, 0]
    reach = float(found.reach[0, 0])
    directions = np.sin(served + np.linspace(-reach, reach, 101))
    for angle in angles:
        assert directions.min() - 1e-12 <= np.sin(angle) <= directions.max() + 1e-12
    assert reach == pytest.approx(0.005)
    sideways = share(tracks_of([1.5, 1.6]), system(axis="horizontal"))
    assert sideways.centre[0, 0] == pytest.approx(1.55)  # a horizontal array tells them apart
    assert sideways.reach[0, 0] == pytest.approx(0.05)


def test_who_shares_with_one_of_a_group_is_in_it():
    """A chain of neighbours whose ends are far apart, in any order of columns."""
    angles = [1.0, 1.04, 1.08, 1.12, 1.16]
    ends = share(tracks_of([angles[0], angles[-1]]), system(1e6)).leader
    assert ends.tolist() == [[0, 1]]
    rng = np.random.default_rng(0)
    for _ in range(10):
        order = rng.permutation(5)
        found = share(tracks_of([*np.array(angles)[order], 0.4]), system(1e6))
        assert found.leader.tolist() == [[0, 0, 0, 0, 0, 5]]
        assert found.follows.tolist() == [[False, True, True, True, True, False]]
        assert found.centre[0, 0] == pytest.approx(1.08)
        assert found.reach[0, 0] == pytest.approx(0.08)
        assert found.farthest[0, 0] == pytest.approx(100.0 / np.sin(1.0))
        assert np.isnan(found.centre[0, 1:]).all()


def test_the_leaders_cover_reaches_every_member():
    rng = np.random.default_rng(8)
    for _ in range(30):
        angle = 1.2 + 0.02 * rng.standard_normal(4)
        tracks = tracks_of([*angle, 0.5])
        sigma = rng.uniform(1e-4, 5e-3, (1, 5))
        for width in (3.0, 1.0):
            sharing = share(tracks, system())
            assert sharing.leader.tolist() == [[0, 0, 0, 0, 4]]
            served = sharing.applied(tracks)
            half = width * sharing.spread(sigma, width)[0]
            assert served.known.tolist() == [[True, False, False, False, True]]
            assert served.id.tolist() == [[10, NOBODY, NOBODY, NOBODY, 14]]
            low, high = served.mean[0, 0, 0] - half[0], served.mean[0, 0, 0] + half[0]
            assert low <= (angle - width * sigma[0, :4]).min() + 1e-12
            assert high >= (angle + width * sigma[0, :4]).max() - 1e-12
            assert half[4] == width * sigma[0, 4]
            assert served.mean[0, 4, 0] == 0.5
            assert served.mean[0, 0, 1] == tracks.mean[0, :4, 1].max()


def test_unknown_tracks_share_nothing():
    nobody = tracks_of([np.nan, np.nan])
    assert share(nobody, system()).leader.tolist() == [[0, 1]]
    one = tracks_of([1.0, np.nan, 1.0, np.nan])
    found = share(one, system())
    assert found.leader.tolist() == [[0, 1, 0, 3]]
    assert found.follows.tolist() == [[False, False, True, False]]
    alone = tracks_of([np.nan, 1.0])
    assert share(alone, system()).applied(alone) is alone
    sigma = np.full((1, 2), 0.1)
    assert share(alone, system()).spread(sigma, 3.0) is sigma


def test_trials_do_not_share_with_each_other():
    near, apart = tracks_of([1.0, 1.001, 0.4]), tracks_of([1.0, 0.4, np.nan])
    both = Tracks(
        *(np.concatenate([getattr(near, name), getattr(apart, name)])
          for name in ("mean", "cov", "status", "id"))
    )  # fmt: skip
    found = share(both, system())
    assert found.leader.tolist() == [[0, 0, 2], [0, 1, 2]]
    served = found.applied(both)
    np.testing.assert_array_equal(served.mean[1], apart.mean[0])
    np.testing.assert_array_equal(found.spread(np.full((2, 3), 0.1), 3.0)[1], 0.1)
