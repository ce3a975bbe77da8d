"""Decision times: measurement, statistics, and where they must not appear."""

import itertools
from dataclasses import replace

import numpy as np
import pytest

import echobeam as eb
from echobeam.beamforming.methods import DEFAULT, METHODS
from echobeam.faults import RunError
from echobeam.schemes.configure import configure_all
from echobeam.simulation import decisions, loop
from echobeam.simulation.blocks import run_block
from echobeam.simulation.decisions import SECONDS, decision_times
from echobeam.simulation.scene import scene_of
from echobeam.store.block_files import BlockFiles
from echobeam.store.recording import Recording, record
from echobeam.sweeps.grid import Grid, Varied
from echobeam.sweeps.points import run_study, study_in
from echobeam.sweeps.recording import Sweep, record_sweep

SCENARIO = eb.load_scenario("paper-single")
SCENE = scene_of(SCENARIO)
LIGHT = ("water-filling", "omni")


@pytest.fixture
def clock(monkeypatch):
    """A clock on which every decision takes 3 s."""
    ticks = itertools.count(0.0, 3.0)
    monkeypatch.setattr(loop, "perf_counter", lambda: next(ticks))
    monkeypatch.setattr(decisions, "_decided", {*LIGHT, "temporal"})


def test_a_blocks_time_is_shared_by_its_trials_and_omni_slots_have_none(clock):
    block = run_block(SCENE, configure_all(SCENARIO, LIGHT), 0, range(12))
    water_filling, omni = block.arrays[SECONDS]
    np.testing.assert_array_equal(water_filling, [np.nan] + [3.0 / 12.0] * 9)
    assert np.isnan(omni).all()


def test_mean_and_percentile_are_over_slots_and_blocks():
    seconds = np.random.default_rng(0).exponential(1e-3, (3, 1, 40))
    seconds[:, :, ::10] = np.nan
    sorted_all = np.sort(seconds[np.isfinite(seconds)])
    found = decision_times(list(np.concatenate([seconds, np.full((3, 1, 40), np.nan)], 1)), "ab")
    assert found["a"].mean == pytest.approx(sorted_all.sum() / 108)
    # rank 0.99 (n - 1) = 105.93 of 108 sorted values, interpolated
    expected = 0.07 * sorted_all[105] + 0.93 * sorted_all[106]
    assert found["a"].p99 == pytest.approx(expected)
    assert np.isnan([found["b"].mean, found["b"].p99]).all()


def test_the_first_decision_of_a_users_scheme_in_a_process_is_not_timed(monkeypatch):
    """It may load or compile what it needs."""

    @eb.scheme("mine")
    def beams(prior, view):
        return np.zeros((*prior.known.shape, view.system.transmitter.n))

    monkeypatch.setattr(decisions, "_decided", set())
    blocks = [run_block(SCENE, configure_all(SCENARIO, [beams]), 0, range(3)) for _ in range(2)]
    taken = [np.isfinite(block.arrays[SECONDS][0]).tolist() for block in blocks]
    assert taken == [[False, False] + [True] * 8, [False] + [True] * 9]


@pytest.mark.parametrize("name", ["temporal", "pilot", "genie"])
def test_our_own_schemes_load_the_solver_before_they_are_timed(name, monkeypatch, clock):
    """The decision of slot 2 is the longest: a mean without it would be too small."""
    loaded = []
    method = METHODS[DEFAULT]
    monkeypatch.setattr(type(method), "solver", lambda self: loaded.append(self))
    block = run_block(SCENE, configure_all(SCENARIO, [name]), 0, range(3))
    assert loaded == [method]
    assert np.isfinite(block.arrays[SECONDS][0]).sum() == (10 if name == "genie" else 9)


def test_slots_tell_the_time_of_one_trial(clock):
    first, second, *_ = eb.slots(SCENARIO, "water-filling")
    assert np.isnan(first.decision_seconds)
    assert second.decision_seconds == 3.0


def small_blocks(monkeypatch):
    monkeypatch.setattr("echobeam.simulation.blocks.MOST_TRIALS", 10)


@pytest.mark.slow
def test_a_resumed_run_counts_the_blocks_that_it_reads(tmp_path, monkeypatch, clock):
    small_blocks(monkeypatch)
    run = Recording(SCENARIO, LIGHT, 30, 0, tmp_path / "r.nc")

    def stop(done, total):
        if done > total / 2:
            raise KeyboardInterrupt

    with pytest.raises(RunError, match="1 of 3 blocks"):
        record(run, stop)
    files = BlockFiles.beside(run.out)
    block = files.read(0)
    block.arrays[SECONDS][0, 1:] = 0.6  # as if another day's machine had been slower
    files.write(0, block)
    done = record(replace(run, resume=True))
    (found,) = done.decisions
    assert found["water-filling"].mean == pytest.approx((0.6 + 0.3 + 0.3) / 3)
    assert np.isnan(found["omni"].mean)
    again = record(replace(run, resume=True))
    assert (again.anything, again.decisions) == (False, ())


@pytest.mark.slow
def test_a_sweep_has_times_of_every_point_but_not_in_its_files(tmp_path, monkeypatch, clock):
    small_blocks(monkeypatch)
    grid = Grid("paper-single", (), (Varied("trials", ("4", "12")),))
    sweep = Sweep(grid, LIGHT, None, 0, tmp_path / "s.nc", csv=tmp_path / "s.csv", full=True)
    done = record_sweep(sweep)
    # 12 trials are two blocks of six
    assert [point["water-filling"].mean for point in done.decisions] == [3.0 / 4.0, 3.0 / 6.0]
    for path in [*tmp_path.rglob("*.nc"), *tmp_path.rglob("*.csv")]:
        assert b"timing" not in path.read_bytes(), path
        assert b"decision" not in path.read_bytes(), path


def test_statistics_hold_no_times(tmp_path):
    grid = Grid("paper-single", (), (Varied("radio.power", ("1", "2")),))
    study = study_in(tmp_path / "b", grid.points(LIGHT, 2, ()), 0)
    run_study(study)
    assert SECONDS in study.files.read(0).arrays
    assert SECONDS not in study.statistics_of(0)
