"""Tracking on the plane: consistency in every slot, rates, first states, sizes of sums."""

import numpy as np
import pytest

import echobeam as eb
from echobeam.estimation.consistency import chi_square_band
from echobeam.tracking.ground import GroundMeasurement
from echobeam.tracking.ground_start import first_state, sought
from echobeam.tracking.ground_update import points_needed, update
from echobeam.values import GaussianState, UavState

from ..plane import Hovering, tracked

AHEAD = ((0.0, -1.0, 0.0), (0.0, 0.0, 1.0))
"""An array that looks along x: rows from left to right, columns upward."""

TILTED = ((0.0, -1.0, 0.0), (np.sin(0.5), 0.0, np.cos(0.5)))
"""The same, looking down by 0.5 rad."""

SETTINGS = [
    (Hovering(), (40.0, 30.0), (0.888, 0.857)),
    (Hovering(), (80.0, -60.0), (0.876, 0.823)),
    (Hovering(16), (40.0, 30.0), (0.898, 0.892)),
]
"""Setting, position and the rates over the genie's of a prototype that knew the variances."""


def objects(place, count, velocity=None, altitude_std=0.7):
    """Objects at a place, velocities and altitude errors of the priors' laws."""
    rng = np.random.default_rng(5)
    truth = np.zeros((count, 5))
    truth[:, :2] = place
    truth[:, 2:4] = 30.0 * rng.standard_normal((count, 2)) if velocity is None else velocity
    truth[:, 4] = altitude_std * rng.standard_normal(count)
    return truth


@pytest.mark.slow
@pytest.mark.parametrize(("setting", "place", "rates"), SETTINGS)
def test_the_belief_is_consistent_in_every_slot(setting, place, rates):
    """Truth drawn from the stated laws: inside the 99.9 % band of the mean of 300."""
    low, high = chi_square_band(4, 300, 0.999)
    made = tracked(setting, objects(place, 300))
    for mean in (made.nees.mean(axis=1), made.nis[1:].mean(axis=1)):
        assert (mean > low).all()
        assert (mean < high).all()


@pytest.mark.slow
@pytest.mark.parametrize(("setting", "place", "rates"), SETTINGS)
def test_the_rate_is_that_of_a_filter_that_knows_the_variance(setting, place, rates):
    """At (20, 5) m/s, 300 trials: three standard errors of the mean, and of the quantile."""
    ratio = tracked(setting, objects(place, 300, (20.0, 5.0), 0.0), noise=False).ratio
    assert ratio.mean() > rates[0] - 3.0 * ratio.std() / np.sqrt(300)
    assert np.quantile(ratio, 0.05) > rates[1] - 0.006


@pytest.mark.slow
@pytest.mark.parametrize(
    ("setting", "place"),
    [
        (Hovering(), (2.0, 3.0)),
        (Hovering(power=100.0), (40.0, 30.0)),
        (Hovering(power=1e6), (40.0, 30.0)),
        (Hovering(height=140.0), (60.0, 60.0)),
    ],
)
def test_it_is_consistent_below_the_array_and_at_any_power(setting, place):
    low, high = chi_square_band(4, 300, 0.999)
    mean = tracked(setting, objects(place, 300), slots=6).nees.mean(axis=1)
    assert (mean > low).all()
    assert (mean < high).all()


@pytest.mark.parametrize("array", [((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), AHEAD, TILTED])
def test_the_slopes_are_those_of_complex_steps(array):
    model = GroundMeasurement(30e9, 2, array)
    uav = UavState(np.array([5.0, -7.0, 90.0]), np.array([4.0, 3.0, -2.0]))
    state = np.random.default_rng(6).standard_normal((8, 5)) * [60.0, 60.0, 20.0, 20.0, 0.7]
    H = model.jacobian(state, uav)
    for column in range(5):
        step = np.where(np.arange(5) == column, 1e-30j, 0.0)
        slope = model.expected(state + step, uav).imag / 1e-30
        scale = np.abs(H).max(axis=(0, 2))
        np.testing.assert_allclose(H[..., column] / scale, slope / scale, atol=1e-14)


@pytest.mark.parametrize("array", [AHEAD, TILTED])
def test_cosines_are_scalar_products_with_the_arrays_axes(array):
    model = GroundMeasurement(30e9, 2, array)
    uav = UavState(np.array([5.0, -7.0, 90.0]), np.zeros(3))
    state = np.array([[65.0, 13.0, 0.0, 0.0, 0.5]])
    sight = np.array([60.0, 20.0, -90.5])
    seen = model.expected(state, uav)[0, :2]
    np.testing.assert_allclose(seen, np.array(array) @ sight / np.linalg.norm(sight), rtol=1e-14)
    assert np.dot(model.facing, sight) > 0.0
    np.testing.assert_allclose(np.linalg.norm(model.facing), 1.0)


def brute_force(value, variance, model, uav, centre, half, altitude_std):
    """Moments of x, y, b on a grid of all three; the Doppler tells nothing here."""
    line = np.linspace(-1.0, 1.0, 161)
    b = altitude_std * np.linspace(-4.0, 4.0, 33)
    x, y, b = np.meshgrid(centre[0] + half * line, centre[1] + half * line, b, indexing="ij")
    state = np.stack([x, y, 0.0 * x, 0.0 * x, b], axis=-1)
    e = (value - model.expected(state, uav))[..., :3]
    log = -0.5 * (e**2 / variance[:3]).sum(axis=-1) - 0.5 * (b / altitude_std) ** 2
    weight = np.exp(log - log.max())
    weight /= weight.sum()
    place = np.stack([x, y, b], axis=-1).reshape(-1, 3)
    mean = weight.ravel() @ place
    off = place - mean
    return mean, (weight.ravel()[:, None] * off).T @ off


@pytest.mark.parametrize("array", [((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), TILTED])
@pytest.mark.parametrize("cosine_std", [0.02, 0.1])
def test_a_first_state_is_that_of_brute_force(array, cosine_std):
    model = GroundMeasurement(30e9, 2, array)
    uav = UavState(np.array([5.0, -7.0, 90.0]), np.zeros(3))
    truth = np.array([55.0, 20.0, 0.0, 0.0, 0.2])
    variance = np.array([cosine_std**2, cosine_std**2, (4e-9) ** 2, 1e16])
    value = model.expected(truth, uav) + np.array([0.5, -0.3, 0.4, 0.0]) * np.sqrt(variance)
    made = first_state(
        value[None, None],
        variance[None, None],
        lambda state: np.broadcast_to(variance, (*state.shape[:-1], 4)),
        model,
        uav,
        (30.0, 30.0, 0.7),
        24,
    )
    half = 60.0 if cosine_std > 0.05 else 15.0
    mean, cov = brute_force(value, variance, model, uav, made.mean[0, 0, :2], half, 0.7)
    scale = np.sqrt(cov.diagonal())
    pick = [0, 1, 4]
    np.testing.assert_allclose((made.mean[0, 0, pick] - mean) / scale, 0.0, atol=0.05)
    found = made.cov[0, 0][np.ix_(pick, pick)]
    np.testing.assert_allclose((found - cov) / np.outer(scale, scale), 0.0, atol=0.1)


@pytest.mark.parametrize("array", [((1.0, 0.0, 0.0), (0.0, 1.0, 0.0)), AHEAD, TILTED])
def test_a_new_object_is_sought_where_its_measurement_can_come_from(array):
    """Of measurements of one place all but one in a thousand lead to a rectangle around it."""
    model = GroundMeasurement(30e9, 2, array)
    uav = UavState(np.array([5.0, -7.0, 90.0]), np.zeros(3))
    truth = np.array([85.0, 20.0, 0.0, 0.0, 0.0])
    std = np.array([0.2, 0.2, 1e-8, 1e4])
    noise = std * np.random.default_rng(8).standard_normal((4000, 4))
    value = model.expected(truth, uav) + noise
    centre, reach = sought(value, np.broadcast_to(std**2, value.shape), model, uav)
    inside = (np.abs(truth[:2] - centre) <= np.diagonal(reach, axis1=-2, axis2=-1)).all(axis=-1)
    assert (~inside).sum() <= 12


def test_wide_beliefs_are_split_and_narrow_ones_are_not():
    setting = Hovering()
    state = np.array([40.0, 30.0, 20.0, 5.0, 0.0])

    def needed(*stds):
        cov = np.diag(np.square([*stds, 5.0, 5.0, 0.5]))
        belief = GaussianState(state[None, None], cov[None, None], np.array([[True]]))
        return points_needed(belief, setting.model, setting.uav, np.pi * 7).tolist()

    assert needed(0.5, 0.5) == [[1, 1]]
    assert needed(0.5, 5.0) == [[3, 1]]
    assert needed(10.0, 4.0) == [[9, 3]]
    assert needed(500.0, 500.0) == [[17, 17]]


def test_a_trial_comes_out_alike_alone_and_among_others():
    """Beliefs of all widths: those of one size are brought together, and none gains by it."""
    setting, rng = Hovering(), np.random.default_rng(9)
    count = 12
    mean = np.tile([40.0, 30.0, 20.0, 5.0, 0.0], (count, 2, 1))
    stds = np.stack([np.logspace(-1.0, 1.5, count)] * 2, axis=-1)[:, None] * [1.0, 0.3]
    cov = np.zeros((count, 2, 5, 5))
    cov[..., range(5), range(5)] = [0.0, 0.0, 25.0, 25.0, 0.5]
    cov[..., range(2), range(2)] = stds**2
    prior = GaussianState(mean, cov, np.ones((count, 2), dtype=bool))
    off = np.array([0.01, -0.01, 1e-9, 0.0])
    value = setting.model.expected(mean, setting.uav) + off
    beams = rng.standard_normal((count, 64)) + 1j * rng.standard_normal((count, 64))

    def law_of(beams):
        def law(trials):
            return lambda state: setting.variance(
                beams[trials], state.reshape(len(state), -1, 5)
            ).reshape(*state.shape[:-1], 4)

        return law

    seen = setting.model, setting.uav, np.pi * 7
    together = update(prior, value, law_of(beams), *seen)
    for trial in range(count):
        one = slice(trial, trial + 1)
        single = GaussianState(mean[one], cov[one], prior.known[one])
        alone = update(single, value[one], law_of(beams[one]), *seen)
        np.testing.assert_allclose(alone.mean[0], together.mean[trial], rtol=1e-9)
        np.testing.assert_allclose(alone.cov[0], together.cov[trial], rtol=1e-6, atol=1e-12)


def divergence(mean, cov, other_mean, other_cov):
    """Kullback-Leibler divergence of Gaussians ``(n, S)`` from others, nat."""
    inverse, off = np.linalg.inv(other_cov), other_mean - mean
    volumes = np.linalg.slogdet(other_cov)[1] - np.linalg.slogdet(cov)[1]
    shape = np.trace(inverse @ cov, axis1=-2, axis2=-1) - mean.shape[-1]
    return 0.5 * (shape + volumes + np.einsum("ni,nij,nj->n", off, inverse, off))


@pytest.mark.slow
def test_beliefs_much_wider_than_a_beam_have_the_moments_of_importance_sampling():
    """20 m either way, 110 m off, at low power: echoes of 40 objects drawn from the belief.

    A second linearisation is not the last where the law of the variance changes by orders of
    magnitude beside the beam: with two the divergence is 0.13 nat in the mean, 1.3 at most.
    """
    setting, count = Hovering(power=0.1), 40
    model, uav = setting.model, setting.uav
    mean, std = np.array([40.0, 30.0, 0.0, 0.0, 0.0]), np.array([20.0, 20.0, 30.0, 30.0, 0.7])
    rng = np.random.default_rng(0)
    beams = setting.array.steering(model.expected(mean[None], uav)[:, :2]) / setting.n
    truth = mean + std * rng.standard_normal((count, 5))
    noise = np.sqrt(setting.variance(beams, truth[None])[0])
    value = model.expected(truth, uav) + noise * rng.standard_normal((count, 4))

    def law(some):
        return lambda state: setting.variance(beams, state.reshape(1, -1, 5)).reshape(
            *state.shape[:-1], 4
        )

    prior = GaussianState(
        np.tile(mean, (count, 1, 1)),
        np.tile(np.diag(std**2), (count, 1, 1, 1)),
        np.ones((count, 1), dtype=bool),
    )
    made = update(prior, value[:, None], law, model, uav, np.pi * (setting.n - 1))
    draws = mean + std * rng.standard_normal((300_000, 5))
    variance, seen = setting.variance(beams, draws[None])[0], model.expected(draws, uav)
    log = np.stack([-0.5 * ((one - seen) ** 2 / variance).sum(axis=-1) for one in value])
    log -= 0.5 * np.log(variance).sum(axis=-1)
    weight = np.exp(log - log.max(axis=-1, keepdims=True))
    weight /= weight.sum(axis=-1, keepdims=True)
    place = draws[:, :2]
    centre = weight @ place
    square = np.stack([(w[:, None] * place).T @ place for w in weight])
    spread = square - centre[:, :, None] * centre[:, None, :]
    found = divergence(centre, spread, made.mean[:, 0, :2], made.cov[:, 0, :2, :2])
    assert found.mean() < 0.05
    assert found.max() < 0.3


def test_echoes_of_two_hundred_decibels_are_no_trouble():
    scenario = eb.load_scenario("ground", {"radar.noise": 1e-20})
    result = eb.simulate(scenario, ["temporal", "water-filling:tracker=ground"], trials=2)
    best = eb.simulate(scenario, ["genie"], trials=2)["rate"].sum("object").mean()
    assert (result["rate"].sum("object").mean(["trial", "slot"]) > 0.85 * best).all()
