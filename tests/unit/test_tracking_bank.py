"""Life of tracks: stories written by hand, and histories against a bank of dicts and lists."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echobeam.tracking import bank as banks
from echobeam.tracking.bank import LifeRules
from echobeam.values import NOBODY, GaussianState, Status

NONE, TENTATIVE, CONFIRMED, COASTING = Status


def first_states(values) -> GaussianState:
    """States ``(1, D)`` whose angle tells which detection they are of."""
    mean = np.array(values, dtype=float)[None, :, None] * np.ones(3)
    cov = np.broadcast_to(np.eye(3), (*mean.shape, 3)).copy()
    return GaussianState(mean, cov, np.ones(mean.shape[:-1], bool))


def born(bank, values, rules, free=None):
    """Begin tracks of one trial from detections of these values, in the bank's free columns."""
    free = bank.id == NOBODY if free is None else free
    new = np.ones((1, len(values)), bool)
    spread = np.array(values, dtype=float)[None]
    return banks.with_births(bank, free, first_states(values), new, spread, rules)


def life(story, rules):
    """Return the status after each slot: "D" detected, "." lit and missed, "u" not lit."""
    bank, _ = born(banks.empty(1, 1, 3), [1.0], rules)
    seen = [int(bank.status[0, 0])]
    for slot in story:
        bank = banks.aged(bank, np.array([[slot in "Dd"]]), np.array([[slot in "D."]]), rules)
        seen.append(int(bank.status[0, 0]))
    return seen


@pytest.mark.parametrize(
    ("rules", "story", "expected"),
    [
        # M = 2 of N = 3: the second detection confirms, in the next slot or the one after.
        ((2, 3, 2), "D", [TENTATIVE, CONFIRMED]),
        ((2, 3, 2), ".D", [TENTATIVE, TENTATIVE, CONFIRMED]),
        ((2, 3, 2), "..", [TENTATIVE, TENTATIVE, NONE]),
        # Slots in which it is not lit say nothing, however many.
        ((2, 3, 2), "uuuuuuD", [TENTATIVE] * 7 + [CONFIRMED]),
        ((2, 3, 2), "u.u.u", [TENTATIVE] * 4 + [NONE] * 2),
        # A detection counts where none was to be expected.
        ((2, 3, 2), "d", [TENTATIVE, CONFIRMED]),
        # Coasting, back again, and the end after `coast` misses in a row.
        ((2, 3, 2), "D.D..", [TENTATIVE, CONFIRMED, COASTING, CONFIRMED, COASTING, NONE]),
        ((2, 3, 3), "D.u.u.", [1, 2, 3, 3, 3, 3, 0]),
        ((2, 3, 1), "D.", [TENTATIVE, CONFIRMED, NONE]),
        # One detection is enough; the coast of a confirmed track is then the rule.
        ((1, 1, 2), "..", [CONFIRMED, COASTING, NONE]),
        ((1, 3, 4), "...", [CONFIRMED, COASTING, COASTING, COASTING]),
        # M = N: the first miss of a tentative track is its end.
        ((3, 3, 5), "DD", [TENTATIVE, TENTATIVE, CONFIRMED]),
        ((3, 3, 5), "D.", [TENTATIVE, TENTATIVE, NONE]),
        # Of the first N lit slots: it ends as soon as they cannot hold M detections.
        ((3, 4, 5), ".DD", [TENTATIVE] * 3 + [CONFIRMED]),
        ((3, 4, 5), ".D.", [TENTATIVE] * 3 + [NONE]),
        ((3, 5, 5), "D..D", [TENTATIVE] * 4 + [CONFIRMED]),
        ((3, 5, 5), "D...", [TENTATIVE] * 4 + [NONE]),
    ],
)
def test_stories_of_a_track(rules, story, expected):
    assert life(story, LifeRules(*rules)) == [int(status) for status in expected]


def test_more_births_than_columns_begin_the_first_ones():
    rules = LifeRules(2, 3, 2)
    bank, source = born(banks.empty(1, 2, 3), [7.0, 8.0, 9.0], rules)
    assert bank.id.tolist() == [[0, 1]]
    assert source.tolist() == [[0, 1]]
    assert bank.state.mean[0, 0, :, 0].tolist() == [7.0, 8.0]
    assert bank.spread.tolist() == [[7.0, 8.0]]
    full, source = born(bank, [5.0], rules)
    assert source.tolist() == [[NOBODY, NOBODY]]
    assert full.id.tolist() == [[0, 1]]


def test_a_column_is_used_again_and_an_identity_is_not():
    rules = LifeRules(1, 1, 1)
    bank, _ = born(banks.empty(1, 3, 3), [1.0, 2.0, 3.0], rules)
    assert bank.id.tolist() == [[0, 1, 2]]
    yes = np.ones((1, 3), bool)
    bank = banks.aged(bank, np.array([[True, False, True]]), yes, rules)
    assert bank.id.tolist() == [[0, NOBODY, 2]]
    assert np.isnan(bank.state.mean[0, 0, 1]).all()
    assert np.isnan(bank.spread[0, 1])
    announced = bank.roster[0, 1]
    bank, source = born(bank, [4.0], rules)
    assert source.tolist() == [[NOBODY, 0, NOBODY]]
    assert bank.id[0, 1] == announced
    assert announced > 2
    assert (bank.hits.tolist(), bank.tried.tolist()) == ([[2, 1, 2]], [[2, 1, 2]])


def test_unknown_first_states_begin_nothing():
    rules = LifeRules(2, 3, 2)
    first = first_states([1.0, 2.0])
    first.known[0, 0] = False
    bank, source = banks.with_births(
        banks.empty(1, 2, 3), np.ones((1, 2), bool), first, np.ones((1, 2), bool),
        np.ones((1, 2)), rules,
    )  # fmt: skip
    assert source.tolist() == [[1, NOBODY]]
    assert bank.state.mean[0, 0, 0, 0] == 2.0


def test_a_track_that_the_likeliest_hypothesis_gave_up_is_gone_in_all():
    rules = LifeRules(2, 3, 2)
    bank, _ = born(banks.empty(1, 2, 3, hypotheses=3), [1.0, 2.0], rules)
    assert bank.state.known.all()
    bank.state.known[0, 0, 1] = False
    bank.state.known[0, 2, 0] = False
    pruned = banks.pruned(bank)
    assert pruned.id.tolist() == [[0, NOBODY]]
    assert pruned.state.known[0].tolist() == [[True, False], [True, False], [False, False]]
    assert pruned.tracks.status.tolist() == [[TENTATIVE, NONE]]


class Slow:
    """A bank of one trial with a dict for each track."""

    def __init__(self, columns, rules):
        self.rules, self.columns, self.used = rules, [None] * columns, set()

    def age(self, detected, lit):
        rules = self.rules
        for place, track in enumerate(self.columns):
            if track is None or not (lit[place] or detected[place]):
                continue
            track["lit"].append(detected[place])
            track["misses"] = 0 if detected[place] else track["misses"] + 1
            first = track["lit"][: rules.window]
            if sum(first) >= rules.confirm:
                track["confirmed"] = True
            to_come = rules.window - len(first)
            if track["confirmed"]:
                ended = track["misses"] >= rules.coast
            else:
                ended = sum(first) + to_come < rules.confirm
            if ended:
                self.columns[place] = None

    def begin(self, values, free, identities):
        places = iter([place for place in range(len(self.columns)) if free[place]])
        for value, place in zip(values, places, strict=False):
            assert self.columns[place] is None
            assert identities[place] not in self.used, "an identity is used twice"
            self.used.add(identities[place])
            self.columns[place] = {
                "value": value, "lit": [True], "misses": 0,
                "confirmed": self.rules.confirm == 1, "id": identities[place],
            }  # fmt: skip

    def status(self):
        return [
            NONE if track is None
            else TENTATIVE if not track["confirmed"]
            else COASTING if track["misses"] else CONFIRMED
            for track in self.columns
        ]  # fmt: skip


@st.composite
def histories(draw):
    confirm = draw(st.integers(1, 4))
    rules = LifeRules(confirm, draw(st.integers(confirm, 6)), draw(st.integers(1, 4)))
    columns = draw(st.integers(1, 4))
    flags = st.lists(st.booleans(), min_size=columns, max_size=columns)
    slot = st.tuples(flags, flags, st.integers(0, 3))
    return rules, columns, draw(st.lists(slot, max_size=25))


@given(histories())
def test_any_history_is_that_of_a_bank_of_dicts(history):
    rules, columns, slots = history
    bank, slow, value = banks.empty(1, columns, 3), Slow(columns, rules), 0
    for detected, lit, births in slots:
        free = bank.id == NOBODY  # as before the slot: the schemes begin tracks in no others
        bank = banks.aged(bank, np.array([detected]), np.array([lit]), rules)
        slow.age(detected, lit)
        values = [float(value + number) for number in range(births)]
        value += births
        announced = bank.roster[0].tolist()
        if values:
            bank, _ = born(bank, values, rules, free)
        slow.begin(values, free[0].tolist(), announced)
        assert bank.status[0].tolist() == slow.status()
        there = [track for track in slow.columns if track is not None]
        known = bank.state.known[0, 0]
        assert known.tolist() == [track is not None for track in slow.columns]
        assert bank.id[0][known].tolist() == [track["id"] for track in there]
        assert (bank.id[0][~known] == NOBODY).all()
        assert bank.state.mean[0, 0, known, 0].tolist() == [track["value"] for track in there]
        assert len(set(bank.roster[0].tolist())) == columns  # whoever comes next is told apart


def test_trials_have_lives_and_identities_of_their_own():
    rules = LifeRules(2, 3, 2)
    rng = np.random.default_rng(3)
    trials, columns, slots = 5, 3, 20
    detected, lit = rng.random((2, slots, trials, columns)) < 0.6
    new = rng.random((slots, trials, 2)) < 0.4
    together = banks.empty(trials, columns, 3)
    alone = [banks.empty(1, columns, 3) for _ in range(trials)]
    first = first_states([1.0, 2.0])
    for slot in range(slots):

        def step(bank, rows, slot=slot):
            count = len(bank.id)
            bank = banks.aged(bank, detected[slot, rows], lit[slot, rows], rules)
            states = GaussianState(*(np.repeat(each, count, axis=0) for each in
                                     (first.mean, first.cov, first.known)))  # fmt: skip
            spread = np.ones((count, 2))
            begun, _ = banks.with_births(
                bank, bank.id == NOBODY, states, new[slot, rows], spread, rules
            )
            return begun

        together = step(together, slice(None))
        alone = [step(bank, slice(trial, trial + 1)) for trial, bank in enumerate(alone)]
        for trial, bank in enumerate(alone):
            for name in ("id", "status", "hits", "tried", "missed", "spread", "next_id"):
                np.testing.assert_array_equal(
                    getattr(together, name)[trial], getattr(bank, name)[0], err_msg=name
                )
