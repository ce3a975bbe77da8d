"""All pictures of all kinds of results: nothing raises, warns, is cut off or covered."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
import xarray as xr
from matplotlib.text import Text

from echobeam.plots import KINDS, PlotError, draw_all, picture_paths

from ..unit.plot_dataset import build_result

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
    "no scenario": lambda: build_result().assign_attrs(scenario=""),
}


QUICK = ("variants with long names", "no objects")


@pytest.fixture(
    params=[pytest.param(c, marks=[] if c in QUICK else [pytest.mark.slow]) for c in CASES]
)
def result(request):
    return CASES[request.param]()


@pytest.mark.parametrize("kind", KINDS)
def test_every_picture_of_every_result_is_clean(result, kind):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        figure = KINDS[kind](result)
        figure.draw_without_rendering()
    assert shown(figure), "an empty picture must say why"
    assert_nothing_is_cut(figure)
    assert_legend_covers_no_axes(figure)


def shown(figure):
    """Whether there is a line with data, or a text within the axes."""
    for axes in figure.axes:
        if any(text.get_text().strip() for text in axes.texts):
            return True
        if any(np.isfinite(np.asarray(line.get_ydata(), float)).any() for line in axes.lines):
            return True
    return False


def assert_nothing_is_cut(figure):
    """Texts and axes lie within the figure (a pixel's tolerance)."""
    box = figure.get_tightbbox()
    width, height = figure.get_size_inches()
    assert box.x0 >= -0.02
    assert box.y0 >= -0.02
    assert box.x1 <= width + 0.02
    assert box.y1 <= height + 0.02


def assert_legend_covers_no_axes(figure):
    for legend in figure.legends:
        box = legend.get_window_extent()
        for axes in figure.axes:
            assert not (axes.axison and box.overlaps(axes.get_window_extent()))


@pytest.mark.parametrize("kind", KINDS)
def test_letters_are_large_enough_to_print(kind):
    figure = KINDS[kind](build_result(ALL[:4], with_bound=True))
    sizes = [text.get_fontsize() for text in figure.findobj(Text) if text.get_text()]
    assert min(sizes) >= 7.0


@pytest.mark.slow
def test_all_pictures_are_written_beside_the_stem(tmp_path):
    written = draw_all(build_result(trials=2), tmp_path / "run.v2", ".png")
    kinds = ("rate", "tracking", "patterns", "trajectories", "consistency", "forecast")
    expected = [f"run.v2-{kind}.png" for kind in kinds]
    assert [path.name for path in written] == expected
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(expected)
    assert all(path.read_bytes().startswith(b"\x89PNG") for path in written)


@pytest.mark.slow
def test_a_result_file_gives_the_pictures_that_the_result_gives(tmp_path):
    result = build_result(trials=3, with_bound=True)
    result.to_netcdf(tmp_path / "result.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "result.nc", engine="h5netcdf") as stored:
        from_file = draw_all(stored, tmp_path / "file", "png")
    in_memory = draw_all(result, tmp_path / "memory", "png")
    for one, two in zip(from_file, in_memory, strict=True):
        assert one.read_bytes() == two.read_bytes()


@pytest.mark.slow
def test_the_order_of_dimensions_does_not_matter(tmp_path):
    result = build_result(trials=3, with_bound=True)
    turned = result.transpose(*reversed(list(result.sizes)))
    one = draw_all(result, tmp_path / "one")
    two = draw_all(turned, tmp_path / "two")
    assert [p.read_bytes() for p in one] == [p.read_bytes() for p in two]


def test_some_kinds_can_be_chosen(tmp_path):
    (path,) = draw_all(build_result(trials=1), tmp_path / "a", "svg", kinds=["rate"])
    assert path == tmp_path / "a-rate.svg"


def test_unknown_kinds_and_suffixes_are_refused_before_anything_is_drawn(tmp_path):
    with pytest.raises(PlotError, match="no such picture: pie; there are rate, tracking"):
        picture_paths(tmp_path / "a", kinds=["rate", "pie"])
    with pytest.raises(PlotError, match=r"cannot write a picture as '\.gif'"):
        draw_all(build_result(trials=1), tmp_path / "a", ".gif")
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("kind", KINDS)
def test_another_dataset_is_refused_with_what_it_lacks(kind):
    with pytest.raises(PlotError, match="the result holds no"):
        KINDS[kind](xr.Dataset({"temperature": ("time", [1.0, 2.0])}))
