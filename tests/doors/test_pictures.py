"""All pictures of all kinds of results: nothing raises, warns, is cut off or covered."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from click.testing import CliRunner
from matplotlib.text import Text

import echobeam as eb
from echobeam.cli.plot import command
from echobeam.faults import InputError
from echobeam.plots import KINDS, PlotError, figures
from echobeam.plots.drawing import draw

from ..unit.plot_dataset import build_result
from ..unit.plot_figures import figure_of

ALL = ("temporal", "pilot", "water-filling", "genie", "omni", "pilot-needle", "pilot-predict")
LONG_NAMES = (
    "temporal:ripple=1",
    "temporal:velocity_prior=30 m/s,angle_std=0.5 deg,distance_std=20 cm,width=2,ripple=0.1 N_t",
    "pilot:resolution=0.05 deg,min_rate=0.0004,spread=posterior,centre=previous,width=2.5",
    "water-filling:evolution=exact,velocity_std=0.25 m/s,distance_std=10 cm,angle_std=0.1 deg",
)
ESTIMATES = ("predicted", "estimated", "predicted_cov", "estimated_cov", "measured")


def without(result, *names):
    for name in names:
        result[name] = result[name] * np.nan
    return result


def nothing_at_all():
    result = build_result()
    nature = {"present", "truth", "identity", "position", "uav_position", "uav_velocity"}
    return without(result, *(set(result.data_vars) - nature - {"mode"}))


def infinite_variance():
    result = build_result()
    result["measured_var"].values[:] = np.inf
    return result


def silent_beams():
    result = build_result(trials=2)
    result["beam"].values[:] = 0.0
    return result


def nobody():
    result = build_result(trials=2)
    result["present"].values[:] = False
    result["truth"].values[:] = np.nan
    return without(result, *ESTIMATES, "rate", "sinr", "beam")


CASES = {
    "the paper's": lambda: build_result(ALL[:4], trials=20, with_bound=True),
    "every scheme": lambda: build_result(ALL, trials=2),
    "many users' schemes": lambda: build_result(
        (*ALL, *(f"a scheme of mine, number {i}" for i in range(9))), trials=2
    ),
    "variants with long names": lambda: build_result(
        ("temporal", "pilot", *LONG_NAMES), trials=2, with_bound=True
    ),
    "no objects": lambda: build_result(angles=(), velocities=()),
    "one object": lambda: build_result(angles=(60.0,), velocities=(30.0,), trials=2),
    "eleven objects": lambda: build_result(
        angles=np.linspace(20, 160, 11), velocities=np.linspace(-20, 20, 11), trials=1
    ),
    "an object below the UAV": lambda: build_result(angles=(90.0,), velocities=(0.0,)),
    "one trial": lambda: build_result(trials=1, with_bound=True),
    "one slot": lambda: build_result(("temporal", "pilot", "omni"), slots=1),
    "two slots": lambda: build_result(slots=2),
    "one antenna": lambda: build_result(n_tx=1),
    "omni only": lambda: build_result(("omni",)),
    "genie only": lambda: build_result(("genie",)),
    "everything NaN": nothing_at_all,
    "nobody ever present": nobody,
    "no estimates": lambda: without(build_result(with_bound=True), *ESTIMATES),
    "no rates": lambda: without(build_result(), "rate", "sinr"),
    "beams of zeros": silent_beams,
    "nothing measured": infinite_variance,
    "bound all NaN": lambda: without(build_result(with_bound=True), "bound"),
    "coming and going": lambda: build_result(ALL[:2], coming_and_going=True, with_bound=True),
    "long": lambda: build_result(ALL[:3], slots=50, trials=4, name="paper-long"),
    "traffic": lambda: build_result(
        ALL[:3],
        slots=400,
        trials=2,
        angles=(150, 100, 30, 75),
        velocities=(14.0, -13.0, 12.0, -9.0),
        coming_and_going=True,
        speed=0.0,
    ),
    "high power": lambda: build_result(power=1e6),
    "huge rates and a long name": lambda: build_result(power=1e30, name="x_$" * 60),
    "UAV at the ground": lambda: build_result(height=1.0, speed=15.0, angles=(2.0, 178.0)),
}


QUICK = ("variants with long names", "no objects")


@pytest.fixture(
    params=[pytest.param(c, marks=[] if c in QUICK else [pytest.mark.slow]) for c in CASES]
)
def result(request):
    return CASES[request.param]()


@pytest.mark.parametrize("kind", KINDS)
def test_every_picture_of_every_result_is_whole_and_warns_of_nothing(kind, result):
    """Texts and axes lie within the picture, the legend covers none, letters can be printed."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        data = figure_of(kind, result)
        figure = draw(data)
        figure.draw_without_rendering()
    box = figure.get_tightbbox()
    width, height = figure.get_size_inches()
    assert max(-box.x0, -box.y0, box.x1 - width, box.y1 - height) < 0.02
    for legend in figure.legends:
        outline = legend.get_window_extent()
        assert not any(
            axes.axison and outline.overlaps(axes.get_window_extent()) for axes in figure.axes
        )
    sizes = [text.get_fontsize() for text in figure.findobj(Text) if text.get_text()]
    assert min(sizes) >= 7.0
    json.loads(data.json())
    assert data.csv().startswith("panel,series,")


@pytest.mark.slow
def test_the_file_and_the_order_of_dimensions_do_not_matter(tmp_path):
    result = build_result(trials=3)
    result.to_netcdf(tmp_path / "result.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "result.nc", engine="h5netcdf") as stored:
        from_file = {kind: data.json() for kind, data in figures(stored).items()}
    turned = result.transpose(*reversed(list(result.sizes)))
    for other in (result, turned):
        assert {kind: data.json() for kind, data in figures(other).items()} == from_file


def test_unknown_kinds_are_refused_before_anything_is_drawn():
    with pytest.raises(PlotError, match="no such picture of a run: pie; there are rate, tracking"):
        figures(build_result(trials=1), ["rate", "pie"])


@pytest.mark.parametrize("kind", KINDS)
def test_another_dataset_is_refused_with_what_it_lacks(kind):
    with pytest.raises(PlotError, match="no dimension scheme, trial, slot, object"):
        figures(xr.Dataset({"temperature": ("time", [1.0, 2.0])}), [kind])


def invoke(*arguments):
    done = CliRunner().invoke(command, [str(one) for one in arguments])
    if done.exception is not None and not isinstance(done.exception, SystemExit):
        raise done.exception
    return done


@pytest.fixture
def stored(tmp_path):
    path = tmp_path / "run.v2.nc"
    eb.simulate("paper-single", ["temporal", "pilot"], trials=2).to_netcdf(path, engine="h5netcdf")
    return path


@pytest.mark.slow
def test_all_pictures_are_written_beside_the_result(stored, tmp_path):
    printed = invoke(stored).stdout.split()
    expected = [str(tmp_path / f"run.v2-{kind}.png") for kind in KINDS]
    assert printed == expected
    assert all(Path(path).read_bytes().startswith(b"\x89PNG") for path in expected)


def test_numbers_of_a_chosen_scheme_and_slots_can_be_written_instead(stored, tmp_path):
    invoke(stored, "--kind", "patterns", "--scheme", "pilot", "--slots", "2,4-5",
           "--title", "Mine", "--out", tmp_path / "a.json")  # fmt: skip
    document = json.loads((tmp_path / "a-patterns.json").read_text())
    assert document["title"] == "Mine"
    assert [panel["title"] for panel in document["panels"]] == ["slot 2", "slot 4", "slot 5"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--slots", "2-"), "--slots 2-: expected slots such as 2,4,10 or 1-50"),
        (("--slots", "5-2"), "expected slots"),
        (("--slots", "0"), "no slot 0; it holds 1 to 10"),
        (("--scheme", "magic"), "no scheme 'magic'; it holds temporal, pilot"),
        (("--trial", "2", "--kind", "patterns"), "no trial 2; it holds 0 to 1"),
        (("--out", "a.gif"), r"cannot write a figure as '\.gif'"),
        (("--kind", "sweep"), "no such picture of a run: sweep"),
    ],
)
def test_what_cannot_be_drawn_is_refused(stored, options, message):
    with pytest.raises(InputError, match=message):
        invoke(stored, *options)
