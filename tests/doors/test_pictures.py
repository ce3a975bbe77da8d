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
from echobeam.commands.plot import readable
from echobeam.faults import InputError, RunError
from echobeam.plots import KINDS, OF_TRACKS, PlotError, figures
from echobeam.plots.drawing import draw

from ..unit.plot_dataset import build_result, build_unlabelled
from ..unit.plot_figures import figure_of

pytestmark = pytest.mark.slow  # the quick selection stays under a minute

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


def whole():
    return build_result(trials=3, with_bound=True)


def nothing_at_all():
    result = whole()
    nature = {"present", "truth", "identity", "position", "uav_position", "uav_velocity"}
    return without(result, *(set(result.data_vars) - nature - {"mode"}))


def silent_and_blind():
    result = whole()
    result["measured_var"].values[:] = np.inf
    result["beam"].values[:] = 0.0
    return result


def nobody():
    result = build_result(trials=2)
    result["present"].values[:] = False
    result["truth"].values[:] = np.nan
    return without(result, *ESTIMATES, "rate", "sinr", "beam")


CASES = {
    "the paper's": lambda: build_result(ALL[:4], trials=20, with_bound=True),
    "many users' schemes": lambda: build_result(
        (*ALL, *(f"a scheme of mine, number {i}" for i in range(9))), trials=2
    ),
    "variants with long names": lambda: build_result(
        ("temporal", "pilot", *LONG_NAMES), trials=2, with_bound=True
    ),
    "no objects": lambda: build_result(angles=(), velocities=()),
    "eleven objects": lambda: build_result(
        angles=np.linspace(20, 160, 11), velocities=np.linspace(-20, 20, 11), trials=1
    ),
    "an object below the UAV": lambda: build_result(angles=(90.0,), velocities=(0.0,)),
    "one trial and one antenna": lambda: build_result(trials=1, n_tx=1, with_bound=True),
    "one slot": lambda: build_result(("temporal", "pilot", "omni"), slots=1),
    "omni only": lambda: build_result(("omni",)),
    "genie only": lambda: build_result(("genie",)),
    "everything NaN": nothing_at_all,
    "nobody ever present": nobody,
    "no estimates": lambda: without(whole(), *ESTIMATES),
    "neither rates nor a bound": lambda: without(whole(), "rate", "sinr", "bound"),
    "beams of zeros and nothing measured": silent_and_blind,
    "traffic": lambda: build_result(
        ALL[:3],
        slots=400,
        trials=2,
        angles=(150, 100, 30, 75),
        velocities=(14.0, -13.0, 12.0, -9.0),
        coming_and_going=True,
        speed=0.0,
        with_bound=True,
    ),
    "huge rates and a long name": lambda: build_result(power=1e30, name="x_$" * 60),
    "UAV at the ground": lambda: build_result(height=1.0, speed=15.0, angles=(2.0, 178.0)),
}


UNLABELLED = {
    "three objects": lambda: build_unlabelled(
        ALL[:4], trials=3, slots=20, angles=(75, 135, 50), velocities=(30.0, -3.0, 10.0)
    ),
    "thirty objects": lambda: build_unlabelled(
        ("temporal", *LONG_NAMES), "horizontal", trials=1, slots=80,
        angles=np.linspace(20, 160, 30), velocities=np.linspace(-20, 20, 30),
    ),
    "two slots": lambda: build_unlabelled(slots=2),
    "no objects": lambda: build_unlabelled(angles=(), velocities=(), trials=2),
}  # fmt: skip

QUICK = ("variants with long names", "no objects")


@pytest.fixture(
    params=[pytest.param(c, marks=[] if c in QUICK else [pytest.mark.slow]) for c in CASES]
)
def result(request):
    return CASES[request.param]()


@pytest.mark.parametrize("kind", KINDS)
def test_every_picture_of_every_result_is_whole_and_warns_of_nothing(kind, result):
    draw_whole(kind, result)


@pytest.mark.parametrize("kind", [*KINDS, *OF_TRACKS])
@pytest.mark.parametrize(
    "case",
    [pytest.param(c, marks=[] if c == "no objects" else [pytest.mark.slow]) for c in UNLABELLED],
)
def test_every_picture_of_unlabelled_results_is_whole_and_warns_of_nothing(kind, case):
    draw_whole(kind, UNLABELLED[case]())


DRAWN = set()
"""Records that were drawn and found whole: a kind without what is missing has the same again."""


def draw_whole(kind, result):
    """Texts and axes lie within the picture, the legend covers none, letters can be printed."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        data = figure_of(kind, result)
        json.loads(data.json())
        if data.json() in DRAWN:
            return
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
    assert data.csv().startswith("panel,series,")
    DRAWN.add(data.json())


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


@pytest.fixture(scope="module")
def simulated():
    return eb.simulate("paper-single", ["temporal", "pilot"], trials=2)


@pytest.fixture
def stored(simulated, tmp_path):
    path = tmp_path / "run.v2.nc"
    simulated.to_netcdf(path, engine="h5netcdf")
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
        (("--x", "uav.height"), "--x uav.height: belongs to the picture of a sweep"),
        (("--quantity", "outage"), "--quantity outage: belongs to the picture of a sweep"),
        (("--scheme", "pilot", "--scheme", "pilot"), "scheme 'pilot' is asked for twice"),
        (("--out", "no/a.png"), "no directory no"),
    ],
)
def test_what_cannot_be_drawn_is_refused(stored, options, message):
    with pytest.raises(InputError, match=message):
        invoke(stored, *options)


def test_a_full_disk_is_a_failed_run_that_names_the_file(stored, tmp_path, monkeypatch):
    def full(data, path, **_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("echobeam.commands.plot.write", full)
    with pytest.raises(RunError, match=r"a-rate.png: cannot be written: No space left on device"):
        invoke(stored, "--kind", "rate", "--out", tmp_path / "a.png")


@pytest.fixture(scope="module")
def swept(tmp_path_factory):
    out = tmp_path_factory.mktemp("swept") / "s.nc"
    vary = {"uav.height": [80, 90], "radio.power": [1, 2]}
    with eb.sweep("paper-single", vary, scheme=["omni", "genie"], trials=2, out=out) as dataset:
        return dataset.load()


@pytest.mark.parametrize(
    ("named", "message"),
    [
        ({"slots": 11, "quantity": "nees"}, "expected one slot of the sweep, from 1 to 10"),
        ({"slots": [3, 4], "quantity": "nees"}, "--slots 3, 4: expected one slot of the sweep"),
        ({"slots": 3}, "frame_rate_mean is of the whole run; rate_mean, angle_rmse"),
        ({"trial": 1}, "--trial 1: belongs to pictures of a run"),
    ],
)
def test_of_a_sweep_what_would_be_passed_over_is_refused(swept, named, message):
    with pytest.raises(InputError, match=message):
        eb.plot(swept, **named)


@pytest.mark.parametrize(
    ("cut", "message"),
    [
        (lambda whole: whole.isel({"uav.height": 0}), "no dimension uav.height"),
        (lambda whole: whole.sel(scheme="omni"), "no dimension scheme"),
        (lambda whole: whole.isel({"radio.power": []}), "nothing along the dimension radio.power"),
        (lambda whole: whole.drop_vars("uav.height"), "no coordinate uav.height"),
        (lambda whole: whole.assign_attrs(vary="?"), "does not say what varies"),
    ],
)
def test_a_sweep_that_was_cut_apart_is_refused(swept, cut, message):
    for read in (eb.plot, eb.summary):
        with pytest.raises(InputError, match=message):
            read(cut(swept))


def test_the_order_of_a_sweeps_dimensions_does_not_matter(swept, tmp_path):
    swept.to_netcdf(tmp_path / "s.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "s.nc", engine="h5netcdf") as stored:
        turned = eb.summary(stored.transpose())
    assert turned.unstack().equals(eb.summary(swept).reorder_levels(turned.index.names).unstack())


@pytest.mark.parametrize("value", [3, None, b"r.nc", [], xr.DataArray(1.0)], ids=repr)
def test_what_is_no_result_at_all_is_one_message(value):
    for read in (eb.plot, eb.summary):
        with pytest.raises(InputError, match=f"{type(value).__name__} is no result"):
            read(value)


@pytest.mark.parametrize("cut", [{"state": [2, 0, 1]}, {"slot": [3, 2]}, {"scheme": [0, 0]}])
def test_a_dataset_in_disorder_is_refused_by_all_that_read_it(cut):
    for read in (eb.plot, eb.summary):
        with pytest.raises(InputError, match=r"the dataset: not a result of echobeam: "):
            read(build_result(trials=2).isel(cut))


def test_a_scenario_that_is_no_toml_is_one_message():
    with pytest.raises(InputError, match="its attribute scenario is no TOML"):
        eb.summary(build_result(trials=2).assign_attrs(scenario="name = 3 = 4"))


@pytest.mark.parametrize("slots", [np.array([2, 3]), range(2, 4), iter((2, 3)), [2, 2, 3]])
def test_slots_of_any_kind_are_slots(slots):
    panels = eb.plot(build_result(trials=1), "patterns", slots=slots).axes
    assert [axes.get_title() for axes in panels][:2] == ["slot 2", "slot 3"]


@pytest.mark.parametrize("slots", [2.0, "2-5", None, [2.5]])
def test_slots_that_are_none(slots):
    with pytest.raises(InputError, match=r"slots: .* is not accepted; expected"):
        eb.plot(build_result(trials=1), "patterns", slots=slots)


def test_a_title_is_letters_whatever_the_locale_and_the_type():
    assert readable("gr\udcc3\udcbcn") == "gr\u00fcn"
    for title, shown in ((3, "3"), ("gr\udcc3\udcbcn", "gr\u00fcn")):
        figure = eb.plot(build_result(trials=1), title=title)
        assert any(text.get_text().startswith(shown) for text in figure.findobj(Text))
