"""Every scheme that is registered passes the kit, and the kit catches those that should not."""

import warnings
from dataclasses import replace

import numpy as np
import pytest

import echobeam as eb
from echobeam.schemes.base import SchemeError
from echobeam.schemes.beamers import MatchedBeamer
from echobeam.schemes.frames import ClockedFrame
from echobeam.schemes.parts import SchemeOfParts
from echobeam.schemes.registry import available
from echobeam.schemes.trackers import ExtendedKalman
from echobeam.testing import check_scheme
from echobeam.testing.conformance import ConformanceError


@pytest.mark.parametrize("geometry", ["road", "ground"])
@pytest.mark.parametrize("name", available())
@pytest.mark.slow
def test_registered_schemes_keep_the_rules(name, geometry):
    check_scheme(name, geometry)


@pytest.mark.parametrize("geometry", ["road", "ground"])
@pytest.mark.slow
def test_a_function_keeps_the_rules_in_either_geometry(geometry):
    def even(prior, view):
        """Matched beams at the prediction, with equal shares of the power."""
        system, axes = view.system, view.system.geometry.axes
        place = system.geometry.place(prior.mean, view.uav)
        aimed = np.where(prior.known[..., None], place, 0.1)
        toward = aimed[..., 0] if axes == 1 else aimed[..., :2]
        power = system.radio.power / max(prior.known.shape[1], 1) / system.transmitter.n
        return np.sqrt(power) * system.transmitter.steering(toward)

    check_scheme(even, geometry)


@pytest.mark.slow
def test_a_scheme_that_sees_the_future_is_caught(monkeypatch):
    """The cheat reads the world over the loop's shoulder."""
    from echobeam.testing import conformance

    seen = {}
    original = conformance.run_slots

    def leaking(world, scheme):
        last = world
        for _ in range(world.scene.scenario.n_slots - 1):
            last = last.advance()
        seen["angle"] = last.state[..., 0]
        return original(world, scheme)

    monkeypatch.setattr(conformance, "run_slots", leaking)

    def cheat(prior, view):
        shape = (*prior.known.shape, view.system.array.n_tx)
        return np.broadcast_to(0.01 * np.sum(seen["angle"]), shape)

    with pytest.raises(ConformanceError, match="the truth bent after slot"):
        check_scheme(cheat)


@pytest.mark.slow
def test_a_scheme_that_reads_the_truth_out_of_variances_is_caught():
    """var_tau / var_theta = xi^2 / kappa^2 is a function of cos^2(theta) alone."""

    class Cheat:
        def start(self, view):
            return ExtendedKalman().start(view)

        def predict(self, belief, view):
            return ExtendedKalman().predict(belief, view)

        def update(self, prior, detections, view):
            honest = ExtendedKalman().update(prior, detections, view)
            n, kappa = view.system.array.n_tx, view.system.law.bandwidth
            with np.errstate(invalid="ignore"):  # objects that were not measured
                ratio = detections.variance[..., 1] / detections.variance[..., 0]
                cosine = np.sqrt(ratio * kappa**2 * 12 / (np.pi**2 * (n**2 - 1)))
                angle = np.arccos(np.clip(cosine, 0.0, 1.0))
            mean = honest.state.mean.copy()
            behind = mean[..., 0] > np.pi / 2
            mean[..., 0] = np.where(
                np.isfinite(angle), np.where(behind, np.pi - angle, angle), mean[..., 0]
            )
            return replace(honest, state=replace(honest.state, mean=mean))

    cheat = SchemeOfParts("cheat", ClockedFrame(), Cheat(), MatchedBeamer(aim="last"))
    with pytest.raises(ConformanceError, match="reads the truth out of the variances"):
        check_scheme(cheat)


@pytest.mark.slow
def test_a_filter_that_is_handed_the_true_angle_is_caught():
    """The measurement is put right before an honest filter sees it; only slot 2 is exact."""

    class Cheat(ExtendedKalman):
        def update(self, prior, detections, view):
            n, kappa = view.system.array.n_tx, view.system.law.bandwidth
            value, variance = detections.value.copy(), detections.variance.copy()
            with np.errstate(invalid="ignore"):  # objects that were not measured
                cosine = np.sqrt(
                    variance[..., 1] / variance[..., 0] * kappa**2 * 12 / (np.pi**2 * (n**2 - 1))
                )
                angle = np.arccos(np.clip(cosine, 0.0, 1.0))
                behind = value[..., 0] > np.pi / 2
                value[..., 0] = np.where(behind, np.pi - angle, angle)
                value[..., 1] = 2.0 * view.uav.position[2] / np.sin(angle) / 299792458.0
            variance *= np.array([1e-6, 1e-6, 1.0])
            put_right = replace(detections, value=value, variance=variance)
            return super().update(prior, put_right, view)

    cheat = SchemeOfParts("cheat", ClockedFrame(), Cheat(), MatchedBeamer())
    with pytest.raises(ConformanceError, match="estimates of distance of slot 1 follow the truth"):
        check_scheme(cheat)


def test_a_track_that_passes_to_another_object_is_caught():
    """The mutant that never forgets when a column has a new occupant."""

    class Faithful(ExtendedKalman):
        def predict(self, belief, view):
            return super().predict(replace(belief, id=view.roster), view)

    keeps = SchemeOfParts("keeps", ClockedFrame(), Faithful(), MatchedBeamer())
    with pytest.raises(ConformanceError, match="before the first detection"):
        check_scheme(keeps)


def test_beams_for_objects_that_left_are_caught_by_the_loop():
    """A decision for more tracks than there are, or for one that is none."""

    class Stubborn(SchemeOfParts):
        def transmit(self, prior, view):
            decision = super().transmit(prior, view)
            return replace(decision, addressee=np.full_like(decision.addressee, 17))

    stubborn = Stubborn("stubborn", ClockedFrame(), ExtendedKalman(), MatchedBeamer())
    with pytest.raises(SchemeError, match="addresses a stream to 17 in slot 1"):
        check_scheme(stubborn)


def test_a_scheme_with_luck_of_its_own_is_caught():
    generator = np.random.default_rng(1)

    def moody(prior, view):
        return 0.01 * generator.standard_normal((*prior.known.shape, view.system.array.n_tx))

    with pytest.raises(ConformanceError, match="the same seed"):
        check_scheme(moody)


def test_too_much_power_is_caught():
    def strong(prior, view):
        shape = (*prior.known.shape, view.system.array.n_tx)
        return np.full(shape, 2 * np.sqrt(view.system.radio.power))

    with pytest.raises(SchemeError, match="radiates"):
        check_scheme(strong)


def test_numbers_that_are_none_are_caught():
    def undefined(prior, view):
        return np.full((*prior.known.shape, view.system.array.n_tx), np.nan)

    with pytest.raises(SchemeError, match="not finite"):
        check_scheme(undefined)


@pytest.mark.slow
def test_trials_that_learn_from_each_other_are_caught():
    """All trials have one truth; the mean of their measurements is next to it."""

    class Pooled(ExtendedKalman):
        def update(self, prior, detections, view):
            with np.errstate(invalid="ignore"), warnings.catch_warnings():
                warnings.simplefilter("ignore", RuntimeWarning)  # nobody was measured
                mean = np.nanmean(detections.value, axis=0)
            pooled = np.where(np.isfinite(detections.value), mean, np.nan)
            return super().update(prior, replace(detections, value=pooled), view)

    pooled = SchemeOfParts("pooled", ClockedFrame(), Pooled(), MatchedBeamer())
    with pytest.raises(ConformanceError, match="depends on the trials beside it"):
        check_scheme(pooled)


def test_a_scheme_that_looks_at_the_place_of_a_trial_is_caught():
    def by_row(prior, view):
        shape = (*prior.known.shape, view.system.array.n_tx)
        return np.broadcast_to(0.01 * np.arange(len(prior.id))[:, None, None], shape)

    with pytest.raises(ConformanceError, match="depends on the trials beside it"):
        check_scheme(by_row)


@pytest.mark.parametrize("reach", ["uav.velocity", "roster", "uav_before.position"])
def test_nature_is_out_of_a_schemes_reach(reach):
    """Writing into what a scheme is shown is an error of its own."""

    def vandal(prior, view):
        array = view
        for name in reach.split("."):
            array = getattr(array, name)
        array[..., 0] = 7
        return np.zeros((*prior.known.shape, view.system.array.n_tx))

    with pytest.raises(SchemeError, match=r"ValueError: assignment destination is read-only"):
        check_scheme(vandal)


def test_the_roster_of_a_trace_holds_this_slot_alone():
    sizes = []

    def curious(prior, view):
        base = view.roster if view.roster.base is None else view.roster.base
        sizes.append(base.size == view.roster.size)
        return np.zeros((*prior.known.shape, view.system.array.n_tx))

    eb.simulate(eb.load_scenario("traffic", {"frame.frames": 1}), schemes=[curious], trials=2)
    assert sizes
    assert all(sizes)


def test_what_a_scheme_is_given_does_not_hold_the_seed():
    """With the seed a scheme could draw nature's noise and subtract it."""
    seed, found = 987654321, []

    def search(prior, view):
        found.append(str(seed) in repr(view) or seed == getattr(view.normals, "key", seed))
        return np.zeros((*prior.known.shape, view.system.array.n_tx))

    eb.simulate("paper-single", schemes=[search], trials=1, seed=seed)
    assert found
    assert not any(found)
