"""From a start to the optimum of one trial: shapes and powers in turn; see `direct.climb`."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from echobeam.beamforming.direct.barrier import LAST_BARRIER
from echobeam.beamforming.direct.chirp import FIRST_BARRIER
from echobeam.beamforming.direct.climb import (
    CAUGHT,
    CURVED,
    DONE,
    DONE_POWERS,
    EVERY,
    QUIET_STEPS,
    STALLED,
    STALLED_POWERS,
    UNFINISHED,
    UNKEPT,
    UNPROVED,
    WIDE_NODES,
)
from echobeam.beamforming.direct.compiled import powers as uplink
from echobeam.beamforming.direct.compiled.arrays import copy_into, scaled_identity
from echobeam.beamforming.direct.compiled.beams import (
    beam_basis,
    first_points,
    node_count,
    point_counts,
    reduce,
)
from echobeam.beamforming.direct.compiled.decorate import compiled
from echobeam.beamforming.direct.compiled.grid import impose, patch, relative_excess
from echobeam.beamforming.direct.compiled.linear import factor
from echobeam.beamforming.direct.compiled.powers import downlink, start_powers, step_powers
from echobeam.beamforming.direct.compiled.start import keep_warm, make_feasible, start_shape
from echobeam.beamforming.direct.compiled.steering import lift
from echobeam.beamforming.direct.compiled.step import (
    BARRIER,
    RESIDUAL,
    RIPPLE,
    SCALARS,
    SHIFT,
    TARGET,
    bends,
    power_of,
    step,
)
from echobeam.beamforming.direct.cuts import MISSED
from echobeam.values import Array, ComplexArray, IntArray


class Covers(NamedTuple):
    """What a trial's K beams have to cover.

    Attributes
    ----------
    phases
        ``(K, G)`` rad: the full grid of (38f), centred; what is beyond ``reach`` is not looked at.
    reach
        ``(K,)``: grid steps of each beam's own cover on either side.
    ripple
        ``(K,)``: B_k / N.
    """

    phases: Array
    reach: IntArray
    ripple: Array


class Shapes(NamedTuple):
    """The shapes of a trial's K beams on their way; see `barrier.Shapes`, here beam by beam.

    Attributes
    ----------
    basis
        ``(K, r, N)``.
    turns
        ``(K, 2, G)``: cosines and sines of the phases.
    points
        ``(K, m)``: grid points imposed.
    rows, offset, response
        ``(K, n, R)``, ``(K, R)``, ``(K, 2, R)``.
    z
        ``(K, 2 n)``: real parts, then imaginary ones.
    low, high
        ``(K, m)``: multipliers.
    scalars
        ``(K, SCALARS)``, see `compiled.step`.
    spare
        Number of points that may be replaced.
    """

    basis: Array
    turns: Array
    points: IntArray
    rows: Array
    offset: Array
    response: Array
    z: Array
    low: Array
    high: Array
    scalars: Array
    spare: int


class Powers(NamedTuple):
    """The uplink of one trial: ``(K,)`` each, and its scalars, see `compiled.powers`."""

    loss: Array
    threshold: Array
    share: Array
    price: Array
    level: Array
    leeway: Array
    scalars: Array


@compiled
def set_out(covers: Covers, n_tx: int, chirp: float, warm: ComplexArray) -> Shapes:
    """Return where a trial's shapes start.

    Parameters
    ----------
    covers
        Of the trial.
    n_tx, chirp
        As in `chirp.start_shapes`.
    warm
        ``(K, N)`` beams to start from, NaN where there are none, or ``(0, 0)``.
    """
    n_objects, size = covers.phases.shape
    centre = size // 2
    low_phase, high_phase = np.empty(n_objects), np.empty(n_objects)
    for beam in range(n_objects):
        least, most = covers.phases[beam, centre], covers.phases[beam, centre]
        for point in range(centre - covers.reach[beam], centre + covers.reach[beam] + 1):
            least = min(least, covers.phases[beam, point])
            most = max(most, covers.phases[beam, point])
        low_phase[beam], high_phase[beam] = least, most
    nodes = node_count(low_phase, high_phase, n_tx)
    count, spare = point_counts(nodes)
    m, n = count + spare, min(n_tx, n_objects + nodes + 1) - 1
    heard = n_objects - 1
    shapes = Shapes(
        basis=np.empty((n_objects, n + 1, n_tx)),
        turns=np.empty((n_objects, 2, size)),
        points=np.empty((n_objects, m), dtype=np.int64),
        rows=np.empty((n_objects, n, m + heard)),
        offset=np.empty((n_objects, m + heard)),
        response=np.empty((n_objects, 2, m + heard)),
        z=np.empty((n_objects, 2 * n)),
        low=np.empty((n_objects, m)),
        high=np.empty((n_objects, m)),
        scalars=np.empty((n_objects, SCALARS)),
        spare=spare,
    )
    own = np.empty(n_objects)
    for beam in range(n_objects):
        own[beam] = covers.phases[beam, centre]
    imposed = np.empty(m)
    for beam in range(n_objects):
        low, high = low_phase[beam], high_phase[beam]
        basis = beam_basis(beam, own, low, high, nodes, n_tx)
        for direction in range(n + 1):
            copy_into(shapes.basis[beam, direction], basis[direction])
        for point in range(size):
            shapes.turns[beam, 0, point] = np.cos(covers.phases[beam, point])
            shapes.turns[beam, 1, point] = np.sin(covers.phases[beam, point])
        first_points(covers.reach[beam], centre, count, shapes.points[beam])
        rows, offset = shapes.rows[beam], shapes.offset[beam]
        for place in range(m):
            imposed[place] = covers.phases[beam, shapes.points[beam, place]]
            offset[place] = reduce(basis, imposed[place], rows, place)
        place = m
        for other in range(n_objects):
            if other != beam:
                offset[place] = reduce(basis, own[other], rows, place)
                place += 1
        scalars, z = shapes.scalars[beam], shapes.z[beam]
        scalars[TARGET] = max(covers.ripple[beam], 1e-12)
        start_shape(rows, offset, imposed, (own[beam], low, high), chirp, n_tx, scalars, z)
        if warm.size:
            keep_warm(rows, offset, m, basis, warm[beam], scalars, z)
        make_feasible(
            rows, offset, z, shapes.response[beam], shapes.low[beam], shapes.high[beam], scalars
        )
    return shapes


@compiled
def listen(shapes: Shapes, power: Array, leak: Array) -> None:
    """Fill ``(K,)`` powers and ``(K, K)`` leaks of shapes."""
    n_objects, m = shapes.low.shape
    for beam in range(n_objects):
        power[beam] = power_of(shapes.z[beam])
        leak[beam, beam] = 0.0
        row = m
        for other in range(n_objects):
            if other != beam:
                response = shapes.response[beam]
                leak[beam, other] = response[0, row] ** 2 + response[1, row] ** 2
                row += 1


@compiled
def improve(powers: Powers, power: Array, leak: Array, hold: bool) -> None:
    """Improve lambda for shapes as they are, in place; see `step_powers`."""
    step_powers(
        powers.loss,
        powers.threshold,
        power,
        leak,
        powers.share,
        powers.price,
        powers.level,
        powers.leeway,
        powers.scalars,
        hold,
    )


@compiled
def _prices(level: Array, beam: int, weight: Array) -> None:
    """Fill ``(K - 1,)`` with the lambda of the other objects."""
    place = 0
    for other in range(level.size):
        if other != beam:
            weight[place] = level[other]
            place += 1


@compiled
def excess_of(
    covers: Covers, shapes: Shapes, beam: int, weights: ComplexArray, excess: Array
) -> float:
    """Fill what a beam misses of its own grid, relative; return the largest."""
    centre, reach = covers.phases.shape[1] // 2, covers.reach[beam]
    turns = shapes.turns[beam, :, centre - reach : centre + reach + 1]
    lift(shapes.basis[beam], shapes.z[beam], weights)
    allowed = shapes.scalars[beam, TARGET] * power_of(shapes.z[beam])
    return relative_excess(turns, weights, allowed, excess[: 2 * reach + 1])


@compiled
def descend(covers: Covers, shapes: Shapes, powers: Powers, n_tx: int, most: int, held: int) -> int:
    """Step until the trial is settled; return the steps taken, beyond ``most`` if it is not."""
    n_objects, size = covers.phases.shape
    wide = shapes.spare > WIDE_NODES
    power, leak = np.empty(n_objects), scaled_identity(n_objects, 0.0)
    weight, excess = np.empty(n_objects - 1), np.empty((n_objects, size))
    weights = np.empty(n_tx, dtype=np.complex128)
    looked = np.empty(n_objects, dtype=np.bool_)
    value = 0.0
    for count in range(1, most + 1):
        for beam in range(n_objects):
            before = shapes.scalars[beam, BARRIER]
            _prices(powers.level, beam, weight)
            step(
                shapes.rows[beam],
                shapes.z[beam],
                shapes.response[beam],
                shapes.low[beam],
                shapes.high[beam],
                weight,
                shapes.scalars[beam],
            )
            _free(shapes, beam)
            looked[beam] = wide and shapes.scalars[beam, BARRIER] < before
        listen(shapes, power, leak)
        improve(powers, power, leak, count <= held)
        ready = _is_ready(shapes, powers, power)
        if count % EVERY == 0:
            value, before_that = sum_of_rates(powers, power, leak), value
            ready |= _has_stalled(shapes, powers, value, before_that)
        settled = ready
        for beam in range(n_objects):
            looked[beam] |= ready
            if looked[beam]:
                worst = excess_of(covers, shapes, beam, weights, excess[beam])
                settled &= worst < max(MISSED, min(UNFINISHED * powers.leeway[beam], UNKEPT))
        if settled:
            return count
        for beam in range(n_objects):
            if looked[beam]:
                _impose(covers, shapes, beam, excess[beam])
    return most + 1


@compiled
def _free(shapes: Shapes, beam: int) -> None:
    """Let a shape that is caught in a corner, where no step is short enough, start from there."""
    if shapes.scalars[beam, SHIFT] > CAUGHT:
        shapes.scalars[beam, BARRIER], shapes.scalars[beam, SHIFT] = FIRST_BARRIER, 0.0
        make_feasible(
            shapes.rows[beam],
            shapes.offset[beam],
            shapes.z[beam],
            shapes.response[beam],
            shapes.low[beam],
            shapes.high[beam],
            shapes.scalars[beam],
        )


@compiled
def sum_of_rates(powers: Powers, power: Array, leak: Array) -> float:
    """Return the sum rate, nats, of the uplink."""
    total = 0.0
    for beam in range(power.size):
        heard = power[beam]
        for other in range(power.size):
            heard += leak[beam, other] * powers.level[other]
        total += np.log1p(powers.level[beam] / heard)
    return total


@compiled
def _has_stalled(shapes: Shapes, powers: Powers, value: float, before: float) -> bool:
    """Tell whether next to nothing was gained since the sum rate was last looked at."""
    stalled: bool = abs(value - before) < STALLED * value
    stalled &= powers.scalars[uplink.RESIDUAL] < STALLED_POWERS
    for beam in range(shapes.scalars.shape[0]):
        stalled &= shapes.scalars[beam, RIPPLE] <= shapes.scalars[beam, TARGET]
    return stalled


@compiled
def _is_ready(shapes: Shapes, powers: Powers, power: Array) -> bool:
    """Tell whether shapes and powers are optimal for the points imposed."""
    ready: bool = powers.scalars[uplink.RESIDUAL] < DONE_POWERS
    for beam in range(power.size):
        scalars = shapes.scalars[beam]
        unfinished = UNFINISHED * powers.leeway[beam]
        last = unfinished * power[beam] / (2.0 * shapes.low.shape[1])
        ready &= scalars[BARRIER] <= max(LAST_BARRIER, last)
        ready &= scalars[RIPPLE] <= scalars[TARGET]
        ready &= scalars[RESIDUAL] < max(DONE, unfinished)
    return ready


@compiled
def _impose(covers: Covers, shapes: Shapes, beam: int, excess: Array) -> None:
    """Impose on a beam what it misses of its full grid."""
    centre, reach = covers.phases.shape[1] // 2, covers.reach[beam]
    impose(
        excess[: 2 * reach + 1],
        centre - reach,
        shapes.spare,
        covers.phases[beam],
        shapes.basis[beam],
        shapes.points[beam],
        shapes.rows[beam],
        shapes.offset[beam],
        shapes.z[beam],
        shapes.response[beam],
        shapes.low[beam],
        shapes.high[beam],
        shapes.scalars[beam],
    )


@compiled
def harvest(
    covers: Covers, shapes: Shapes, powers: Powers, beams: ComplexArray
) -> tuple[float, bool]:
    """Fill beams ``(K, N)`` that keep the grid and the power; return their rate, if they are any.

    Returns
    -------
    objective, good
        bit/s/Hz, and whether powers exist that reach the SINRs.
    """
    n_objects, size = covers.phases.shape
    n_tx = beams.shape[1]
    power, leak = np.empty(n_objects), scaled_identity(n_objects, 0.0)
    excess = np.empty(size)
    listen(shapes, power, leak)
    for beam in range(n_objects):
        worst = excess_of(covers, shapes, beam, beams[beam], excess)
        # A cover that takes all directions leaves none to spare; over a wide one the spare one
        # reaches the grid a little.
        if shapes.basis.shape[1] < n_tx:
            patch(shapes.z[beam], worst)
            if worst > MISSED:
                patch(shapes.z[beam], excess_of(covers, shapes, beam, beams[beam], excess))
        lift(shapes.basis[beam], shapes.z[beam], beams[beam])
        power[beam] = power_of(shapes.z[beam])
    for _ in range(3):
        improve(powers, power, leak, False)
    ratio, received = np.empty(n_objects), np.empty(n_objects)
    good = downlink(powers.loss, power, leak, powers.level, ratio, received)
    if not good:
        for beam in range(n_objects):
            for antenna in range(beams.shape[1]):
                beams[beam, antenna] = 0.0
        return 0.0, False
    objective = 0.0
    for beam in range(n_objects):
        objective += np.log1p(ratio[beam]) / np.log(2.0)
        amplitude = np.sqrt(received[beam])
        for antenna in range(beams.shape[1]):
            beams[beam, antenna] *= amplitude
    return objective, True


@compiled
def globally_best(shapes: Shapes, powers: Powers) -> bool:
    """Tell whether the multipliers prove every shape optimal for its prices."""
    n_objects, n = shapes.low.shape[0], shapes.rows.shape[1]
    weight, inverse = np.empty(n_objects - 1), np.empty(n)
    for beam in range(n_objects):
        _prices(powers.level, beam, weight)
        ripple = shapes.scalars[beam, RIPPLE]
        bend, spread = bends(shapes.low[beam], shapes.high[beam], weight, ripple)
        form = np.empty((n, n))
        rows = shapes.rows[beam]
        for first in range(n):
            for second in range(first + 1):
                total = 0.0
                for row in range(bend.size):
                    total += bend[row] * rows[first, row] * rows[second, row]
                form[first, second] = total
        largest = 0.0
        for place in range(n):
            form[place, place] += spread
            largest = max(largest, abs(form[place, place]))
        for place in range(n):
            form[place, place] += max(CURVED * (1.0 + largest), UNPROVED * powers.leeway[beam])
        if not factor(form, inverse):
            return False
    return True


@compiled
def loudest(powers: Powers, power: Array, leak: Array) -> float:
    """Return the largest interference over noise, at the start and with all the power."""
    heard = 0.0
    for beam in range(power.size):
        for other in range(power.size):
            heard = max(heard, leak[beam, other] / (power[beam] * powers.loss[other]))
    return heard


@compiled
def disturbance(powers: Powers, power: Array, objective: float) -> float:
    """Return what the beams' consideration for each other costs of the sum rate, relative.

    Compares with the sum rate of beams that hear nothing of each other; the powers are used up.
    """
    silence = scaled_identity(power.size, 0.0)
    for _ in range(QUIET_STEPS):
        improve(powers, power, silence, False)
    rate = 0.0
    for beam in range(power.size):
        rate += np.log1p(powers.level[beam] / power[beam]) / np.log(2.0)
    return rate / max(objective, 1e-300) - 1.0


@compiled
def sum_rate(shapes: Shapes, powers: Powers) -> float:
    """Return the sum rate, nats, of shapes as they are; -inf where floors are not met."""
    n_objects = powers.loss.size
    power, leak = np.empty(n_objects), scaled_identity(n_objects, 0.0)
    listen(shapes, power, leak)
    if powers.scalars[uplink.FACTOR] < 1.0:
        return -np.inf
    return sum_of_rates(powers, power, leak)


@compiled
def start_uplink(loss: Array, threshold: Array, share: Array) -> Powers:
    """Return where a trial's powers start; the share is changed later on."""
    users = loss.size
    powers = Powers(
        loss=loss,
        threshold=threshold,
        share=share,
        price=np.empty(users),
        level=np.empty(users),
        leeway=np.empty(users),
        scalars=np.empty(uplink.SCALARS),
    )
    start_powers(loss, powers.share, powers.price, powers.level, powers.leeway, powers.scalars)
    return powers
