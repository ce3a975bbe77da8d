"""Schemes of a scenario: a list of names, or a table of parameters for each."""

import pickle
import tomllib

import pytest

from echobeam.scenario import ScenarioError, load_scenario, preset_text
from echobeam.scenario.checking import checked
from echobeam.scenario.model import Scenario


def again(scenario):
    """Return the scenario that its own text gives."""
    return checked(Scenario, tomllib.loads(scenario.to_toml()), "dumped")


def test_schemes_may_be_tables_of_their_parameters(tmp_path):
    file = tmp_path / "mine.toml"
    text = preset_text("paper-multi")
    listed = next(line for line in text.splitlines() if line.startswith("schemes = "))
    tables = '[schemes.pilot]\n[schemes.temporal]\nripple = 1\nvelocity_std = "2 m/s"\n'
    file.write_text(text.replace(listed, "") + tables)
    scenario = load_scenario(file)
    assert scenario.schemes == ("pilot", "temporal")
    parameters = {"pilot": {}, "temporal": {"ripple": 1, "velocity_std": "2 m/s"}}
    assert scenario.scheme_parameters == parameters
    assert checked(Scenario, tomllib.loads(scenario.to_toml()), "dumped") == scenario
    same = load_scenario(
        "paper-multi",
        ["schemes=['pilot', 'temporal']", "schemes.temporal.ripple=1",
         "schemes.temporal.velocity_std=2 m/s"],
    )  # fmt: skip
    assert same.scheme_parameters == parameters


def test_a_list_of_names_has_no_parameters():
    scenario = load_scenario("paper-multi")
    assert scenario.scheme_parameters == {}
    assert (
        'schemes = ["temporal", "pilot", "water-filling", "posterior", "genie"]'
        in scenario.to_toml()
    )
    assert "[schemes" not in scenario.to_toml()


def test_a_parameter_turns_the_list_into_tables():
    scenario = load_scenario("paper-single", ["schemes.pilot.ripple=1"])
    assert scenario.schemes == load_scenario("paper-single").schemes
    assert list(scenario.scheme_parameters) == list(scenario.schemes)
    assert scenario.scheme_parameters["pilot"] == {"ripple": 1}
    assert scenario.scheme_parameters["temporal"] == {}
    assert again(scenario) == scenario
    both = scenario.replace({"schemes.temporal.width": 2.5, "schemes.pilot.ripple": "0.5 N_t"})
    assert both.scheme_parameters["pilot"] == {"ripple": "0.5 N_t"}
    assert both.scheme_parameters["temporal"] == {"width": 2.5}


def test_a_file_without_schemes_has_the_default_ones_to_give_parameters_to(tmp_path):
    file = tmp_path / "short.toml"
    file.write_text('name = "short"\n')
    scenario = load_scenario(file, ["schemes.pilot.ripple=1"])
    assert scenario.schemes == load_scenario(file).schemes
    assert scenario.scheme_parameters["pilot"] == {"ripple": 1}


def test_another_list_of_schemes_drops_the_parameters():
    scenario = load_scenario("paper-multi", ["schemes.temporal.ripple=1"])
    for other in (
        scenario.replace({"schemes": ["pilot"]}),
        scenario.model_copy(update={"schemes": ("pilot",)}),
    ):
        assert (other.schemes, other.scheme_parameters) == (("pilot",), {})
        assert again(other) == other


def test_parameters_keep_type_and_order_in_the_text():
    tables = {"b": {"flag": True, "one": 1, "real": 1.0, "text": "2 m/s"}, "a": {}}
    scenario = checked(Scenario, {"name": "x", "schemes": tables}, "x")
    found = again(scenario).scheme_parameters
    assert found == tables
    assert list(found) == ["b", "a"]
    assert [type(value) for value in found["b"].values()] == [bool, int, float, str]


def test_names_that_are_no_bare_keys_are_quoted():
    tables = {"cloud.py:particles": {"a b": 1, 'quoted"': 2, "": 3}}
    scenario = checked(Scenario, {"name": "x", "schemes": tables}, "x")
    assert '[schemes."cloud.py:particles"]' in scenario.to_toml()
    assert again(scenario).scheme_parameters == tables


def test_parameters_are_frozen_and_travel():
    scenario = load_scenario("paper-multi", ["schemes.temporal.ripple=1"])
    with pytest.raises(TypeError):
        scenario.scheme_parameters["temporal"]["ripple"] = 5
    with pytest.raises(TypeError):
        scenario.scheme_parameters["pilot"] = {}
    copy = pickle.loads(pickle.dumps(scenario))
    assert copy == scenario
    assert hash(copy) == hash(scenario)
    assert scenario != load_scenario("paper-multi", ["schemes.temporal.ripple=2"])


@pytest.mark.parametrize(
    ("override", "fault"),
    [
        (
            "schemes.temporal=3",
            "schemes.temporal: 3 is not accepted; expected a table of the scheme's parameters",
        ),
        (
            "schemes.temporal.grid=[1, 2]",
            "schemes.temporal.grid: [1, 2] is not accepted; "
            "expected a number, a text, true or false",
        ),
        (
            "schemes.temporal.deep.er=1",
            "schemes.temporal.deep: {'er': 1} is not accepted; "
            "expected a number, a text, true or false",
        ),
        (
            "schemes.temporal.ripple=inf",
            "schemes.temporal.ripple: inf is not finite; expected a finite number",
        ),
        (
            "schemes.nobody.ripple=1",
            "schemes.nobody: there is no such scheme in schemes; "
            "it has temporal, pilot, water-filling, posterior, genie",
        ),
        (
            "scheme_parameters={}",
            "scheme_parameters: unknown key; accepted here: name, description, schemes, trials, "
            "geometry, array, radio, radar, uav, objects, frame, filter, coverage, tracks, truth, "
            "trace",
        ),
    ],
)
def test_a_bad_table_of_a_scheme_is_one_clear_message(override, fault):
    with pytest.raises(ScenarioError) as caught:
        load_scenario("paper-multi", [override])
    assert str(caught.value) == f"paper-multi: {fault}"


def test_schemes_that_are_no_names_take_no_parameters(tmp_path):
    file = tmp_path / "odd.toml"
    for schemes in ("3", "[[1]]"):
        file.write_text(f'name = "odd"\nschemes = {schemes}\n')
        with pytest.raises(ScenarioError, match="schemes is neither a list of names nor tables"):
            load_scenario(file, ["schemes.temporal.ripple=1"])


def test_every_bad_table_is_reported_with_the_other_faults():
    document = {"name": "x", "schemes": {"a": 3, "b": {"c": []}}, "uav": {"height": -1}}
    with pytest.raises(ScenarioError) as caught:
        checked(Scenario, document, "x")
    message = str(caught.value)
    assert message.startswith("x: 3 faults")
    for key in ("schemes.a: 3 is", "schemes.b.c: [] is", "uav.height: -1 is"):
        assert key in message


def test_parameters_of_schemes_that_do_not_run_are_a_fault():
    with pytest.raises(ValueError, match="for pilot; expected all schemes in their order, omni"):
        Scenario(name="x", schemes=("omni",), scheme_parameters={"pilot": {}})
