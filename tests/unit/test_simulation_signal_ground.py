"""Echo signals of planar arrays in runs on the ground."""

import numpy as np
import pytest

import echobeam as eb
from echobeam.estimation.consistency import chi_square_band
from echobeam.scenario.checking import ScenarioError

SIGNAL = {
    "radar.model": "signal",
    "radar.crb": "exact",
    "radar.integration": "grid",
    "radar.subcarriers": 32,
    "radar.symbols": 8,
    "radar.bandwidth": "10 MHz",
    "radio.power": 2e5,
    "array.rows": 6,
    "array.columns": 6,
    "frame.slots_per_frame": 4,
}


@pytest.mark.slow
@pytest.mark.parametrize("angle", ["glrt", "capon"])
def test_objects_are_measured_as_accurately_as_stated(angle):
    """Squared errors over stated variances of 96 measurements, and beams that follow."""
    given = eb.load_scenario("ground").replace(SIGNAL | {"radar.angle": angle})
    scheme = "water-filling:tracker=ground,beamer=posterior"
    result = eb.simulate(given, schemes=["genie", scheme], trials=8, seed=2)
    one = result.isel(scheme=1)
    found, stated = one["measured"].values, one["measured_var"].values
    assert np.isfinite(found).all()
    uav = result["uav_position"].values[0]
    offset = result["position"].values - uav
    distance = np.linalg.norm(offset, axis=-1)
    ideal = np.stack([*np.moveaxis(offset[..., :2], -1, 0), 2.0 / 299_792_458.0 * distance**2], -1)
    ideal = ideal / distance[..., None]
    square = (found[..., :3] - ideal) ** 2 / stated[..., :3]
    low, high = chi_square_band(1, square[..., 0].size, 0.999)
    for component in range(3):
        assert low < square[..., component].mean() < high
    rate = result["rate"].sum("object").isel(slot=slice(1, None)).mean(["slot", "trial"]).values
    assert rate[1] > 0.98 * rate[0]


@pytest.mark.slow
def test_an_array_of_one_column_measures_one_cosine():
    line = {"array.kind": "planar", "array.rows": 12, "array.columns": 1, "radio.power": 1e6}
    given = eb.load_scenario("ground").replace(SIGNAL | line)
    result = eb.simulate(given, schemes=["omni"], trials=2, seed=3).isel(scheme=0)
    measured = result["measured"].sel(measurement=["u", "delay"])
    assert np.isfinite(measured).all()
    assert np.isnan(result["measured"].sel(measurement="v")).all()


@pytest.mark.slow
def test_objects_are_found_in_the_signal_without_labels():
    """After four slots each object has a track within five deviations of the accuracy."""
    given = eb.load_scenario("ground").replace(SIGNAL | {"radar.detections": "unlabelled"})
    scheme = "water-filling:tracker=ground,beamer=posterior"
    result = eb.simulate(given, schemes=[scheme], trials=3, seed=4).isel(scheme=0, slot=-1)
    off = (result["estimated"] - result["truth"]).sel(state=["x", "y"]).values
    assert np.isfinite(off).all()
    cov = result["estimated_cov"].values[..., :2, :2]
    square = (off * np.linalg.solve(cov, off[..., None])[..., 0]).sum(axis=-1)
    assert square.max() < chi_square_band(2, 1, 0.9999)[1]


def test_an_object_that_the_waveform_folds_is_refused():
    far = {"objects.0.position": ["4 km", "0 m"]}
    with pytest.raises(ScenarioError, match="an object's echo has a delay"):
        eb.simulate(eb.load_scenario("ground").replace(SIGNAL | far), schemes=["omni"], trials=1)
