"""Results that users have cut: what is read by place, and what is made slot by slot."""

from __future__ import annotations

import numpy as np
import pytest

import echobeam as eb
from echobeam.simulation.layout import disorder, from_the_beginning
from echobeam.simulation.statistics import of_scheme, rmse
from echobeam.simulation.summary import improvement, over_bound, result_statistics


@pytest.fixture(scope="module")
def whole():
    return eb.simulate("paper-multi", ["temporal", "pilot"], trials=3)


@pytest.mark.parametrize(
    ("cut", "words"),
    [
        ({"state": [2, 1, 0]}, "state is velocity, distance, angle; expected angle, distance, vel"),
        ({"measurement": [0, 2, 1]}, "measurement is angle, doppler, delay"),
        ({"part": [1, 0]}, "part is im, re"),
        ({"slot": [0, 2, 4]}, "its slots are 1, 3, 5; expected slots that follow each other"),
        ({"slot": slice(None, None, -1)}, "its slots are 10, 9, 8, 7, ...; expected"),
        ({"scheme": [1, 1]}, "scheme 'pilot' is there twice"),
        ({"scheme": []}, "nothing along the dimension scheme"),
        ({"antenna": slice(7)}, "7 along the dimension antenna; expected 30"),
        ({"trial": []}, "nothing along the dimension trial"),
    ],
    ids=str,
)
def test_labels_that_contradict_their_places_are_found(whole, cut, words):
    assert words in disorder(whole.isel(cut))


def test_schemes_are_named_by_texts(whole):
    assert disorder(whole.assign_coords(scheme=[1, 2])) == "a scheme is named 1; expected texts"


@pytest.mark.parametrize("cut", [{}, {"trial": [2, 0]}, {"scheme": [1]}, {"slot": slice(3, 6)}])
def test_cuts_that_leave_places_as_they_were_are_in_order(whole, cut):
    assert disorder(whole.isel(cut)) == ""
    assert disorder(whole.isel(cut).drop_vars(["state", "slot", "scheme"])) == ""


def test_slots_after_the_first_have_neither_a_bound_nor_the_headline(whole):
    """The bound is made slot by slot from the first one on, the headline is that of slot 6."""
    scenario = eb.load_scenario("paper-multi")
    late, early = whole.isel(slot=slice(4, None)), whole.isel(slot=slice(0, 6))
    assert (from_the_beginning(late), from_the_beginning(early)) == (False, True)
    assert improvement(late) is None
    assert improvement(early).ratio == improvement(whole).ratio
    parts = [of_scheme(result_statistics(one, scenario), 0) for one in (whole, early, late)]
    ratios = [over_bound(part, "angle", scenario) for part in parts]
    np.testing.assert_allclose(ratios[1], ratios[0][:6])
    assert np.isnan(ratios[2]).all()
    np.testing.assert_allclose(rmse(parts[2], "angle"), rmse(parts[0], "angle")[4:])


def test_trials_have_numbers_which_a_cut_result_keeps(whole):
    np.testing.assert_array_equal(whole.coords["trial"], [0, 1, 2])
    np.testing.assert_array_equal(whole.isel(trial=[2]).coords["trial"], [2])
    assert disorder(whole.isel(trial=[2])) == ""
    named = whole.assign_coords(trial=["a", "b", "c"])
    assert disorder(named) == "its trials are a, b, c; expected whole numbers"
