"""Schemes with parameters: what is accepted, what goes before what, what is said of the rest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

import echobeam as eb
from echobeam.faults import InputError
from echobeam.schemes.base import SchemeError
from echobeam.schemes.configure import configure, configure_all, defaults, split, system_for
from echobeam.schemes.covers import halfwidth
from echobeam.schemes.frames import OmniFrame
from echobeam.schemes.registry import available, available_parts, find_part
from echobeam.schemes.trackers import HeldEstimate
from echobeam.testing.conformance import small_scenario

SCENARIO = eb.load_scenario("paper-multi")

USERS = """
from dataclasses import dataclass
import numpy as np
import echobeam as eb
from echobeam.schemes.trackers import ExtendedKalman

@eb.scheme("mine")
@dataclass(frozen=True)
class Mine:
    share: float = 0.5
    shy: bool = False
    def __call__(self, prior, view):
        power = 0.0 if self.shy else self.share * view.system.radio.power
        shape = (*prior.known.shape, view.system.array.n_tx)
        count = max(shape[-2], 1) * shape[-1]
        return np.full(shape, np.sqrt(power / count))

@dataclass(frozen=True)
class Sleepy(ExtendedKalman):
    every: int = 2

plain = object()
"""


@pytest.fixture
def file(tmp_path):
    path = tmp_path / "users.py"
    path.write_text(USERS)
    return path


@pytest.mark.parametrize(
    ("text", "name", "parameters"),
    [
        ("temporal", "temporal", ""),
        ("temporal:ripple=1", "temporal", "ripple=1"),
        ("temporal:ripple=1,width=2", "temporal", "ripple=1,width=2"),
        ("a/b.py:mine", "a/b.py:mine", ""),
        ("a/b.py:mine:share=1", "a/b.py:mine", "share=1"),
        ("temporal:tracker=a/b.py:mine", "temporal", "tracker=a/b.py:mine"),
    ],
)
def test_name_and_parameters_are_told_apart(text, name, parameters):
    assert split(text) == (name, parameters)


def test_a_variant_has_its_own_system_and_a_name_of_its_own():
    found = configure(SCENARIO, "temporal:ripple=0.2 N_t,velocity_std=2 m/s,min_rate=0")
    assert found.name == "temporal:ripple=0.2 N_t,velocity_std=2 m/s,min_rate=0"
    assert found.system.ripple == pytest.approx(6.0)
    assert found.system.filter.velocity_std == 2.0
    assert found.system.coverage.min_rate == 0.0
    assert found.system.filter.angle_std == SCENARIO.filter.angle_std
    assert SCENARIO.coverage.min_rate == 4e-4


def test_the_text_goes_before_the_scenarios_table_and_that_before_its_keys():
    scenario = SCENARIO.replace({"schemes.temporal.ripple": 1, "schemes.temporal.width": 2})
    coverage = configure(scenario, "temporal").system.coverage
    assert (coverage.ripple, coverage.width) == (1.0, 2.0)
    coverage = configure(scenario, "temporal:ripple=5").system.coverage
    assert (coverage.ripple, coverage.width) == (5.0, 2.0)
    assert configure(scenario, "pilot").system.coverage == scenario.coverage


def test_parts_are_exchanged_by_name(file):
    held = configure(SCENARIO, "temporal:tracker=held,frame=omni").scheme
    assert isinstance(held.tracker, HeldEstimate)
    assert isinstance(held.frame, OmniFrame)
    users = configure(SCENARIO, f"temporal:tracker={file}:Sleepy,every=3").scheme
    assert (type(users.tracker).__name__, users.tracker.every) == ("Sleepy", 3)


def test_fields_of_a_scheme_and_of_its_parts_are_parameters(file):
    assert configure(SCENARIO, "temporal:cold_every=3").scheme.beamer.cold_every == 3
    assert configure(SCENARIO, "pilot:cold_every=3").scheme.beamer.beamer.cold_every == 3
    mine = configure(SCENARIO, f"{file}:mine:share=0.25,shy=true")
    assert mine.name == "mine:share=0.25,shy=true"
    assert mine.scheme.beamer.function.share == 0.25
    assert mine.scheme.beamer.function.shy is True


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("temporal:riple=1", ["temporal:riple=1: riple: unknown parameter", "mean 'ripple'"]),
        ("temporal:ripple=-1", ["ripple: -1.0 is negative; expected 0 or more"]),
        ("temporal:width=wide", ["width: 'wide'", "a number"]),
        ("temporal:spread=none", ["spread: 'none'", "'measurement' or 'posterior'"]),
        ("temporal:cold_every=0", ["cold_every: 0 is not accepted; expected 1 or more"]),
        ("temporal:cold_every=x", ["cold_every: 'x'", "a whole number"]),
        ("temporal:aim=up", ["aim: 'up'", "'prior' or 'last'"]),
        ("temporal:tracker=kalman", ["unknown tracker 'kalman'", "ekf, held"]),
        ("temporal:ripple=1,ripple=2", ["ripple is given twice"]),
        ("temporal:ripple=1,width", ["'width' is not accepted; expected KEY=VALUE"]),
        ("temporal:ripple=", ["expected KEY=VALUE"]),
        ("water-filling:ripple=1", ["ripple: unknown parameter"]),
        ("genie:ripple=1", ["ripple: unknown parameter", "accepted here: floors"]),
        ("genie:tracker=ekf", ["tracker: unknown parameter"]),
    ],
)
def test_a_parameter_that_is_none_is_one_clear_message(text, words):
    with pytest.raises(InputError) as caught:
        configure(SCENARIO, text)
    assert all(word in str(caught.value) for word in words), caught.value


def test_a_part_of_another_kind_is_refused(file):
    with pytest.raises(SchemeError, match=r"tracker .*plain' is no tracker: object; expected"):
        configure(SCENARIO, f"temporal:tracker={file}:plain")
    with pytest.raises(SchemeError, match="is no frame: Sleepy; expected an object with mode"):
        configure(SCENARIO, f"temporal:frame={file}:Sleepy")


@pytest.mark.parametrize("kind", ["frame", "tracker", "beamer"])
def test_every_part_that_is_listed_can_be_found(kind):
    for name in available_parts(kind):
        assert find_part(kind, name) is not None


def test_every_default_that_is_listed_is_accepted():
    for name in available():
        given = [f"{key}={value}".replace('"', "") for key, value in defaults(name).items()]
        text = ":".join([name, ",".join(given)]) if given else name
        assert configure(SCENARIO, text).scheme == configure(SCENARIO, name).scheme


def test_variants_run_side_by_side_on_the_same_luck():
    names = ["water-filling", "water-filling:angle_std=1 deg"]
    result = eb.simulate(small_scenario(2), names, trials=3, seed=1)
    assert result["scheme"].values.tolist() == names
    first = result["measured"].isel(slot=0)
    np.testing.assert_array_equal(first.values[0], first.values[1])
    assert not np.array_equal(
        result["estimated"].values[0], result["estimated"].values[1], equal_nan=True
    )


def test_the_system_of_a_result_is_that_of_its_scheme_even_if_its_file_is_gone():
    assert system_for(SCENARIO, "temporal:width=2").coverage.width == 2.0
    assert system_for(SCENARIO, "mine:width=2,share=0.5").coverage.width == 2.0
    assert system_for(SCENARIO, "mine").coverage == SCENARIO.coverage


def test_the_table_of_a_files_scheme_is_found_by_the_name_in_the_result():
    tables = {"dir/covs.py:mine": {"min_rate": 1, "centre": "previous"}}
    scenario = SCENARIO.model_copy(update={"schemes": tuple(tables), "scheme_parameters": tables})
    for name in ("mine", "mine:ripple=2"):
        coverage = system_for(scenario, name).coverage
        assert (coverage.min_rate, coverage.centre) == (1.0, "previous")
    assert system_for(scenario, "mine:ripple=2").coverage.ripple == 2.0
    assert system_for(scenario, "yours").coverage == SCENARIO.coverage


def test_all_that_is_wrong_is_said_at_once():
    wrong = ["temporal:foo=1,ripple=-1,cold_every=0", "nonsense", "pilot:bar=2"]
    with pytest.raises(SchemeError) as fault:
        configure_all(SCENARIO, wrong)
    lines = str(fault.value).splitlines()
    for line, said in zip(
        lines,
        ["foo: unknown", "ripple: -1.0", "cold_every: 0", "'nonsense'", "bar: unknown"],
        strict=True,
    ):
        assert said in line


def test_a_table_that_contradicts_its_own_name_is_refused():
    tables = {"temporal:ripple=5": {"ripple": 1}}
    scenario = SCENARIO.model_copy(update={"schemes": tuple(tables), "scheme_parameters": tables})
    with pytest.raises(SchemeError, match="ripple: 1 in its table contradicts its name"):
        configure_all(scenario, None)


@pytest.mark.parametrize(
    "text",
    [
        "temporal:tracker=held",
        "pilot:beamer=cover",
        "pilot:aim=prior",
        "water-filling:tracker=held",
    ],
)
def test_parts_that_can_only_send_nothing_are_refused(text):
    with pytest.raises(SchemeError, match="predicts nothing, and beams aimed at the prediction"):
        configure(SCENARIO, text)
    assert configure(SCENARIO, "temporal:tracker=held,aim=last").scheme.beamer.aim == "last"
    assert configure(SCENARIO, "temporal:tracker=held,frame=omni")


def test_true_is_no_number():
    with pytest.raises(SchemeError, match="cold_every: True is not accepted; expected a whole"):
        configure(SCENARIO, "temporal:cold_every=true")


def test_a_field_of_a_users_own_goes_before_a_key_of_the_scenario(tmp_path):
    path = tmp_path / "own.py"
    path.write_text(
        "from dataclasses import dataclass\n"
        "@dataclass(frozen=True)\n"
        "class Own:\n"
        "    width: float = 7.0\n"
        "    late: 'Undefined' = 0.5\n"
        "    name: str = 'own'\n"
        "    def __post_init__(self):\n"
        "        if self.late > 1:\n"
        "            raise RuntimeError('late above 1')\n"
        "    def __call__(self, prior, view): ...\n"
    )
    found = configure(SCENARIO, f"{path}:Own:width=2,late=0.25")
    assert found.system.coverage.width == SCENARIO.coverage.width
    function = found.scheme.beamer.function
    assert (function.width, function.late) == (2.0, 0.25)
    with pytest.raises(
        SchemeError, match=r"late: .*own.py, line 9, in __post_init__: RuntimeError: late above 1"
    ):
        configure(SCENARIO, f"{path}:Own:late=2")


def test_two_of_one_name_are_refused():
    with pytest.raises(SchemeError, match="'temporal:ripple=1' is asked for twice"):
        configure_all(SCENARIO, ["temporal:ripple=1", "temporal:ripple=1"])


def test_a_users_own_check_of_a_parameter_is_the_message():
    @dataclass(frozen=True)
    class Careful:
        share: float = 0.5

        def __post_init__(self):
            if not 0 <= self.share <= 1:
                raise ValueError(f"share must lie between 0 and 1, not {self.share}")

        def __call__(self, prior, view):
            return 0.0

    from echobeam.schemes.doors import as_scheme
    from echobeam.schemes.parameters import set_parameter

    with pytest.raises(SchemeError, match="x: share must lie between 0 and 1, not 7"):
        set_parameter(as_scheme(Careful()), "share", "7", "x")


def test_the_cover_is_that_of_the_measurement_or_of_the_prior():
    """l sigma_theta of (38f), at most the widest cover asked for."""
    cov = np.zeros((1, 2, 3, 3))
    cov[0, :, 0, 0] = [0.01**2, 9.0]
    prior = eb.Tracks(np.ones((1, 2, 3)), cov, np.full((1, 2), 2, np.int8), np.array([[0, 1]]))
    measured = np.array([[0.05, 0.02]])
    for text, expected in [
        ("temporal:width=2", [0.1, 0.04]),
        ("temporal:width=2,spread=posterior", [0.02, np.pi / 4]),
        ("temporal:width=30,max_halfwidth=1 rad", [1.0, 0.6]),
    ]:
        covered = halfwidth(prior, measured, configure(SCENARIO, text).system)
        np.testing.assert_allclose(covered, [expected], rtol=1e-15)


@pytest.mark.parametrize(
    "asked",
    [
        "temporal:angle_std=0.1",
        "temporal:evolution=exact",
        "water-filling:distance_std=30",
        "posterior:points=8",
        "posterior:first_points=1000",
        "posterior:iterations=1",
        "posterior:motion=imm",
    ],
)
@pytest.mark.parametrize("detections", ["labelled", "unlabelled"])
def test_parameters_that_only_the_road_reads_are_refused_on_the_ground(asked, detections):
    """As those of [filter] are in a file; on the road they are accepted."""
    ground = eb.load_scenario("ground", {"radar.detections": detections})
    base, _, text = asked.partition(":")
    key, value = text.split("=")
    message = rf'{key}: a parameter only of runs with geometry = "road"'
    with pytest.raises(SchemeError, match=message) as caught:
        configure(ground, asked)
    assert "\n" not in str(caught.value)
    table = ground.replace({"schemes": {base: {key: value}}})
    with pytest.raises(SchemeError, match=message):
        configure(table, base)
    configure(eb.load_scenario("paper-single"), asked)
    with pytest.raises(SchemeError) as unknown:
        configure(ground, f"{base}:nonsense=1")
    assert key not in str(unknown.value)


def test_parameters_of_both_geometries_are_set_on_the_ground():
    made = configure(eb.load_scenario("ground"), "posterior:adaptive=false,velocity_std=2")
    assert made.scheme.tracker.adaptive is False
    assert made.system.filter.velocity_std == 2.0
