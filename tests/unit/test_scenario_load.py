import math
import tomllib

import pytest

from echobeam.scenario import (
    BUILT_IN,
    ScenarioError,
    load_scenario,
    preset_text,
)
from echobeam.scenario.checking import checked
from echobeam.scenario.dump import dump_scenario
from echobeam.scenario.geometry import meaningless_keys
from echobeam.scenario.model import Scenario

FOLLOWING = {
    "array": {"n_rx", "receive_rows", "receive_columns"},
    "truth": {"angle_std", "distance_std", "velocity_std", "altitude_errors", "terrain"},
    "uav": {"altimeter_std", "terrain_std", "velocity", "waypoints"},
}
"""Keys that follow others if left out, or are about a height that no scheme of the presets uses."""

OF_SIGNALS = {
    "subcarriers", "symbols", "modulation", "integration", "filter", "cfar", "false_alarm", "angle",
    "self_interference", "ground_clutter", "background", "fluctuation", "target",
}  # fmt: skip
"""Keys of the radar that only a preset with signals writes out."""

OF_DETECTION = {"detections", "clutter"}
"""Keys of the radar that only an unlabelled preset writes out, besides the false-alarm rate."""

PAPER = [name for name in BUILT_IN if name.startswith("paper")]


@pytest.mark.parametrize("name", BUILT_IN)
def test_a_dumped_scenario_reads_back_bit_for_bit(name):
    scenario = load_scenario(name)
    assert checked(Scenario, tomllib.loads(dump_scenario(scenario)), "dumped") == scenario


@pytest.mark.parametrize("name", BUILT_IN)
def test_a_preset_is_complete(name):
    """Every key is written out, so that the printed file shows all that can be edited."""
    document = tomllib.loads(preset_text(name))
    for table, field in Scenario.model_fields.items():
        if table in ("trace", "objects", "scheme_parameters"):
            continue
        unlabelled = document["radar"].get("detections") == "unlabelled"
        if table == "tracks" and not unlabelled:
            assert table not in document
            continue
        assert table in document, table
        keys = set(getattr(field.annotation, "model_fields", {}))
        keys -= set(meaningless_keys(load_scenario(name)).get(table, ()))
        follows = keys & FOLLOWING.get(table, set())
        if table == "radar" and document[table]["model"] == "crb":
            follows = OF_SIGNALS - {"false_alarm"} if unlabelled else OF_SIGNALS | OF_DETECTION
        elif table == "radar":
            follows = OF_DETECTION
        assert keys - follows == set(document[table] if keys else ()), table


@pytest.mark.parametrize("name", PAPER)
def test_a_preset_takes_the_papers_table_of_parameters(name):
    scenario = load_scenario(name)
    assert (scenario.array.n_tx, scenario.array.receivers, scenario.array.spacing) == (30, 30, 0.5)
    assert scenario.radar.bandwidth == 80e6
    assert scenario.radar.pulse_length == pytest.approx(0.01e-3)
    assert (scenario.radar.gain, scenario.radar.rcs) == (10, (120, 120))
    assert scenario.radio.carrier == 30e9
    assert (scenario.radio.noise, scenario.radar.noise, scenario.radio.alpha0) == (1, 1, 1)
    assert scenario.filter.angle_std == pytest.approx(math.radians(0.02))
    assert (scenario.filter.distance_std, scenario.filter.velocity_std) == (0.2, 0.5)
    assert scenario.coverage.width == 3
    assert scenario.coverage.resolution == pytest.approx(math.radians(0.1))
    models = ("exact", "signal") if name == "paper-signal" else ("paper", "crb")
    assert (scenario.radar.crb, scenario.radar.model) == models
    assert scenario.filter.evolution == "paper"


def test_the_two_objects_start_where_the_captions_say():
    objects = load_scenario("paper-multi").objects
    assert [math.degrees(item.angle) for item in objects] == pytest.approx([75, 135])
    assert [(item.velocity, item.acceleration) for item in objects] == [(30, -5), (-3, 1)]


def test_all_faults_are_reported_together_with_file_key_value_and_what_is_accepted(tmp_path):
    file = tmp_path / "bad.toml"
    text = preset_text("paper-multi")
    text = text.replace("n_tx = 30", "n_tx = -3").replace('"100 m"', '"100 kg"')
    file.write_text(text.replace("\nripple =", "\nriple ="))
    with pytest.raises(ScenarioError) as caught:
        load_scenario(file, {"objects.9.angle": 1.0})
    message = str(caught.value)
    assert message.startswith(f"{file}: 4 faults")
    assert "array.n_tx: -3 is not accepted; expected greater than or equal to 1" in message
    assert "uav.height: unknown unit 'kg'" in message
    assert "coverage.riple: unknown key; did you mean 'ripple'?" in message
    assert "objects.9.angle: there is no item '9'" in message


@pytest.mark.parametrize(
    ("override", "word"),
    [
        ("array.n_tx=0", "greater than or equal to 1"),
        ("array.n_tx=2.5", "whole number"),
        ("array.axis=up", "'vertical' or 'horizontal'"),
        ("objects.0.angle=0 deg", "greater than 0"),
        ("objects.0.angle=180 deg", "less than"),
        ("objects.0.angle=nan", "not finite"),
        ("radio.power=inf", "not finite"),
        ("radio.power=0", "greater than 0"),
        ("radio.power=1 W", "'1 W' is a power of 1 W; expected a plain number"),
        ("radio.power=30 dBm", "'30 dBm' is a power of 1 W; expected a plain number"),
        ("uav.height=100,5 m", "'100,5 m' is no number; decimals take a point"),
        (
            "uav.floor=200 m",
            "uav.floor: 200 m is above uav.height, 100 m; expected at most the height",
        ),
        (
            "name=../elsewhere",
            "name: '../elsewhere' is not accepted; expected a name without a slash",
        ),
        ("name=..", "without a slash"),
        ("radar.variance=guessed", "'predicted' or 'known'"),
        ("coverage.centre=here", "'predicted' or 'previous'"),
        ("truth.angle_std=-1 deg", "greater than or equal to 0"),
        ("radar.crb=maybe", "'paper' or 'exact'"),
        ("coverage.ripple=-1", "negative"),
        ("coverage.ripple=-1 N_t", "negative"),
        ("coverage.ripple=many", "N_t"),
        ("frame.frames=true", "whole number"),
        ("truth.process_noise=7", "true or false"),
        ("schemes=3", "a list"),
        ("schemes=[3]", "a text"),
        ("objects=5", "a list"),
        ("array=5", "a table"),
        ("nothing.here=1", "unknown key"),
        ("array.n_tx.deeper=1", "not a table"),
        ("array", "KEY=VALUE"),
        ("=5", "KEY=VALUE"),
    ],
)
def test_a_bad_override_is_one_clear_message(override, word):
    with pytest.raises(ScenarioError) as caught:
        load_scenario("paper-multi", [override])
    assert word in str(caught.value)


def test_a_floor_above_the_height_is_reported_with_the_other_faults():
    with pytest.raises(ScenarioError) as caught:
        load_scenario("paper-multi", {"uav.floor": "200 m", "array.n_tx": 0})
    message = str(caught.value)
    assert "array.n_tx: 0 is not accepted" in message
    assert "uav.floor: 200 m is above uav.height, 100 m" in message
    with pytest.raises(ScenarioError, match=r"uav\.floor: 1 m is above uav\.height, 0\.5 m"):
        checked(
            Scenario, {"name": "low", "uav": {"height": 0.5}}, "low"
        )  # the floor is the default
    assert load_scenario("paper-multi", {"uav.floor": "100 m"}).uav.floor == 100


def test_overrides_take_units_and_lists():
    scenario = load_scenario(
        "paper-multi",
        ['uav.height="80 m"', "objects.0.angle=60 deg", "schemes=['omni']", "array.n_tx = 64"],
    )
    assert scenario.uav.height == 80
    assert scenario.objects[0].angle == pytest.approx(math.pi / 3)
    assert scenario.schemes == ("omni",)
    assert scenario.array.n_tx == 64


def test_ripple_may_follow_the_array():
    scenario = load_scenario("paper-multi", ["coverage.ripple=0.1 N_t", "array.n_tx=64"])
    assert scenario.ripple == pytest.approx(6.4)
    assert load_scenario("paper-multi").ripple == 3


def test_the_receivers_follow_the_transmitters_unless_they_are_given():
    assert load_scenario("paper-multi", ["array.n_tx=64"]).array.receivers == 64
    given = load_scenario("paper-multi", ["array.n_tx=64", "array.n_rx=16"])
    assert given.array.receivers == 16
    again = load_scenario("paper-multi", ["array.n_tx=20"]).replace({"array.n_tx": 40})
    assert (again.array.receivers, again.ripple) == (40, 4.0)


def test_natures_noise_is_the_filters_unless_it_has_its_own():
    scenario = load_scenario("paper-multi", ["truth.distance_std=1 m"])
    assert scenario.truth_stds == (scenario.filter.angle_std, 1.0, 0.5)


def test_a_file_from_a_windows_editor_is_read(tmp_path):
    file = tmp_path / "bom.toml"
    file.write_bytes(b"\xef\xbb\xbf" + preset_text("paper-single").encode())
    assert load_scenario(file) == load_scenario("paper-single")


def test_no_objects_is_a_scenario():
    assert load_scenario("paper-multi", {"objects": []}).n_objects == 0


def test_a_missing_file_names_what_is_near():
    with pytest.raises(ScenarioError, match=r"did you mean 'paper-multi'"):
        load_scenario("paper-mutli")


def test_what_is_not_toml_says_so(tmp_path):
    file = tmp_path / "x.toml"
    file.write_text("= what\n")
    with pytest.raises(ScenarioError, match=r"not a TOML file.*line 1"):
        load_scenario(file)
    file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(ScenarioError, match="UTF-8"):
        load_scenario(file)
    with pytest.raises(ScenarioError, match="cannot be read"):
        load_scenario(tmp_path)


def test_a_trace_takes_the_objects_place(tmp_path):
    scenario = load_scenario("paper-multi").with_trace(tmp_path / "t.csv")
    assert scenario.objects == ()
    assert scenario.trace is not None
    assert scenario.trace.max_objects == 2
    with pytest.raises(ScenarioError, match="not together with a trace"):
        load_scenario("paper-multi", {"trace": {"file": "t.csv"}})
