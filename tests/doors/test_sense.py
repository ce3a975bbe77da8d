"""`echobeam sense` and runs with signals as a user meets them: answers, pictures, bad input."""

import json

import numpy as np
import pytest

import echobeam as eb

from .test_cli import echobeam, refused

LIGHT = ["--trials", 2, "--set", "array.n_tx=6"]


@pytest.mark.slow
def test_json_is_that_of_the_interface(tmp_path):
    done = echobeam("sense", "paper-signal", *LIGHT, "--json", "--quiet", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    points = len(found["snr_db"])
    assert max(found["snr_db"]) - min(found["snr_db"]) >= 30
    assert set(found["rmse"]) == {"delay", "doppler", "angle"}
    assert set(found["rmse"]["angle"]) == {"capon", "glrt"}
    for quantity in ("delay", "doppler"):
        assert set(found["rmse"][quantity]) == {"matched_filter"}
    for version in ("paper", "exact"):
        assert {len(found["bound"][version][q]) for q in ("delay", "doppler", "angle")} == {points}
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_table_picture_and_data(tmp_path):
    done = echobeam("sense", "paper-signal", *LIGHT, "--quiet", cwd=tmp_path)
    assert (tmp_path / "paper-signal-sense.png").stat().st_size > 10_000, done.stderr
    again = echobeam("sense", "paper-signal", *LIGHT, "--quiet", cwd=tmp_path)
    refused(again, "paper-signal-sense.png", "exists already", "--force")
    check = eb.sense("paper-signal", trials=2, set={"array.n_tx": 6},
                     out=tmp_path / "sense.csv", quiet=True)  # fmt: skip
    assert check.trials == 2
    assert "Delay RMSE" in (tmp_path / "sense.csv").read_text()


@pytest.mark.slow
def test_one_antenna_has_no_angle_and_says_so(tmp_path):
    done = echobeam("sense", "paper-signal", *LIGHT, "--set", "array.n_tx=1", cwd=tmp_path)
    last = next(line for line in done.stdout.splitlines() if line.split()[1:2] == ["36"])
    assert last.split()[4:6] == ["-", "-"]
    assert np.isfinite(float(last.split()[6]))


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (["radar.bandwidth=0"], ["radar.bandwidth", "greater than 0"]),
        (["uav.height=500 m"], ["delay", "radar.subcarriers / radar.bandwidth"]),
        (
            ["objects.0.velocity=600 m/s", "radar.symbols=2", "radar.pulse_length=1 ms"],
            ["Doppler shift", "radar.symbols / (2 radar.pulse_length)"],
        ),
        (["radar.subcarriers=4000", "radar.symbols=400"], ["at most 4194304 samples"]),
        (["radar.subcarriers=8"], ["radar.subcarriers", "at least 29"]),
        (["objects=[]"], ["no objects"]),
    ],
)
def test_settings_that_no_receiver_can_use_are_refused(tmp_path, settings, words):
    given = [word for setting in settings for word in ("--set", setting)]
    refused(echobeam("sense", "paper-signal", *given, cwd=tmp_path), *words)
    if settings != ["objects=[]"]:
        refused(echobeam("run", "paper-signal", *given, cwd=tmp_path), *words)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_objects_of_one_cell_are_not_measured_and_those_apart_are_consistent():
    """NEES of 3 and 2 states: 8 trials, 10 slots, 2 objects; the mean's band of 5 deviations."""
    changes = {"objects.0.velocity": 3.0, "objects.1.velocity": 3.0,
               "objects.0.acceleration": 0.0, "objects.1.acceleration": 0.0}  # fmt: skip
    for angle, seen in (("77 deg", False), ("78 deg", True)):
        scenario = eb.load_scenario("paper-signal").replace({**changes, "objects.1.angle": angle})
        result = eb.simulate(scenario, ["temporal"], trials=8, seed=2, progress=False)
        assert np.isfinite(result["measured"]).all() == seen
        if seen:
            nees = float(eb.summary(result).loc[("temporal", "frame_nees"), "value"])
            assert nees < 3 + 5 * np.sqrt(6 / 8)  # slots of a trial are dependent
    assert (np.isinf(result["measured_var"]) == np.isnan(result["measured"])).all()


def test_an_echo_that_fluctuates_has_the_variance_of_its_own_strength():
    """Swerling I at the bound: errors over their stated deviations have a mean square of 1."""
    scenario = eb.load_scenario("paper-signal").replace(
        {"radar.model": "crb", "radar.fluctuation": "swerling1"}
    )
    result = eb.simulate(scenario, ["omni"], trials=100, seed=5, progress=False)
    distance = result["truth"].sel(state="distance").values
    error = result["measured"].sel(measurement="delay").values - 2 * distance / 299792458.0
    score = error**2 / result["measured_var"].sel(measurement="delay").values
    assert np.nanmean(score) == pytest.approx(1, abs=5 * np.sqrt(2 / score.size))


@pytest.mark.parametrize("key", ["ground_clutter", "self_interference"])
@pytest.mark.slow
def test_surroundings_disturb_and_leave_the_loop_whole(key):
    scenario = eb.load_scenario("paper-signal").replace({"frame.slots_per_frame": 3})
    calm = eb.simulate(scenario, ["omni"], trials=3, seed=1, progress=False)
    loud = eb.simulate(
        scenario.replace({f"radar.{key}": 10.0}), ["omni"], trials=3, seed=1, progress=False
    )
    assert not np.array_equal(calm["measured"], loud["measured"])
    assert np.isfinite(loud["rate"]).all()
