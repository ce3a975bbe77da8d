from dataclasses import dataclass, replace

import numpy as np
import pytest

import echobeam as eb
from echobeam.schemes.base import SchemeError
from echobeam.schemes.doors import as_scheme, scheme
from echobeam.schemes.registry import available, find_scheme
from echobeam.schemes.water_filling import WATER_FILLING
from echobeam.testing.conformance import small_scenario

SOURCE = """
import numpy as np
import echobeam as eb

@eb.scheme("aimed")
def my_function(prior, view):
    n = view.system.array.n_tx
    u = np.sin(prior.mean[..., 0, None]) * np.arange(n)
    share = view.system.radio.power / (n * prior.mean.shape[-2])
    return np.sqrt(share) * np.exp(1j * np.pi * u)

def unmarked(prior, view):
    return my_function(prior, view)

def silent(prior, view):
    return np.zeros((*prior.known.shape, view.system.array.n_tx))

def loud(prior, view):
    return 100 * my_function(prior, view)

def raising(prior, view):
    raise KeyError("no such thing")

def shapeless(prior, view):
    return np.zeros(7)

def endless(prior, view):
    return 1e200 * my_function(prior, view)

def narrow(prior):
    return 0

class Shy:
    def __call__(self):
        return 0

number = 7
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(SOURCE)
    return path


def test_a_marked_function_is_found_by_its_schemes_name(file):
    assert find_scheme(f"{file}:aimed").name == "aimed"
    assert find_scheme(f"{file}:unmarked").name == "unmarked"


def test_a_function_gets_the_frame_and_the_filter_for_free(file):
    result = eb.simulate(small_scenario(2), [f"{file}:aimed", "omni"], trials=3, seed=1)
    assert (
        result["phase"].sel(scheme="aimed").values.tolist() == (["omni"] + ["directional"] * 3) * 2
    )
    gain = (result["rate"].sel(scheme="aimed") / result["rate"].sel(scheme="omni")).mean("trial")
    assert (gain.isel(slot=[2, 3]) > 1).all()
    assert np.isfinite(result["estimated"].values).all()


def test_unserved_objects_have_rate_zero(file):
    result = eb.simulate(small_scenario(2), [f"{file}:silent"], trials=2)
    directional = result["phase"].values[0] == "directional"
    assert (result["rate"].values[0][:, directional] == 0).all()
    assert np.isinf(result["measured_var"].values[0][:, directional]).all()


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("loud", "radiates"),
        ("endless", "radiates inf"),
        (
            "raising",
            r"mine.py, line 22, in raising: KeyError: 'no such thing' "
            r"\(scheme 'raising', transmit of slot 2, trial 0\)",
        ),
        ("shapeless", r"expected \(..., K, N\)"),
    ],
)
def test_a_scheme_that_breaks_the_rules_is_named(file, name, word):
    with pytest.raises(SchemeError, match=word):
        eb.simulate(small_scenario(2), [f"{file}:{name}"], trials=1)


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("{file}:nothing", "no scheme or object 'nothing'"),
        ("{file}:number", r"mine.py:number: 7 is not a scheme"),
        ("{file}:narrow", r"mine.py, line 30: scheme 'narrow' is called with \(prior, view\): too"),
        ("{file}:Shy", r"scheme 'Shy' is called with \(prior, view\): too many"),
        ("mine.py", "of a file the scheme's name too, mine.py:NAME"),
        ("nowhere.py:x", "no such file"),
        ("temproal", "did you mean 'temporal'"),
        ("", "unknown scheme"),
    ],
)
def test_a_scheme_that_is_not_there(file, name, word):
    with pytest.raises(SchemeError, match=word):
        find_scheme(name.format(file=file))


def test_a_file_that_raises_is_one_message(tmp_path):
    path = tmp_path / "broken.py"
    path.write_text("raise RuntimeError('boom')")
    with pytest.raises(
        SchemeError, match=r"broken.py, line 1: RuntimeError: boom \(while importing"
    ):
        find_scheme(f"{path}:x")
    path.write_text("def f(:")
    with pytest.raises(SchemeError, match=r"broken.py, line 1: SyntaxError"):
        find_scheme(f"{path}:f")


WHOLE = """
import sys
from dataclasses import dataclass
import numpy as np
import echobeam as eb
from echobeam.schemes.frames import ClockedFrame
from echobeam.schemes.trackers import ExtendedKalman
from echobeam.schemes.beamers import MatchedBeamer

def scheme_of(name, frame=ClockedFrame(), tracker=ExtendedKalman()):
    return eb.SchemeOfParts(name, frame, tracker, MatchedBeamer())

class Raising(ExtendedKalman):
    def update(self, prior, detections, view):
        raise KeyError("gone")

class Writing(ExtendedKalman):
    def update(self, prior, detections, view):
        detections.value[...] = 7
        return prior

class Trackless(ExtendedKalman):
    def predict(self, belief, view):
        return 7

class Unphased(ClockedFrame):
    def mode(self, tracks, view):
        return np.full(view.n_trials, 9, dtype=np.int8)

def leaving(prior, view):
    sys.exit(5)

def silent(prior, view):
    return None

@eb.scheme("par")
@dataclass(frozen=True)
class Parametrised:
    share: float
    def __call__(self, prior, view):
        return self.share * np.ones((*prior.known.shape, view.system.array.n_tx))

half = Parametrised(0.1)
"""


@pytest.mark.parametrize(
    ("name", "word"),
    [
        ("scheme_of('r', tracker=Raising())", r"s.py, line 15, in update: KeyError: 'gone'"),
        ("scheme_of('w', tracker=Writing())", "in update: ValueError: .*read-only"),
        ("scheme_of('t', tracker=Trackless())", "belief of type int from predict.*no tracks"),
        ("scheme_of('u', frame=Unphased())", r"frame Unphased: mode is 9; expected 0 \(omni\)"),
        ("leaving", r"in leaving: SystemExit: 5 \(.*transmit of slot 2"),
        ("silent", "returned nothing in slot 2"),
    ],
)
def test_whatever_a_users_scheme_does_is_one_message(tmp_path, name, word):
    space: dict[str, object] = {"__name__": "a_users_module"}
    exec(compile(WHOLE, "s.py", "exec"), space)
    candidate = eval(name, space)
    with pytest.raises(SchemeError, match=word):
        eb.simulate(small_scenario(1), [candidate], trials=1)


def test_objects_with_parameters_are_found_before_their_class(tmp_path):
    (tmp_path / "s.py").write_text(WHOLE)
    assert find_scheme(f"{tmp_path / 's.py'}:half").name == "par"
    assert find_scheme(f"{tmp_path / 's.py'}:par").name == "par"


def test_an_object_with_parameters_is_a_scheme():
    @scheme("backed-off")
    @dataclass(frozen=True)
    class BackedOff:
        share: float = 0.5

        def __call__(self, prior, view):
            return self.share * np.ones((*prior.known.shape, view.system.array.n_tx)) / 10

    assert as_scheme(BackedOff(0.25)).name == "backed-off"
    assert as_scheme(BackedOff).name == "backed-off"


def test_a_whole_scheme_is_taken_as_it_is():
    whole = replace(WATER_FILLING, name="mine")
    assert as_scheme(whole) is whole


def test_every_scheme_that_is_listed_can_be_found():
    for name in available():
        assert find_scheme(name).name == name


def test_the_same_scheme_twice_is_refused():
    with pytest.raises(SchemeError, match="twice"):
        eb.simulate(small_scenario(1), ["omni", "omni"], trials=1)
    with pytest.raises(SchemeError, match="at least one"):
        eb.simulate(small_scenario(1), [], trials=1)
