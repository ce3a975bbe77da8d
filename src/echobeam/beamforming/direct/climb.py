"""Local search of one trial: shapes and powers in turn, round by round of coverage points."""

from __future__ import annotations

import numpy as np

from echobeam.beamforming.direct import powers as uplink
from echobeam.beamforming.direct.arrays import fill_block, scaled_identity, turned
from echobeam.beamforming.direct.compiling import compiled, inlined
from echobeam.beamforming.direct.grid import MISSED, exchange_points, repair_coverage
from echobeam.beamforming.direct.linear import factor
from echobeam.beamforming.direct.powers import Powers, downlink, improve
from echobeam.beamforming.direct.shape import (
    BARRIER,
    RESIDUAL,
    RIPPLE,
    SHIFT,
    TARGET,
    Shape,
    power_of,
)
from echobeam.beamforming.direct.shapes import (
    Covers,
    Shapes,
    excess_of,
    measure_leaks,
    shape_of,
)
from echobeam.beamforming.direct.start import FIRST_BARRIER, make_feasible
from echobeam.beamforming.direct.steering import lift
from echobeam.beamforming.direct.step import LAST_BARRIER, bends, step
from echobeam.values import Array, ComplexArray

WIDE_NODES = 7
"""Nodes from which on a cover is wide, and compared with the full grid on the way."""

QUIET_STEPS = 8

DONE = 1e-7
"""KKT residual of shapes, relative to the power of a matched beam, at which they are done."""

DONE_POWERS = 1e-9
"""The same for the powers, relative to the sum rate."""

EVERY = 20
"""Every so many steps it is asked whether a trial still gains anything."""

STALLED, STALLED_POWERS = 1e-6, 1e-7
"""Relative gain of the sum rate in that time, and residual of the powers, at which it does not:
where the optimum is flat, steps along a curved boundary are short and residuals fall slowly."""

CAUGHT = 1e6
"""Shift of a shape's matrix at which its steps have become too short to lead anywhere."""

CURVED = 3e-5
"""How far from positive semidefinite a shape's dual matrix may be, relative to its diagonal."""

UNFINISHED, UNPROVED = 0.1, 0.5
"""Parts of `Powers.reduced_cost` to which the beam of an object that is not served may miss the
best one, and the proof that there is no better one: the object could not become worth serving by
that."""

UNKEPT = 5e-7
"""Excess of ripple, relative to what is allowed, up to which such a beam may stay: more cannot be
bought off where a cover leaves no direction to spare."""


@compiled
def _prices(level: Array, beam: int, weight: Array) -> None:
    """Fill ``(K - 1,)`` with the lambda of the other objects."""
    place = 0
    for other in range(level.size):
        if other != beam:
            weight[place] = level[other]
            place += 1


@inlined
def descend(covers: Covers, shapes: Shapes, powers: Powers, most: int, held: int) -> int:
    """Step until the trial is settled; return the steps taken, beyond ``most`` if it is not."""
    n_objects, size = covers.grid.shape[0], covers.grid.shape[2]
    wide = covers.spare > WIDE_NODES
    power, leak = np.empty(n_objects), scaled_identity(n_objects, 0.0)
    weight, excess = np.empty(n_objects - 1), np.empty((n_objects, size))
    weights = np.empty(shapes.response.shape[1] // 2 * covers.n_tx, dtype=np.complex128)
    looked = np.empty(n_objects, dtype=np.bool_)
    value = 0.0
    for count in range(1, most + 1):
        for beam in range(n_objects):
            before = shapes.scalars[beam, BARRIER]
            _prices(powers.level, beam, weight)
            shape = shape_of(shapes, beam)
            step(shape, weight)
            _free(shape)
            looked[beam] = wide and shapes.scalars[beam, BARRIER] < before
        measure_leaks(shapes, power, leak)
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
                settled &= worst < max(MISSED, min(UNFINISHED * powers.reduced_cost[beam], UNKEPT))
        if settled:
            return count
        for beam in range(n_objects):
            if looked[beam]:
                missed = excess[beam, : covers.points[beam]]
                near = covers.near[min(beam, covers.near.shape[0] - 1)]
                shape = shape_of(shapes, beam)
                exchange_points(
                    shape, missed, covers.spare, covers.grid[beam], near, covers.columns
                )
    return most + 1


@compiled
def _free(shape: Shape) -> None:
    """Let a shape that is caught in a corner, where no step is short enough, start from there."""
    if shape.scalars[SHIFT] > CAUGHT:
        shape.scalars[BARRIER], shape.scalars[SHIFT] = FIRST_BARRIER, 0.0
        make_feasible(shape)


@compiled
def sum_of_rates(powers: Powers, power: Array, leak: Array) -> float:
    """Return the sum rate, nats, of the uplink."""
    total = 0.0
    for beam in range(power.size):
        interference = power[beam]
        for other in range(power.size):
            interference += leak[beam, other] * powers.level[other]
        total += np.log1p(powers.level[beam] / interference)
    return total


@compiled
def _has_stalled(shapes: Shapes, powers: Powers, value: float, before: float) -> bool:
    """Return whether next to nothing was gained since the sum rate was last looked at."""
    stalled: bool = abs(value - before) < STALLED * value
    stalled &= powers.scalars[uplink.RESIDUAL] < STALLED_POWERS
    for beam in range(shapes.scalars.shape[0]):
        stalled &= shapes.scalars[beam, RIPPLE] <= shapes.scalars[beam, TARGET]
    return stalled


@compiled
def _is_ready(shapes: Shapes, powers: Powers, power: Array) -> bool:
    """Return whether shapes and powers are optimal for the points imposed."""
    ready: bool = powers.scalars[uplink.RESIDUAL] < DONE_POWERS
    for beam in range(power.size):
        scalars = shapes.scalars[beam]
        unfinished = UNFINISHED * powers.reduced_cost[beam]
        last = unfinished * power[beam] / (2.0 * shapes.low.shape[1])
        ready &= scalars[BARRIER] <= max(LAST_BARRIER, last)
        ready &= scalars[RIPPLE] <= scalars[TARGET]
        ready &= scalars[RESIDUAL] < max(DONE, unfinished)
    return ready


@inlined
def finish_beams(
    covers: Covers, shapes: Shapes, powers: Powers, beams: ComplexArray
) -> tuple[float, bool, bool]:
    """Fill beams ``(K, r N)`` that keep the grid and the power; return their rate, if they are any.

    Returns
    -------
    objective, good, kept
        bit/s/Hz; whether powers exist that reach the SINRs; whether the beams keep their covers.
    """
    n_objects, size, n_tx = covers.grid.shape[0], covers.grid.shape[2], covers.n_tx
    power, leak = np.empty(n_objects), scaled_identity(n_objects, 0.0)
    excess = np.empty(size)
    measure_leaks(shapes, power, leak)
    kept = True
    for beam in range(n_objects):
        worst = excess_of(covers, shapes, beam, beams[beam], excess)
        # A cover that takes all directions leaves none to spare; over a wide one the spare one
        # reaches the grid a little.
        if shapes.basis.shape[1] < n_tx:
            repair_coverage(shapes.z[beam], worst)
            if worst > MISSED:
                repair_coverage(
                    shapes.z[beam], excess_of(covers, shapes, beam, beams[beam], excess)
                )
                kept &= excess_of(covers, shapes, beam, beams[beam], excess) < UNKEPT
        else:
            kept &= worst < UNKEPT
        lift(shapes.basis[beam], shapes.z[beam], beams[beam])
        power[beam] = power_of(shapes.z[beam])
    for _ in range(3):
        improve(powers, power, leak, False)
    ratio, received = np.empty(n_objects), np.empty(n_objects)
    good = downlink(powers, power, leak, ratio, received)
    if not good:
        for beam in range(n_objects):
            for antenna in range(beams.shape[1]):
                beams[beam, antenna] = 0.0
        return 0.0, False, False
    objective = 0.0
    for beam in range(n_objects):
        objective += np.log1p(ratio[beam]) / np.log(2.0)
        amplitude = np.sqrt(received[beam])
        for antenna in range(beams.shape[1]):
            beams[beam, antenna] *= amplitude
    return objective, True, kept


@inlined
def globally_best(shapes: Shapes, powers: Powers) -> bool:
    """Return whether the multipliers prove every shape optimal for its prices."""
    n_objects, n = shapes.low.shape[0], shapes.rows.shape[1]
    weight, inverse = np.empty(n_objects - 1), np.empty(n)
    for beam in range(n_objects):
        _prices(powers.level, beam, weight)
        ripple = shapes.scalars[beam, RIPPLE]
        bend, spread = bends(shapes.low[beam], shapes.high[beam], weight, ripple)
        form = np.empty((n, n))
        fill_block(turned(shapes.rows[beam]), bend, form, 0, 0)
        largest = 0.0
        for place in range(n):
            form[place, place] += spread
            largest = max(largest, abs(form[place, place]))
        for place in range(n):
            form[place, place] += max(
                CURVED * (1.0 + largest), UNPROVED * powers.reduced_cost[beam]
            )
        if not factor(form, inverse):
            return False
    return True


@inlined
def largest_interference(powers: Powers, power: Array, leak: Array) -> float:
    """Return the largest interference over noise, at the start and with all the power."""
    interference = 0.0
    for beam in range(power.size):
        for other in range(power.size):
            interference = max(interference, leak[beam, other] / (power[beam] * powers.loss[other]))
    return interference


@inlined
def interference_loss(powers: Powers, power: Array, objective: float) -> float:
    """Return what the beams' consideration for each other costs of the sum rate, relative.

    Compares with the sum rate of beams without interference; the powers are used up.
    """
    silence = scaled_identity(power.size, 0.0)
    for _ in range(QUIET_STEPS):
        improve(powers, power, silence, False)
    rate = 0.0
    for beam in range(power.size):
        rate += np.log1p(powers.level[beam] / power[beam]) / np.log(2.0)
    return rate / max(objective, 1e-300) - 1.0


@inlined
def sum_rate(shapes: Shapes, powers: Powers) -> float:
    """Return the sum rate, nats, of shapes as they are; -inf where floors are not met."""
    n_objects = powers.loss.size
    power, leak = np.empty(n_objects), scaled_identity(n_objects, 0.0)
    measure_leaks(shapes, power, leak)
    if powers.scalars[uplink.FACTOR] < 1.0:
        return -np.inf
    return sum_of_rates(powers, power, leak)
