"""Every scheme that is registered passes the kit, and the kit catches those that should not."""

import numpy as np
import pytest

from echobeam.schemes.base import SchemeError
from echobeam.schemes.registry import available
from echobeam.testing import check_scheme
from echobeam.testing.conformance import ConformanceError


@pytest.mark.parametrize("name", available())
def test_registered_schemes_keep_the_rules(name):
    check_scheme(name)


def test_a_scheme_that_sees_the_future_is_caught(monkeypatch):
    """The cheat reads the world over the loop's shoulder."""
    from echobeam.testing import conformance

    seen = {}
    original = conformance.run_slots

    def leaking(scenario, scheme, world):
        seen["angle"] = world.motion.truth[:, -1, :, 0]
        return original(scenario, scheme, world)

    monkeypatch.setattr(conformance, "run_slots", leaking)

    def cheat(prior, view):
        shape = (*prior.known.shape, view.system.array.n_tx)
        return np.broadcast_to(0.01 * np.sum(seen["angle"]), shape)

    with pytest.raises(ConformanceError, match="the truth bent after slot"):
        check_scheme(cheat)


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
