"""Cross-sections of the standard's targets against the standard's own numbers."""

from __future__ import annotations

import numpy as np
import pytest

from echobeam.physics.echo import reflection_coefficient
from echobeam.physics.targets import TARGETS, Lobe
from echobeam.scenario.tables import DIRECTIONAL, RadarTable
from echobeam.units import SPEED_OF_LIGHT

MEANS = {
    "3gpp-small-uav": (-12.81, 3.74),
    "3gpp-human": (-1.37, 3.94),
    "3gpp-large-uav": (-5.85, 2.50),
    "3gpp-vehicle": (11.25, 3.41),
    "3gpp-agv": (-4.25, 2.51),
}
"""10 lg(sigma_M) in dBsm and the deviation of sigma_S in dB, TR 38.901 clause 7.9.2.1."""

NAMES = {
    "3gpp-large-uav": "UAV with large size",
    "3gpp-vehicle": "Vehicle with single scattering point",
    "3gpp-agv": "AGV with single scattering point",
}
"""Names of the targets in the examiner's tables."""


def test_the_targets_are_those_of_the_scenario_file():
    accepted = RadarTable.model_fields["target"].annotation.__args__
    assert set(accepted) == {"constant", "swerling1", *TARGETS}
    assert set(DIRECTIONAL) == {name for name, target in TARGETS.items() if target.directional}
    found = {name: (target.mean, target.fluctuation.std) for name, target in TARGETS.items()}
    assert found == MEANS


def grid() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return zenith and azimuth in steps of 0.25 and 0.5 degrees, and the solid angle's weights."""
    zenith, azimuth = np.radians(np.arange(0.0, 180.01, 0.25)), np.radians(np.arange(0, 360, 0.5))
    return zenith[:, None], azimuth, np.sin(zenith)[:, None]


@pytest.mark.parametrize("name", TARGETS)
def test_the_mean_over_the_solid_angle_is_the_mean_of_the_standard(name):
    """To 0.006 dB: the standard's numbers have two decimals."""
    zenith, azimuth, weight = grid()
    linear = 10.0 ** (0.1 * TARGETS[name].pattern(zenith, azimuth))
    mean = 10.0 * np.log10((linear * weight).sum() / (weight.sum() * azimuth.size))
    assert mean == pytest.approx(TARGETS[name].mean, abs=0.006)
    relative = TARGETS[name].relative(zenith, azimuth)
    assert (relative * weight).sum() / (weight.sum() * azimuth.size) == pytest.approx(1.0, abs=2e-3)


def test_the_vehicles_mean_is_that_of_others_on_the_same_grid():
    """Of the same pattern on this grid the reference gives 11.2496 dBsm, unweighted 12.20."""
    zenith, azimuth, weight = grid()
    linear = 10.0 ** (0.1 * TARGETS["3gpp-vehicle"].pattern(zenith, azimuth))
    mean = (linear * weight).sum() / (weight.sum() * azimuth.size)
    assert 10.0 * np.log10(mean) == pytest.approx(11.2496, abs=5e-5)
    assert 10.0 * np.log10(linear.mean()) == pytest.approx(12.20, abs=5e-3)


def test_a_vehicle_from_ahead_has_the_cross_sections_of_the_standard():
    depression = np.array([10.0, 20.0, 30.0, 45.0, 50.0, 60.0, 70.0, 75.0, 80.0, 85.0, 90.0])
    expected = [14.56, 15.48, 13.57, 7.07, 7.07, 7.07, 7.07, 13.05, 17.61, 20.35, 21.26]
    depression[6] = 69.9  # the table's row of 45 to 70 degrees ends there: zenith 20.1
    expected[6] = 21.26 - min(12.0 * (20.1 / 18.13) ** 2, 14.19)
    found = TARGETS["3gpp-vehicle"].pattern(np.radians(90.0 - depression), 0.0)
    np.testing.assert_allclose(found, expected, atol=5e-3)


@pytest.mark.parametrize("name", DIRECTIONAL)
def test_ranges_of_the_rows_fill_the_sphere_without_overlap(name):
    """Every aspect has one row; ranges are closed below and open above, 180 degrees included."""
    zenith = np.radians([0.0, 29.999, 30.001, 44.999, 45.001, 134.999, 135.001, 180.0])
    azimuth = np.radians([-180.0, -135.0, -45.0, 0.0, 44.999, 45.001, 134.999, 225.001, 359.0])
    lobes = TARGETS[name].lobes
    each = [
        lobe.pattern(*np.broadcast_arrays(np.degrees(zenith)[:, None], np.degrees(azimuth)))
        for lobe in lobes
    ]
    np.testing.assert_array_equal(np.isfinite(each).sum(axis=0), 1)
    assert np.isfinite(TARGETS[name].pattern(zenith[:, None], azimuth)).all()


@pytest.mark.parametrize("name", TARGETS)
def test_left_and_right_are_alike_and_azimuths_are_periodic(name):
    rng = np.random.default_rng(1)
    zenith, azimuth = rng.uniform(0.0, np.pi, 500), rng.uniform(-np.pi, np.pi, 500)
    target = TARGETS[name]
    found = target.pattern(zenith, azimuth)
    np.testing.assert_allclose(target.pattern(zenith, -azimuth), found, atol=1e-9)
    np.testing.assert_allclose(target.pattern(zenith, azimuth + 2.0 * np.pi), found, atol=1e-9)


def test_an_unknown_aspect_has_no_cross_section_unless_it_is_alike_from_all_sides():
    assert np.isnan(TARGETS["3gpp-vehicle"].pattern(1.0, np.nan))
    assert TARGETS["3gpp-vehicle"].pattern(0.1, np.nan) == pytest.approx(
        TARGETS["3gpp-vehicle"].pattern(0.1, 0.0)
    )  # the roof
    assert TARGETS["3gpp-human"].pattern(np.nan, np.nan) == -1.37


def test_the_coupling_loss_is_that_of_the_radar_equation():
    """Small UAV, 30 GHz, 200 m: 177.8335 dB by 2 PL + 10 lg(c^2 / (4 pi f^2)) - 10 lg sigma.

    With alpha0 = lambda / (4 pi) the echo |epsilon|^2 / d^4 of (12) is the radar equation's for
    |epsilon|^2 = alpha0^2 sigma / (4 pi).
    """
    wavelength, distance = SPEED_OF_LIGHT / 30e9, 200.0
    sigma = 10.0 ** (0.1 * float(TARGETS["3gpp-small-uav"].pattern(np.pi / 2, 0.0)))
    path_loss = 20.0 * np.log10(4.0 * np.pi * distance / wavelength)
    aperture = 10.0 * np.log10(wavelength**2 / (4.0 * np.pi))
    standard = 2.0 * path_loss + aperture - 10.0 * np.log10(sigma)
    assert standard == pytest.approx(177.8335, abs=5e-5)
    alpha0 = wavelength / (4.0 * np.pi)
    beta = reflection_coefficient(alpha0 * np.sqrt(sigma / (4.0 * np.pi)), distance)
    assert -20.0 * np.log10(np.abs(beta)) == pytest.approx(standard, abs=1e-9)


@pytest.mark.parametrize(
    ("name", "model"),
    [("3gpp-small-uav", "UAV with small size"), ("3gpp-human", "Human with RCS model 1")],
)
def test_the_angle_independent_targets_are_those_of_the_examiner(name, model):
    row = examiner().rcs_model_1(target=model)
    target = TARGETS[name]
    found = (float(row.lg_sigma_m_dbsm), float(row.sigma_sigmaS_db))
    assert found == (target.mean, target.fluctuation.std)
    assert target.lobes == ()


@pytest.mark.parametrize("name", NAMES)
def test_the_lobes_are_those_of_the_examiner(name):
    target, isac = TARGETS[name], examiner()
    points = ["Front", "Left", "Back", "Right", "Roof"]
    points += ["Bottom"] if name == "3gpp-large-uav" else []
    rows = [isac.rcs_model_2(target=NAMES[name], scattering_point=point) for point in points]
    assert {_lobe(row) for row in rows} == set(target.lobes)
    assert len(rows) == len(target.lobes)
    for row in rows:
        found = (float(row.lg_sigma_m_dbsm), float(row.sigma_sigmaS_db))
        assert found == (target.mean, target.fluctuation.std)


def examiner():
    """Return clause 7.9 of the package tr3gpp, which holds the tables of the standard."""
    tr3gpp = pytest.importorskip("tr3gpp", reason="tr3gpp, the examiner, is not installed")
    return tr3gpp.tr38901.section("7.9")


def _lobe(row) -> Lobe:
    """Return the examiner's row as a lobe; ranges of azimuths are 45 degrees to either side."""
    low, high = (float(part) for part in row.range_theta_deg.strip("[])").split(","))
    around = row.phi_center_deg == "-"
    if around:
        assert row.range_phi_deg.replace(" ", "") == "[0,360)"
    else:
        first, last = (float(part) for part in row.range_phi_deg.strip("[])").split(","))
        centre = float(row.phi_center_deg)
        assert (first, last) == (centre - 45.0, centre + 45.0)
    return Lobe(
        azimuth=None if around else float(row.phi_center_deg),
        azimuth_width=np.inf if around else float(row.phi_3db_deg),
        zenith=float(row.theta_center_deg),
        zenith_width=float(row.theta_3db_deg),
        peak=float(row.g_max),
        depth=float(row.sigma_max),
        lowest=low,
        highest=high,
    )
