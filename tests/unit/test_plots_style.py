"""Looks: fixed and distinct, one for all, whatever the user's settings are."""

from __future__ import annotations

import subprocess
import sys

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.colors import to_rgb

from echobeam.plots import looks as style
from echobeam.plots.drawing import draw, wrap_name
from echobeam.plots.record import Axis, FigureData, Panel, Series

from .plot_dataset import build_result
from .plot_figures import figure_of

BUILT_IN = ("temporal", "pilot", "water-filling", "genie", "omni", "pilot-needle", "pilot-predict")

# Machado, Oliveira and Fernandes (2009), severity 1.
BLINDNESS = {
    "protanopia": [[0.152, 1.053, -0.205], [0.115, 0.786, 0.099], [-0.004, -0.048, 1.052]],
    "deuteranopia": [[0.367, 0.861, -0.228], [0.280, 0.673, 0.047], [-0.012, 0.043, 0.969]],
    "tritanopia": [[1.256, -0.077, -0.179], [-0.078, 0.931, 0.148], [0.005, 0.691, 0.304]],
}


def linear(colour):
    rgb = np.array(to_rgb(colour))
    return np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)


def lab(rgb):
    """Return CIE L*a*b* (D65) of linear sRGB."""
    matrix = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    xyz = np.clip(matrix @ np.clip(rgb, 0, 1) / [0.9505, 1.0, 1.089], 1e-6, None)
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


@pytest.mark.parametrize("kind", BLINDNESS)
def test_the_four_main_schemes_colours_are_apart_for_the_colour_blind(kind):
    """A difference in CIE L*a*b* beyond 10 is told at a glance; 2.3 can just be seen."""
    seen = [
        lab(np.array(BLINDNESS[kind]) @ linear(style.SCHEME_LOOKS[name].colour))
        for name in BUILT_IN[:4]
    ]
    apart = [np.linalg.norm(a - b) for i, a in enumerate(seen) for b in seen[:i]]
    assert min(apart) > 10


@pytest.mark.parametrize("feature", ["colour", "marker", "line"])
def test_every_built_in_scheme_differs_in_colour_marker_and_line(feature):
    looks = style.scheme_looks(BUILT_IN)
    assert len({getattr(look, feature) for look in looks.values()}) == len(BUILT_IN)


def test_users_schemes_differ_from_each_other_and_from_the_built_in_ones():
    names = [*BUILT_IN, *(f"mine-{i}" for i in range(7))]
    looks = style.scheme_looks(names)
    assert len({(look.colour, look.line) for look in looks.values()}) == 14
    assert len({look.marker for look in looks.values()}) == 14


def test_any_number_of_users_schemes_gets_a_look():
    assert len(style.scheme_looks([f"mine-{i}" for i in range(50)])) == 50


def test_variants_take_colours_that_the_schemes_beside_them_leave_free():
    names = ["temporal:ripple=1", "temporal", "temporal:ripple=5", "pilot", "genie"]
    looks = style.scheme_looks(names)
    assert looks["temporal"] == style.SCHEME_LOOKS["temporal"]
    for feature in ("colour", "marker", "line"):
        assert len({getattr(looks[name], feature) for name in names}) == len(names)


def test_forty_variants_are_all_told_apart():
    looks = style.scheme_looks(["temporal", *(f"temporal:ripple={i}" for i in range(40))])
    assert len({(look.colour, look.marker) for look in looks.values()}) == 41


def test_names_are_wrapped_after_commas_and_lose_nothing():
    name = "temporal:velocity_prior=30 m/s,angle_std=0.5 deg,width=2"
    lines = wrap_name(name, 32).split("\n")
    assert lines == ["temporal:velocity_prior=30 m/s,", "angle_std=0.5 deg,width=2"]
    assert wrap_name("x" * 70, 32).split("\n") == ["x" * 32, "x" * 32, "x" * 6]
    assert wrap_name("temporal", 32) == "temporal"


def test_objects_differ():
    looks = [style.object_look(k) for k in range(style.MAX_OBJECTS)]
    assert len({look.colour for look in looks}) == len({look.marker for look in looks}) == 8


def test_drawing_leaves_the_users_settings_alone():
    with mpl.rc_context({"font.size": 31.0, "lines.linewidth": 9.0}):
        before = dict(mpl.rcParams)
        draw(figure_of("rate", build_result(trials=2)))
        assert dict(mpl.rcParams) == before


@pytest.mark.slow
def test_drawing_needs_no_pyplot():
    code = (
        "import sys, echobeam.plots; assert 'matplotlib' not in sys.modules;"
        "import echobeam.plots.drawing; assert 'matplotlib.pyplot' not in sys.modules"
    )
    subprocess.run([sys.executable, "-c", code], check=True)


def test_importing_echobeam_does_not_import_matplotlib():
    code = "import sys, echobeam; assert 'matplotlib' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


def test_ticks_of_a_logarithmic_axis_suit_its_limits_not_its_data():
    """Data of less than an octave in two decades: 1, 2, 5 are enough, and 1.5, 3, 4, 7 crowd."""
    y = Axis("Error", log=True, limits=(0.1, 10.0))
    panel = Panel(Axis("Slot"), y, (Series("one", (1.0, 2.0), (4.0, 5.0)),))
    (axes,) = draw(FigureData("ticks", "Ticks", (panel,))).axes
    low, high = axes.get_ylim()
    shown = [tick for tick in axes.get_yticks() if low <= tick <= high]
    np.testing.assert_allclose(shown, [0.1, 0.2, 0.5, 1, 2, 5, 10])
