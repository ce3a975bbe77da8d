"""The beamer `posterior` as a part of schemes."""

from dataclasses import replace

import numpy as np
import pytest

import echobeam as eb
from echobeam.scenario.load import load_scenario
from echobeam.schemes.base import SchemeError
from echobeam.schemes.beamers import Aim, MatchedBeamer
from echobeam.schemes.configure import configure, system_of
from echobeam.schemes.posterior_beamer import PosteriorBeamer, belief_of
from echobeam.values import Status, Tracks


def tracks(angle, deviation, distance=100.0, correlation=0.0):
    """Return tracks ``(1, C)`` in (angle, distance, velocity)."""
    angle = np.asarray(angle, dtype=float)[None]
    cov = np.zeros((*angle.shape, 3, 3))
    cov[..., 0, 0] = np.asarray(deviation) ** 2
    cov[..., 1, 1] = cov[..., 2, 2] = 1.0
    if correlation:
        cov[..., 0, 1] = cov[..., 1, 0] = correlation * np.asarray(deviation)
    mean = np.stack([angle, np.full_like(angle, distance), np.zeros_like(angle)], axis=-1)
    status = np.full(angle.shape, Status.CONFIRMED, dtype=np.int8)
    return Tracks(mean, cov, status, np.arange(angle.size)[None])


def view_and_aim(prior, scenario):
    """Return the slot's view, as far as a beamer reads it, and aim."""
    view = eb.View(
        slot=2,
        uav=None,
        uav_before=None,
        system=system_of(scenario),
        roster=prior.id,
        memory=None,
        normals=None,
    )
    spread = np.full(prior.id.shape, np.nan)
    return view, Aim(prior, prior, spread, np.ones(1, dtype=bool))


def test_without_uncertainty_the_beam_is_the_matched_beamers():
    view, aim = view_and_aim(tracks([1.0], 0.0), load_scenario("paper-single"))
    ours, matched = PosteriorBeamer().beams(aim, view), MatchedBeamer().beams(aim, view)
    turn = np.vdot(ours.beams, matched.beams)
    np.testing.assert_allclose(ours.beams * turn / abs(turn), matched.beams, atol=1e-10)
    assert np.isnan(ours.covered).all()
    assert not ours.fallback.any()


def test_the_belief_of_tracks():
    deviation, stretch = belief_of(tracks([1.0, 2.0, 1.0], [0.01, 0.0, 2.0], 50.0, 0.5))
    np.testing.assert_allclose(deviation, [[0.01, 0.0, np.pi / 4]])
    np.testing.assert_allclose(stretch, [[0.5 / 0.01 / 50.0, 0.0, 0.5 / 2.0 / 50.0]])


def test_an_angle_of_no_known_size_is_covered_as_far_as_beliefs_go():
    prior = tracks([1.0], np.inf)
    view, aim = view_and_aim(prior, load_scenario("paper-single"))
    made = PosteriorBeamer().beams(aim, view)
    assert np.isfinite(made.beams).all()
    assert not made.fallback.any()
    assert np.sum(np.abs(made.beams) ** 2) == pytest.approx(view.system.radio.power)


def test_tracks_that_are_not_served_get_no_beams():
    prior = tracks([1.0, 2.0], 0.01)
    status = prior.status.copy()
    status[0, 1] = Status.NONE
    mean = np.where(status[..., None] > 0, prior.mean, np.nan)
    prior = replace(prior, status=status, mean=mean)
    view, aim = view_and_aim(prior, load_scenario("paper-single"))
    made = PosteriorBeamer().beams(aim, view)
    assert np.isfinite(made.beams).all()
    assert not made.beams[0, 1].any()
    assert not made.fallback.any()
    nobody = replace(aim, active=np.zeros(1, dtype=bool))
    assert not PosteriorBeamer().beams(nobody, view).beams.any()


def test_the_outage_is_a_parameter_and_has_to_be_one():
    scenario = load_scenario("paper-multi")
    found = configure(scenario, "water-filling:beamer=posterior,outage=0.1,min_rate=1e-4")
    assert found.scheme.beamer.outage == 0.1
    assert found.system.coverage.min_rate == 1e-4
    with pytest.raises(SchemeError, match="outage"):
        configure(scenario, "water-filling:beamer=posterior,outage=1.5")
