"""Schemes and parts that another package plugs in through entry points."""

import numpy as np
import pytest
from click.testing import CliRunner

import echobeam as eb
from echobeam.cli.schemes import command
from echobeam.schemes.base import SchemeError

MODULE = '''
from dataclasses import dataclass

import numpy as np

from echobeam.schemes.beamers import Beams, CoverBeamer
from echobeam.schemes.frames import ClockedFrame
from echobeam.schemes.trackers import DeadReckoning, ExtendedKalman
from echobeam.values import Mode


def quiet(prior, view):
    return np.zeros((*prior.known.shape, view.system.array.n_tx))


@dataclass(frozen=True)
class Same(ExtendedKalman):
    """The filter under another name."""


@dataclass(frozen=True)
class Alternating(ClockedFrame):
    """An omnidirectional slot now and then, in odd trials half a period later."""

    period: int = 4

    def mode(self, known, view):
        odd = np.arange(view.n_trials) % 2
        looks = (view.slot - 1 + odd * (self.period // 2)) % self.period == 0
        return np.where(looks | (view.slot == 1), Mode.OMNI, Mode.DIRECTIONAL).astype(np.int8)


@dataclass(frozen=True)
class Narrow(CoverBeamer):
    """The cover's beamer under another name."""
'''

POINTS = """
[echobeam.schemes]
quiet = plugged_in_here:quiet
broken = plugged_in_here:nothing_of_this_name
[echobeam.trackers]
same = plugged_in_here:Same
number = plugged_in_here:MODE
[echobeam.frames]
alternating = plugged_in_here:Alternating
[echobeam.beamers]
narrow = plugged_in_here:Narrow
"""


@pytest.fixture(autouse=True)
def plugged_in(tmp_path, monkeypatch):
    """A distribution on the path, as an installer leaves it."""
    (tmp_path / "plugged_in_here.py").write_text(MODULE + "\n\nMODE = 3\n")
    info = tmp_path / "plugged_in_here-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: plugged-in-here\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(POINTS)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(__import__("sys").modules, "plugged_in_here", raising=False)


def run(*schemes, **changes):
    scenario = eb.load_scenario("paper-single", changes)
    return eb.simulate(scenario, schemes=list(schemes), trials=4)


def test_a_plugged_in_scheme_runs_by_its_name():
    result = run("quiet")
    assert (result["rate"].isel(slot=slice(1, None)) == 0).all()
    assert (result["rate"].isel(slot=0) > 0).all()


def test_plugged_in_parts_take_the_place_of_our_own_on_the_same_luck():
    result = run("temporal", "temporal:tracker=same", "temporal:beamer=narrow")
    for name in result["scheme"].values[1:]:
        np.testing.assert_array_equal(
            result["estimated"].sel(scheme=name), result["estimated"].sel(scheme="temporal")
        )


def test_trials_of_one_block_may_look_around_in_different_slots():
    result = run("temporal:frame=alternating,period=4")
    modes = result["mode"].isel(scheme=0).to_numpy()
    assert modes[0].tolist() == [0, 1, 1, 1, 0, 1, 1, 1, 0, 1]
    assert modes[1].tolist() == [0, 1, 0, 1, 1, 1, 0, 1, 1, 1]
    phases = result["phase"].isel(scheme=0).values.tolist()
    assert phases[0] == "omni"
    assert phases[1] == "directional"
    assert phases[2] == "mixed"
    rate = result["rate"].isel(scheme=0).sum("object").to_numpy()
    assert rate[0, 2] > 3 * rate[1, 2]  # a beam against an omnidirectional slot


def test_all_are_listed_and_a_broken_one_is_told_of_and_hides_no_other():
    listed = CliRunner().invoke(command).output
    for name in ("quiet", "same", "alternating", "narrow"):
        assert f"{name:16} plugged in: plugged_in_here:" in listed
    assert "cannot be used: AttributeError: " in listed
    assert "(while loading scheme 'broken' from plugged_in_here:nothing_of_this_name)" in listed
    assert "temporal" in listed


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("broken", "^AttributeError: .*while loading scheme 'broken'"),
        ("temporal:tracker=number", "tracker 'number' is no tracker: int; expected an object with"),
        ("temporal:tracker=sames", "unknown tracker 'sames'; did you mean 'same'"),
    ],
)
def test_what_is_broken_or_no_part_is_refused(name, said):
    with pytest.raises(SchemeError, match=said):
        run(name)
