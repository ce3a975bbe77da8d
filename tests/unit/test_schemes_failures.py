"""Faults of users' code: the line that is named, and the traceback that is printed."""

import pickle

import numpy as np
import pytest

import echobeam as eb
from echobeam.faults import RunError
from echobeam.schemes.base import SchemeError, SchemeRunError
from echobeam.schemes.failures import failure, is_users, users_traceback
from echobeam.schemes.registry import find_scheme
from echobeam.testing.conformance import small_scenario

SOURCE = """\
import json

def read(text):
    return json.loads(text)

def beams(prior, view):
    return read("{")
"""


def caught(run, *arguments):
    """Return what a call raises, as if echobeam had made it."""
    with pytest.raises(BaseException) as caught:  # noqa: PT011
        run(*arguments)
    return caught.value.with_traceback(caught.value.__traceback__.tb_next)


def module(path, name="beams"):
    """Return a function of a file, under the file's own name."""
    space: dict[str, object] = {}
    exec(compile(path.read_text(), str(path), "exec"), space)
    return space[name]


def test_the_line_is_the_users_own_and_not_the_librarys(tmp_path, monkeypatch):
    path = tmp_path / "mine.py"
    path.write_text(SOURCE)
    error = caught(module(path), None, None)
    assert is_users(error)
    assert failure(error).startswith(f"{path}, line 4, in read: JSONDecodeError: Expecting")
    monkeypatch.chdir(tmp_path)
    assert failure(error).startswith("mine.py, line 4, in read: ")


def test_the_traceback_begins_where_the_user_does_and_goes_to_the_end(tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(SOURCE)
    with pytest.raises(SchemeError) as caught:
        eb.simulate(small_scenario(2), [f"{path}:beams"], trials=1)
    lines = caught.value.details.splitlines()
    files = [line.split('"')[1] for line in lines if line.startswith("  File")]
    assert files[:2] == [str(path), str(path)]
    assert files[-1].endswith("decoder.py")
    assert lines[-1].startswith("json.decoder.JSONDecodeError: Expecting")


def test_a_plugged_in_scheme_is_named_by_its_own_line_and_not_by_what_it_calls(tmp_path):
    """Both are installed packages."""
    own, other = (tmp_path / "site-packages" / name / "code.py" for name in ("mine", "other"))
    for path in (own, other):
        path.parent.mkdir(parents=True)
    other.write_text("def beams(prior, view):\n    return 1 / 0\n")
    own.write_text("def beams(prior, view):\n    return prior(None, None)\n")
    error = caught(module(own), module(other), None)
    assert failure(error) == f"{own}, line 2, in beams: ZeroDivisionError: division by zero"


def test_a_fault_of_our_own_is_no_users():
    assert not is_users(caught(find_scheme, None))


@pytest.mark.parametrize(
    ("source", "words"),
    [
        pytest.param("x = 1\ndef f(:\n", "mine.py, line 2: SyntaxError: ", id="syntax"),
        pytest.param("\n\nimport nowhere_at_all\n", "line 3: ModuleNotFoundError: ", id="import"),
        pytest.param("from math import nothing\n", "line 1: ImportError: ", id="name"),
        pytest.param("def f():\n\treturn 1\n        x\n", "mine.py, line 3: TabError", id="tabs"),
        pytest.param("import sys\nsys.exit('bye')\n", "line 2: SystemExit: bye", id="exit"),
        pytest.param(b"x = '\xff'\n", "mine.py, line 1: SyntaxError: ", id="no text"),
        pytest.param("def g():\n    1 / 0\ng()\n", "line 2, in g: ZeroDivisionError", id="calls"),
        pytest.param("class f:\n    def __init__(self, n): pass\n", "TypeError: ", id="made"),
    ],
)
def test_a_file_that_cannot_be_used_is_named_with_its_line(tmp_path, source, words):
    path = tmp_path / "mine.py"
    path.write_bytes(source if isinstance(source, bytes) else source.encode())
    with pytest.raises(SchemeError) as caught:
        find_scheme(f"{path}:f")
    assert words in str(caught.value)
    assert "(while " in str(caught.value)
    assert "registry.py" not in caught.value.details
    assert type(caught.value.__cause__).__name__ in caught.value.details
    assert not isinstance(caught.value, RunError)


def test_in_python_the_original_is_chained_and_names_scheme_slot_and_trials():
    class DeepError(Exception):
        pass

    def mine(prior, view):
        raise DeepError("down here")

    with pytest.raises(SchemeRunError) as caught:
        eb.simulate(small_scenario(2), [mine], trials=5)
    assert isinstance(caught.value.__cause__, DeepError)
    words = "in mine: DeepError: down here (scheme 'mine', transmit of slot 2, trials 0 to 4)"
    assert str(caught.value).endswith(words)
    assert isinstance(caught.value, RunError)
    with pytest.raises(SchemeRunError, match=r"transmit of slot 2, trial 3\)"):
        list(eb.slots(small_scenario(2), mine, trial=3))


def test_a_wrong_answer_is_a_failure_of_the_run_too():
    with pytest.raises(SchemeRunError, match=r"beams of shape \(7,\)") as caught:
        eb.simulate(small_scenario(2), [lambda prior, view: np.zeros(7)], trials=1)
    assert isinstance(caught.value, RunError)


class Blunt(BaseException):
    pass


def blunt(prior, view):
    raise Blunt("of no ordinary kind")


def test_exceptions_of_any_kind_but_an_interruption_become_a_message():
    with pytest.raises(SchemeRunError, match="Blunt: of no ordinary kind"):
        eb.simulate(small_scenario(2), [blunt], trials=1)

    def interrupting(prior, view):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        eb.simulate(small_scenario(2), [interrupting], trials=1)


def test_a_scheme_whose_answers_make_our_code_fail_is_named():
    """A prior that is none, in a scheme of parts."""

    class Odd(type(find_scheme("temporal").tracker)):
        def predict(self, belief, view):
            prior = super().predict(belief, view)
            return type("Prior", (), {"tracks": prior.tracks})()

    scheme = eb.SchemeOfParts("odd", find_scheme("temporal").frame, Odd(), None)
    with pytest.raises(SchemeRunError, match=r"AttributeError: .*scheme 'odd'"):
        eb.simulate(small_scenario(2), [scheme], trials=1)


def test_a_failure_survives_the_way_from_another_process():
    made = SchemeRunError("what", "Traceback: all of it")
    again = pickle.loads(pickle.dumps(made))  # within this process
    assert (str(again), again.details, type(again)) == (str(made), made.details, SchemeRunError)


def test_the_traceback_of_what_is_not_the_users_is_whole():
    error = caught(find_scheme, None)
    assert "registry.py" in users_traceback(error)


class UnprintableError(Exception):
    def __str__(self):
        raise ValueError("no text")


def unprintable(prior, view):
    raise UnprintableError


def stopping(prior, view):
    raise StopIteration


def closing(prior, view):
    raise GeneratorExit


def piping(prior, view):
    raise BrokenPipeError


def endless(prior, view):
    return endless(prior, view)


def writing(prior, view):
    prior.mean[...] = 0.0


def nested(prior, view):
    return eb.BeamProblem([1.0], [1.0], [0.1], -3.0, 0.0, 1.0, 1.0, 4)


@pytest.mark.parametrize(
    ("function", "words"),
    [
        (unprintable, "in unprintable: UnprintableError: without a text"),
        (stopping, "in stopping: StopIteration"),
        (closing, "in closing: GeneratorExit"),
        (piping, "in piping: BrokenPipeError"),
        (endless, "in endless: RecursionError: "),
        (writing, "in writing: ValueError: assignment destination is read-only"),
        (nested, "in nested: ProblemError: ripple must not be negative"),
    ],
)
def test_whatever_is_raised_names_scheme_slot_and_trial(function, words):
    with pytest.raises(SchemeRunError, match=rf"{words}.*\(scheme '\w+', transmit of slot 2, tr"):
        eb.simulate(small_scenario(2), [function], trials=1)


class Whole:
    omniscient = False

    def __init__(self, name):
        self.name = name

    def start(self, view):
        return None

    predict = transmit = update = start


@pytest.mark.parametrize("name", [None, "", 3])
def test_a_scheme_needs_a_name(name):
    with pytest.raises(SchemeError, match=r"its name is .*; expected a text"):
        eb.simulate(small_scenario(2), [Whole(name)], trials=1)


def test_a_scheme_whose_name_raises_is_one_message():
    class Nameless(Whole):
        name = property(lambda self: 1 / 0, lambda self, name: None)

    with pytest.raises(
        SchemeError, match=r"ZeroDivisionError: .*while making a scheme of Nameless"
    ):
        eb.simulate(small_scenario(2), [Nameless("x")], trials=1)
