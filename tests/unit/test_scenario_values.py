"""Scenario as a value: replaced, copied, hashed and shown, never changed or invalid."""

import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from echobeam.scenario import BUILT_IN, ScenarioError, load_scenario
from echobeam.scenario.checking import checked, override_table, read_value
from echobeam.scenario.dump import key_texts, value_text
from echobeam.scenario.limits import LEAST, MOST
from echobeam.scenario.model import Scenario
from echobeam.scenario.tables import CoverageTable, FilterTable

TEXTS = st.text(st.characters(exclude_categories=("Cs",)))
NUMBERS = st.floats(allow_nan=False, allow_infinity=False)


@pytest.mark.parametrize("name", BUILT_IN)
def test_a_replaced_scenario_is_the_overridden_one(name):
    changes = {"coverage.ripple": "0.2 N_t"}
    if load_scenario(name).geometry == "road":
        changes |= {"uav.height": "80 m", "array.n_tx": 16}
    else:
        changes |= {"uav.position": ["1 m", 0, "80 m"], "array.rows": 4}
        key = "trace.origin" if name == "ground-traffic" else "objects.0.velocity"
        changes |= {key: [1, 2]}
    assert load_scenario(name).replace(changes) == load_scenario(name, changes)
    assert load_scenario(load_scenario(name), changes) == load_scenario(name, changes)
    assert load_scenario(name).replace({}) == load_scenario(name)


def test_what_replaces_is_validated_like_a_file():
    scenario = load_scenario("paper-multi")
    with pytest.raises(ScenarioError, match="2 faults"):
        scenario.replace({"uav.height": "-5 m", "coverage.riple": 1})
    with pytest.raises(ValueError, match="greater than 0"):
        scenario.model_copy(update={"uav": {"height": -5.0}})
    assert scenario.model_copy(update={"name": "other"}).name == "other"
    assert scenario.model_copy() == scenario


@given(
    description=TEXTS,
    height=st.floats(1.0, 0.01 * MOST["length"]),
    angle=st.floats(0.01, math.pi - 0.01),
    slot=st.floats(LEAST, MOST["time"]),
    tables=st.dictionaries(
        TEXTS.filter(bool),
        st.dictionaries(TEXTS, st.booleans() | st.integers() | NUMBERS | TEXTS),
    ),
)
@pytest.mark.slow
def test_any_scenario_reads_back_from_its_text(description, height, angle, slot, tables):
    scenario = Scenario(
        name="any",
        description=description,
        schemes=tables,
        uav={"height": height},
        objects=({"angle": angle},),
        frame={"slot": slot},
    )
    assert checked(Scenario, tomllib.loads(scenario.to_toml()), "dumped") == scenario


def test_a_table_is_copied_with_the_files_own_care():
    scenario = load_scenario("paper-multi")
    with pytest.raises(ValueError, match="greater than 0"):
        scenario.uav.model_copy(update={"height": -5.0})
    with pytest.raises(ValueError, match="hight"):
        scenario.model_copy(update={"hight": 3})
    lower = scenario.uav.model_copy(update={"height": "80 m"})
    assert scenario.model_copy(update={"uav": lower}) == scenario.replace({"uav.height": 80})


def test_numbers_of_numpy_are_numbers():
    scenario = load_scenario("paper-multi")
    changed = scenario.replace({"array.n_tx": np.int64(64), "uav.height": np.float32(80)})
    assert changed == scenario.replace({"array.n_tx": 64, "uav.height": 80.0})


def test_a_scenario_introduces_itself_in_a_line():
    text = repr(load_scenario("paper-multi"))
    assert text == str(load_scenario("paper-multi"))
    assert text.startswith("<Scenario paper-multi: 2 object(s), 30 antennas, 10 slots")
    assert "\n" not in text


@pytest.mark.parametrize("name", BUILT_IN)
def test_equal_scenarios_have_one_hash(name):
    assert hash(load_scenario(name)) == hash(load_scenario(name).replace({}))


def test_keys_of_a_table_are_replaced_with_the_files_own_care():
    coverage = load_scenario("paper-multi").coverage
    changed = override_table(coverage, {"ripple": "0.5 N_t", "resolution": "1 deg"}, "scheme x")
    assert (changed.ripple, changed.width) == ("0.5 N_t", coverage.width)
    assert changed.resolution == pytest.approx(math.radians(1))
    assert override_table(coverage, {}, "scheme x") is coverage
    with pytest.raises(ScenarioError) as caught:
        override_table(coverage, {"ripple": -1, "wdth": 2}, "scheme x")
    message = str(caught.value)
    assert message.startswith("scheme x: 2 faults")
    assert "ripple: -1.0 is negative" in message
    assert "wdth: unknown key; did you mean 'width'? accepted here: width, ripple" in message


@pytest.mark.parametrize("table", [FilterTable(), CoverageTable()])
def test_the_texts_of_a_tables_keys_give_the_table(table):
    texts = key_texts(table)
    assert set(texts) == set(type(table).model_fields)
    document = tomllib.loads("\n".join(f"{key} = {text}" for key, text in texts.items()))
    assert type(table)(**document) == table


def test_a_scenario_is_frozen():
    with pytest.raises(ValueError, match="frozen"):
        load_scenario("paper-multi").name = "other"


@given(
    st.recursive(
        st.booleans() | st.integers(-(2**62), 2**62) | NUMBERS | TEXTS,
        lambda inner: st.lists(inner) | st.dictionaries(TEXTS, inner),
        max_leaves=5,
    )
)
def test_a_value_reads_back_from_its_text(value):
    assert read_value(value_text(value)) == value


def test_values_of_numpy_and_paths_have_the_text_of_pythons():
    for given_, plain in [
        (np.float32(0.5), 0.5),
        (np.array(3), 3),
        (np.array([1.5, 2.0]), [1.5, 2.0]),
        ((np.int8(1), "80 m"), [1, "80 m"]),
        (Path("a") / "b.csv", "a/b.csv"),
    ]:
        assert read_value(value_text(given_)) == plain
    with pytest.raises(TypeError, match="no value of a scenario"):
        value_text(None)


@pytest.mark.parametrize("name", BUILT_IN)
def test_the_text_of_a_scenario_is_a_file_that_loads_equal(name, tmp_path):
    changes = {"uav.height": np.float64(77.7), "frame.slots_per_frame": 3}
    if name == "ground-traffic":
        points = [["0 s", 0, 0, "80 m"], [1.5, 3, 4, 77.7]]
        changes = {"uav": {"waypoints": points}, "trace.origin": ["1.5 m", -2]}
    elif load_scenario(name).geometry == "ground":
        path = [["0 s", "-20 m", 70.125], ["5 ms", "0.1 km", 1e-3]]
        changes = {"objects.1": {"path": path, "leaves": 1.0}, "array.polarisations": 2}
        points = [["0 s", 0, 0, "80 m"], [1.5, 3, 4, 77.7]]
        changes |= {"uav": {"waypoints": points}, "array.facing": [1, 0, -0.5]}
    changed = load_scenario(name, changes)
    path = tmp_path / "copy.toml"
    path.write_text(changed.to_toml(), encoding="utf-8")
    assert load_scenario(path) == changed
    assert load_scenario(path).to_toml() == changed.to_toml()


def test_settings_may_be_one_text_or_nested_values():
    scenario = load_scenario("paper-multi")
    assert load_scenario(scenario, "uav.height=80 m") == scenario.replace({"uav.height": 80})
    one = {"objects": [{"angle": np.float64(1.25), "velocity": "10 m/s"}]}
    assert scenario.replace(one).objects[0].velocity == 10.0
    with pytest.raises(ScenarioError, match="no key"):
        scenario.replace({3: 1})
