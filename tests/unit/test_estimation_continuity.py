"""Continuity of tracks against plain loops over one trial, and against stories told by hand."""

from __future__ import annotations

import math
from collections import defaultdict
from itertools import pairwise
from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from echobeam.estimation.continuity import (
    detection_delay,
    false_tracks,
    identity_switches,
    reacquisition,
    tracked_objects,
)
from echobeam.faults import InputError


class Record(NamedTuple):
    """Identity, confirmed and matched ``(..., N, T)``, present ``(..., N, O)``."""

    identity: np.ndarray
    confirmed: np.ndarray
    matched: np.ndarray
    present: np.ndarray


def story(*columns: str, present: str) -> Record:
    """One object; a letter is the identity of a column's confirmed track, capital if matched.

    A point is an empty column. Of ``present``, "+" is a slot with the object.
    """
    identity = np.array(
        [["abcdefgh".find(x.lower()) if x != "." else -1 for x in c] for c in columns]
    )
    matched = np.array([[0 if x.isupper() else -1 for x in c] for c in columns])
    here = np.array([[x == "+"] for x in present])
    return Record(identity.T, (identity >= 0).T, matched.T, here)


def random_record(rng: np.random.Generator, trials: int, N: int, T: int, K: int) -> Record:
    """Columns that change owners; matches change rarely; tentative tracks carry any match."""
    identity = np.full((trials, N, T), -1)
    confirmed = np.zeros((trials, N, T), dtype=bool)
    matched = np.full((trials, N, T), -1)
    present = rng.random((trials, N, K)) < 0.8
    for i in range(trials):
        for n in range(N):
            identity[i, n] = rng.permutation(max(T, 4))[:T]
            confirmed[i, n] = rng.random(T) < 0.7
            free = list(np.flatnonzero(present[i, n]))
            for t in range(T):
                if not confirmed[i, n, t]:
                    identity[i, n, t] = rng.integers(-1, 4)
                    matched[i, n, t] = rng.integers(-3, 9)
                elif free and rng.random() < 0.6:
                    matched[i, n, t] = free.pop(rng.integers(len(free)))
    return Record(identity, confirmed, matched, present)


def tracks_of(one: Record, k: int) -> list[int | None]:
    """Identity of the track on an object per slot, None without."""
    found: list[int | None] = []
    for identity, confirmed, matched in zip(*one[:3], strict=True):
        on = [i for i, c, m in zip(identity, confirmed, matched, strict=True) if c and m == k]
        found.append(int(on[0]) if on else None)
    return found


def expected(one: Record) -> tuple[int, list[float], float, int, float]:
    """All five numbers of one trial, by counting."""
    switches, delays, gaps, hits = 0, [], [], 0
    for k in range(one.present.shape[1]):
        tracks, here = tracks_of(one, k), list(one.present[:, k])
        seen = [n for n, track in enumerate(tracks) if track is not None]
        for first, second in pairwise(seen):
            switches += tracks[first] != tracks[second]
            gap = sum(here[first + 1 : second])
            gaps += [gap] if gap else []
        delays.append(float(seen[0] - here.index(True)) if seen else math.nan)
        hits += len(seen)
    votes: dict[int, list[bool]] = defaultdict(list)
    for identity, confirmed, matched in zip(*(x.ravel() for x in one[:3]), strict=True):
        if confirmed:
            votes[identity].append(matched < 0)
    false = sum(sum(alone) > len(alone) / 2 for alone in votes.values())
    mean_gap = sum(gaps) / len(gaps) if gaps else math.nan
    share = hits / one.present.sum() if one.present.any() else math.nan
    return switches, delays, mean_gap, false, share


def tracked_share(confirmed, matched, present) -> np.ndarray:
    tracked = tracked_objects(confirmed, matched, present)
    here = np.broadcast_to(present, tracked.shape).sum(axis=(-2, -1))
    return np.where(here > 0, tracked.sum(axis=(-2, -1)) / np.maximum(here, 1), np.nan)


def measured(record: Record) -> tuple[np.ndarray, ...]:
    return (
        identity_switches(*record),
        detection_delay(*record[1:]),
        reacquisition(*record[1:]),
        false_tracks(*record[:3]),
        tracked_share(*record[1:]),
    )


@given(st.integers(0, 2**32 - 1), st.integers(0, 12), st.integers(0, 4), st.integers(0, 3))
@settings(max_examples=60, deadline=None)
def test_every_trial_is_counted_as_by_hand(
    seed: int, slots: int, columns: int, objects: int
) -> None:
    record = random_record(np.random.default_rng(seed), 5, slots, columns, objects)
    found = measured(record)
    for i in range(5):
        numbers = expected(Record(*(one[i] for one in record)))
        for ours, by_hand in zip(found, numbers, strict=True):
            np.testing.assert_allclose(ours[i], by_hand, rtol=1e-12)


@pytest.mark.parametrize(
    ("columns", "present", "switches", "delay", "gap", "false", "share"),
    [
        (["AAAA"], "++++", 0, 0, None, 0, 1.0),
        (["..AA"], "++++", 0, 2, None, 0, 0.5),
        (["..AA"], ".+++", 0, 1, None, 0, 2 / 3),
        (["AABB"], "++++", 1, 0, None, 0, 1.0),
        (["AA..BB"], "++++++", 1, 0, 2, 0, 4 / 6),
        (["AA..AA"], "++++++", 0, 0, 2, 0, 4 / 6),
        (["AA..AA"], "++..++", 0, 0, None, 0, 1.0),
        (["AaAaaA"], "++++++", 0, 0, 1.5, 0, 0.5),  # matched in half its slots: not false
        (["AA...."], "++++++", 0, 0, None, 0, 2 / 6),  # lost for good: no gap
        (["ABAB"], "++++", 3, 0, None, 0, 1.0),
        (["AA..", "..AA"], "++++", 0, 0, None, 0, 1.0),  # the same track in another column
        (["AAAA", "bbbb", "cc.d"], "++++", 0, 0, None, 3, 1.0),
        (["Aaa."], "++++", 0, 0, None, 1, 0.25),
        (["aa.a"], "....", 0, None, None, 1, None),
        (["...."], "++++", 0, None, None, 0, 0.0),
    ],
)
def test_stories(
    columns: list[str],
    present: str,
    switches: int,
    delay: float | None,
    gap: float | None,
    false: int,
    share: float | None,
) -> None:
    found = measured(story(*columns, present=present))
    wanted = [switches, delay, gap, false, share]
    for ours, told in zip(found, wanted, strict=True):
        assert np.squeeze(ours) == pytest.approx(math.nan if told is None else told, nan_ok=True)


def test_tentative_tracks_do_not_count() -> None:
    record = story("AAbb", present="++++")
    found = measured(record._replace(confirmed=np.zeros_like(record.confirmed)))
    np.testing.assert_array_equal(
        np.hstack([np.ravel(x) for x in found]), [0, np.nan, np.nan, 0, 0]
    )


def test_leading_axes_are_kept_and_broadcast() -> None:
    """Two schemes that share the truth of three trials."""
    rng = np.random.default_rng(2)
    a, b = (random_record(rng, 3, 6, 2, 2) for _ in range(2))
    everywhere = np.ones((3, 6, 2), dtype=bool)
    stacked = Record(*(np.stack(pair) for pair in zip(a, b, strict=True)))._replace(
        present=everywhere
    )
    found = measured(stacked)
    for scheme, one in enumerate((a, b)):
        alone = measured(one._replace(present=everywhere))
        for ours, theirs in zip(found, alone, strict=True):
            assert ours.shape == (2, *theirs.shape)
            np.testing.assert_array_equal(ours[scheme], theirs)


def test_without_trials_there_is_nothing_to_count() -> None:
    record = random_record(np.random.default_rng(0), 0, 5, 2, 3)
    assert [one.shape for one in measured(record)] == [(0,), (0, 3), (0,), (0,), (0,)]


def test_trials_share_no_identities() -> None:
    """The same number in two trials is two tracks: false in one, on its object in the other."""
    both = [story("aaa", present="+++"), story("AAA", present="+++")]
    record = Record(*(np.stack(pair) for pair in zip(*both, strict=True)))
    np.testing.assert_array_equal(false_tracks(*record[:3]), [1, 0])


def test_bad_records_are_refused() -> None:
    good = story("AA", "bb", present="++")
    two = good._replace(matched=np.zeros((2, 2), dtype=int))
    with pytest.raises(InputError, match="two confirmed tracks"):
        identity_switches(*two)
    with pytest.raises(InputError, match="not present"):
        tracked_share(*story("AA", present="+.")[1:])
    with pytest.raises(InputError, match="beyond the 1 objects"):
        detection_delay(*good._replace(matched=np.array([[1, -1], [0, -1]]))[1:])
    with pytest.raises(InputError, match="below -1"):
        false_tracks(*good._replace(matched=np.full((2, 2), -2))[:3])
    for metric, arrays in ((identity_switches, slice(0, 4)), (false_tracks, slice(0, 3))):
        nobody = good._replace(identity=np.full((2, 2), -1))
        with pytest.raises(InputError, match="no identity"):
            metric(*nobody[arrays])
        with pytest.raises(InputError, match="need axes"):
            metric(*good._replace(confirmed=good.confirmed[:1])[arrays])
        wide = good._replace(confirmed=np.stack([good.confirmed] * 2))
        with pytest.raises(InputError, match="trials"):
            metric(*wide._replace(matched=np.stack([good.matched] * 3))[arrays])
    with pytest.raises(InputError, match="slots"):
        reacquisition(*good._replace(present=good.present[:1])[1:])
    stacked = Record(*(np.stack([one] * 2) for one in good))
    with pytest.raises(InputError, match="trials of present"):
        tracked_share(*stacked._replace(present=np.stack([good.present] * 3))[1:])
