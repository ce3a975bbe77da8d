"""`echobeam traffic` as a user meets it: traces of the real SUMO, read and run; bad input."""

import errno
import gzip
import inspect
import json
import re
import shlex
import subprocess
import sys
import warnings
from collections import defaultdict
from itertools import pairwise

import numpy as np
import pytest

import echobeam as eb
from echobeam.cli.main import cli
from echobeam.traces import PLANE, load_motion
from echobeam.traces.source import read_samples
from echobeam.traces.traffic import simulator

from .test_cli import echobeam, refused

SMALL = ["--vehicles", 20, "--length", "400 m", "--duration", "10 s"]


@pytest.fixture
def sumo():
    """The real simulator, which the extra installs."""
    pytest.importorskip("sumo")


def by_vehicle(path):
    """Return the samples of each vehicle."""
    found = defaultdict(list)
    for sample in read_samples(path):
        found[sample.name].append(sample)
    return found


@pytest.mark.slow
@pytest.mark.usefixtures("sumo")
def test_positions_advance_by_the_speeds(tmp_path):
    """SUMO's ballistic rule: by the mean of the speeds at both ends of a step, times the step.

    Numbers are rounded to 1e-4: an advance to 1e-4, the mean speed times the step to 1e-5. A change
    of lane is a sideways step, which does not count.
    """
    trace = tmp_path / "trace.xml.gz"
    done = echobeam("traffic", *SMALL, "--both-directions", "--out", trace, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "20 vehicles in 10 s" in done.stdout
    vehicles = by_vehicle(trace)
    assert len(vehicles) == 20
    signs = set()
    for samples in vehicles.values():
        assert len(samples) >= 4
        for one, other in pairwise(samples):
            assert other.time - one.time == pytest.approx(0.1)
            advance = other.x - one.x
            assert abs(advance) == pytest.approx(0.1 * (one.speed + other.speed) / 2, abs=2e-4)
            signs.add(np.sign(advance))
        assert all(abs(each.x) <= 200 for each in samples)
    assert signs == {-1, 1}
    speeds = [np.mean([each.speed for each in samples]) for samples in vehicles.values()]
    assert np.std(speeds) > 0.5  # m/s: drivers differ


@pytest.mark.slow
@pytest.mark.usefixtures("sumo")
def test_trace_is_read_without_a_remark_and_x_0_is_the_middle_of_the_road(tmp_path):
    made = eb.traffic(tmp_path / "trace.xml", vehicles=30, length=600, quiet=True)
    assert made.vehicles == 30
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        motion = load_motion(
            made.path, np.arange(0, 30, 0.1), uav_x=0.0, max_objects=30, range_m=300, origin=0.0
        )
    assert len(motion.names) == 30
    there = motion.present.sum(axis=1)
    assert there.mean() == pytest.approx(made.at_once, abs=1)
    assert there.min() > 0.5 * there.max()  # from the first slot to the last
    velocity = motion.velocity[motion.present]
    assert velocity.min() >= made.slowest - 0.1
    assert velocity.max() <= made.fastest + 0.1
    samples = by_vehicle(made.path)
    first = {name: each[0].x for name, each in samples.items() if each[0].time > 0}
    assert first
    assert set(first.values()) == {-300.0}


@pytest.mark.slow
@pytest.mark.usefixtures("sumo")
def test_vehicles_overtake(tmp_path):
    made = eb.traffic(tmp_path / "trace.xml", quiet=True)
    order = defaultdict(dict)
    for sample in read_samples(made.path):
        order[sample.time][sample.name] = sample.x
    first, later = order[0.0], order[20.0]
    both = sorted(first.keys() & later.keys())
    swaps = sum((first[a] < first[b]) != (later[a] < later[b]) for a in both for b in both if a < b)
    assert swaps >= 3


@pytest.mark.slow
@pytest.mark.usefixtures("sumo")
def test_same_arguments_give_the_same_bytes(tmp_path):
    echobeam("traffic", *SMALL, "--out", "a.xml.gz", "--quiet", cwd=tmp_path)
    (tmp_path / "elsewhere").mkdir()
    place = tmp_path / "elsewhere" / "b.xml.gz"
    asked = {"vehicles": 20, "length": 400, "duration": "10 s"}
    made = eb.traffic(place, **asked, quiet=True)
    assert place.read_bytes() == (tmp_path / "a.xml.gz").read_bytes()
    assert made.path == place
    other = eb.traffic(tmp_path / "c.xml.gz", **asked, seed=1, quiet=True)
    assert other.path.read_bytes() != place.read_bytes()


@pytest.mark.slow
@pytest.mark.usefixtures("sumo")
def test_trace_is_run_to_its_end_from_shell_and_python(tmp_path):
    made = eb.traffic(tmp_path / "trace.xml.gz", vehicles=30, duration=20, quiet=True)
    scenario = eb.load_scenario("traffic", {"frame.frames": 20, "frame.slot": "50 ms"})
    result = eb.simulate(scenario.with_trace(made.path), ["omni"], trials=2, progress=False)
    assert result.sizes["slot"] == 200
    assert bool(result["present"].any("object").all())
    assert np.isfinite(result["rate"].where(result["present"]).sum("object")).all()
    done = echobeam(
        *("run", "traffic", "--trace", made.path, "--trials", 2, "--scheme", "omni"),
        *("--set", "trace.origin=0", "--set", "frame.frames=3", "--quiet", "--out", "x.nc"),
        cwd=tmp_path,
    )
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    with eb.run("traffic", schemes=["omni"], trials=1, trace=made, set={"frame.frames": 2},
                out=tmp_path / "y.nc", quiet=True) as again:  # fmt: skip
        assert bool(again["present"].any())


@pytest.mark.slow
@pytest.mark.usefixtures("sumo")
def test_an_intersection_is_read_in_two_dimensions_and_run(tmp_path):
    given = ("--kind", "intersection", "--vehicles", 24, "--length", "280 m", "--lanes", 1)
    more = ("--speed", "14 m/s", "--duration", "10 s", "--step", "0.25 s", "--seed", 1)
    done = echobeam("traffic", *given, *more, "--out", "t.xml.gz", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "y from -140.0 to 140.0 m" in done.stdout
    path = tmp_path / "t.xml.gz"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        motion = load_motion(
            path, 0.01 * np.arange(1000), uav_x=(0, 0), max_objects=24, range_m=250, road=PLANE,
            origin=(0, 0),
        )  # fmt: skip
    samples = by_vehicle(path)
    for column in np.flatnonzero(motion.present[100]):
        name = motion.names[motion.identity[100, column]]
        (there,) = (each for each in samples[name] if each.time == 1.0)
        np.testing.assert_allclose(motion.position[100, column], [there.x, there.y], atol=1e-9)
        speed = np.hypot(*motion.velocity[100, column])
        assert speed == pytest.approx(there.speed, abs=0.6)  # 5 m/s^2 over half a step
    turned = set()
    for name, path_ in samples.items():
        first, last = path_[0], path_[-1]
        if abs(last.x) > 20 and abs(first.y) > 20 and abs(last.y) < 10 and abs(first.x) < 10:
            turned.add(name)
    assert turned
    run = ("--trace", "t.xml.gz", "--trials", 1, "--scheme", "water-filling", "--quiet")
    done = echobeam(
        *("run", "ground-traffic", *run, "--set", "trace.start=0 s", "--set", "frame.frames=2"),
        *("--out", "x.nc"), cwd=tmp_path,
    )  # fmt: skip
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")


@pytest.mark.slow
@pytest.mark.usefixtures("sumo")
def test_the_shipped_intersection_is_what_its_command_makes(tmp_path):
    from importlib.metadata import version
    from importlib.resources import files

    presets = files("echobeam.scenario") / "presets"
    shipped = (presets / "ground-traffic-trace.xml.gz").read_bytes()
    made_by = re.search(rb"SUMO (\S+):", gzip.decompress(shipped))[1].decode()
    if version("eclipse-sumo") != made_by:
        pytest.skip(f"the trace was made by SUMO {made_by}")
    text = (presets / "ground-traffic.toml").read_text().replace("\n#", "")
    command = shlex.split(re.search(r"echobeam (traffic .*?\.gz)", text)[1])
    done = echobeam(*command, "--quiet", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    made = (tmp_path / command[-1]).read_bytes()
    assert gzip.decompress(made) == gzip.decompress(shipped)


@pytest.mark.slow
@pytest.mark.usefixtures("sumo")
def test_json_and_existing_files(tmp_path):
    done = echobeam("traffic", *SMALL, "--out", "t.xml", "--json", cwd=tmp_path)
    found = json.loads(done.stdout)
    assert (found["trace"], found["vehicles"], found["duration"]) == ("t.xml", 20, 10.0)
    assert [path.name for path in tmp_path.iterdir()] == ["t.xml"]
    refused(echobeam("traffic", "--out", "t.xml", cwd=tmp_path), "t.xml", "exists already", "force")
    again = echobeam("traffic", *SMALL, "--out", "t.xml", "--force", "--quiet", cwd=tmp_path)
    assert (again.returncode, again.stdout, again.stderr) == (0, "", "")


def test_faults_are_reported_together_without_writing(tmp_path):
    given = ["--vehicles", 0, "--length", "-1 m", "--speed", "fast", "--step", "5 s"]
    done = echobeam("traffic", *given, "--out", "trace.csv", cwd=tmp_path)
    refused(done, "errors in the input", "vehicles: 0", "length: '-1 m'", "speed: 'fast'",
            "step: '5 s'", "trace.csv", ".xml.gz")  # fmt: skip
    assert list(tmp_path.iterdir()) == []


def test_more_vehicles_than_fit_are_refused(tmp_path):
    done = echobeam("traffic", "--vehicles", 1000, "--out", "t.xml", cwd=tmp_path)
    refused(done, "vehicles: 1000 do not fit; expected at most 93")
    assert list(tmp_path.iterdir()) == []


def test_without_the_extra_the_install_command_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr(simulator, "find_spec", lambda name: None)
    done = echobeam("traffic", "--out", "t.xml", cwd=tmp_path)
    refused(done, 'pip install "echobeam[sumo]"')
    assert done.stderr.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


def test_failure_leaves_the_old_trace(tmp_path, monkeypatch):
    broken = simulator.Simulator(tmp_path / "nowhere", "0")
    monkeypatch.setattr("echobeam.commands.traffic.find_simulator", lambda: broken)
    (tmp_path / "t.xml").write_text("old")
    done = echobeam("traffic", *SMALL, "--out", "t.xml", "--force", cwd=tmp_path)
    assert done.returncode == 1
    assert "cannot be started" in done.stderr
    assert [path.read_text() for path in tmp_path.iterdir()] == ["old"]


def test_full_disk_names_the_file(tmp_path, monkeypatch):
    def fail(*arguments):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr("echobeam.commands.traffic.make_trace", fail)
    monkeypatch.setattr("echobeam.commands.traffic.find_simulator", lambda: True)
    done = echobeam("traffic", "--out", "t.xml", cwd=tmp_path)
    assert (done.returncode, done.stderr) == (1, "echobeam: t.xml: No space left on device\n")
    assert list(tmp_path.iterdir()) == []


def test_command_and_function_have_the_same_arguments():
    command = cli.get_command(None, "traffic")
    options = {parameter.name for parameter in command.params}
    assert options - {"as_json"} == set(inspect.signature(eb.traffic).parameters)


def test_help_imports_no_simulator():
    code = (
        "import sys; from echobeam.cli.main import cli;"
        "cli.main(['traffic', '--help'], standalone_mode=False);"
        "heavy = {'numpy', 'sumo', 'sumolib', 'xarray', 'pydantic'};"
        "sys.exit(', '.join(heavy & set(sys.modules)) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
