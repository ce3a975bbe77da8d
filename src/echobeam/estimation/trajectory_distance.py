"""Distance between the trajectories of tracks and of objects over a whole run: trajectory GOSPA.

The set distance of each slot does not see which track it is: two tracks that swap their objects
cost nothing. Here a matching is a path over the slots, and its changes cost a penalty.

Garcia-Fernandez, Rahmathullah and Svensson, "A metric on the space of finite sets of trajectories
for evaluation of multi-target tracking algorithms", IEEE Trans. Signal Process. 68 (2020). This is
its linear programming relaxation, with matchings by shares in [0, 1]: it is a metric too, and
never larger than the one over whole matchings.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from echobeam.estimation.matching import capped_costs
from echobeam.faults import InputError, RunError
from echobeam.values import NOBODY, Array, BoolArray, IntArray


class TrajectoryDistance(NamedTuple):
    """Trajectory GOSPA and its parts: ``total**order`` is the sum of the other four.

    Where several matchings cost the same, the parts are those of one of them.

    Attributes
    ----------
    total
        Distance, in the unit of the distances. It is a sum over the slots; the authors' mean over
        N slots is ``total / N ** (1 / order)``.
    localisation
        Sum over slots and pairs of the distance to the power of the order.
    missed, false
        Half the cutoff to the power of the order, for each slot of an unmatched object and of an
        unmatched track.
    switches
        Penalty to the power of the order for each change of a track from one object to another,
        or of an object from one track to another; half of it for a change from or to nobody.
    """

    total: float
    localisation: float
    missed: float
    false: float
    switches: float


def trajectory_gospa(
    distance: Array,
    tracks: BoolArray,
    objects: BoolArray,
    cutoff: float,
    switch_penalty: float,
    order: float = 2.0,
) -> TrajectoryDistance:
    """Return the distance of the tracks' trajectories to the objects', for one trial.

    A trajectory is a column; a column whose owner changes becomes several by
    `columns_by_identity`. To match a track and an object of which at most one exists in a slot
    costs as much as to leave both unmatched in it, so that a matching may begin before they do.

    Parameters
    ----------
    distance
        ``(N, T, O)``: distance, from a metric, of each track to each object in each slot. It may
        be anything, NaN too, where the track or the object does not exist.
    tracks, objects
        ``(N, T)`` and ``(N, O)``: which tracks and which objects exist.
    cutoff
        c, positive and finite, in the unit of the distances.
    switch_penalty
        gamma, in the unit of the distances: 0 leaves the sum of GOSPA^p over the slots, infinity
        allows no change at all.
    order
        p, at least 1 and finite.

    Raises
    ------
    InputError
        An order below 1, a cutoff that is not positive, a negative penalty, shapes that do not
        fit, or a negative or undefined distance between an existing track and an existing object.
    RunError
        The linear programme was not solved.
    """
    if not 1.0 <= order < np.inf:
        raise InputError(f"the order must be at least 1 and finite, not {order}")
    if not 0.0 < cutoff < np.inf:
        raise InputError(f"the cutoff must be positive and finite, not {cutoff}")
    if not switch_penalty >= 0.0:
        raise InputError(f"the penalty of a switch must not be negative, but is {switch_penalty}")
    if np.ndim(distance) != 3:
        raise InputError(f"the distances need the axes (N, T, O), not {np.shape(distance)}")
    if np.shape(tracks) != np.shape(distance)[:2] or np.shape(objects) != np.shape(distance)[::2]:
        shapes = f"not {np.shape(tracks)} and {np.shape(objects)}"
        raise InputError(f"distances {np.shape(distance)} need (N, T) and (N, O), {shapes}")
    capped = capped_costs(distance, tracks, objects, cutoff)
    cost = (capped / cutoff) ** order
    change = _change_cost(switch_penalty / cutoff, order, len(cost))
    share = _least_shares(cost, change)
    unit = cutoff**order
    paired = np.where(cost < 1.0, share, 0.0)
    found = float(paired.sum())
    localisation = float(np.sum(paired * capped**order))
    missed = 0.5 * unit * max(np.count_nonzero(objects) - found, 0.0)
    false = 0.5 * unit * max(np.count_nonzero(tracks) - found, 0.0)
    switches = unit * change * float(np.sum(np.abs(np.diff(share, axis=0))))
    total = float((localisation + missed + false + switches) ** (1.0 / order))
    return TrajectoryDistance(total, localisation, missed, false, switches)


def columns_by_identity(
    distance: Array, tracks: BoolArray, identity: IntArray
) -> tuple[Array, BoolArray]:
    """Return distances and existence with a column of its own for each identity, for one trial.

    Parameters
    ----------
    distance
        ``(N, T, O)``.
    tracks
        ``(N, T)``: which tracks count.
    identity
        ``(N, T)``: identity of the track in each column.

    Returns
    -------
    distance, tracks
        ``(N, I, O)``, NaN where the track does not exist, and ``(N, I)``; identities ascend.

    Raises
    ------
    InputError
        Shapes that do not fit, a track that counts and has no identity, or one that is in two
        columns of one slot.
    """
    if not np.shape(distance)[:-1] == np.shape(tracks) == np.shape(identity):
        shapes = f"{np.shape(distance)}, {np.shape(tracks)} and {np.shape(identity)}"
        raise InputError(f"distance, tracks and identity of shapes {shapes} do not fit")
    slot, column = np.nonzero(tracks)
    if np.any(identity[slot, column] <= NOBODY):
        raise InputError("a track that exists has no identity")
    names, place = np.unique(identity[slot, column], return_inverse=True)
    slots, _, objects = distance.shape
    exists = np.zeros((slots, len(names)), dtype=bool)
    exists[slot, place] = True
    if np.count_nonzero(exists) < len(slot):
        raise InputError("a track is in two columns of one slot")
    apart = np.full((slots, len(names), objects), np.nan)
    apart[slot, place] = distance[slot, column]
    return apart, exists


def _change_cost(ratio: float, order: float, slots: int) -> float:
    """Return the cost of a change by a whole share, (gamma / c)^p / 2, up to that of never.

    A pair saves at most 1 a slot. If its share never exceeded its least one over the run, the pair
    would lose at most N times the sum of its changes: from N on no optimum has any. The limit
    spares the solver numbers of very different sizes.
    """
    never = float(slots + 1)
    return float(0.5 * min(ratio, (2.0 * never) ** (1.0 / order)) ** order)


def _least_shares(cost: Array, change: float) -> Array:
    """Return by how much each pair is matched, ``(N, T, O)``, at least cost over the run.

    Costs are in units of c^p: a pair in a slot costs ``cost`` instead of 1 for leaving both
    unmatched, and ``change`` times the difference of its shares in neighbouring slots. Pairs that
    are never closer than the cutoff save nothing and are left out.
    """
    from scipy.optimize import linprog

    slots = len(cost)
    share = np.zeros_like(cost)
    track, other = np.nonzero(np.any(cost < 1.0, axis=0))
    pairs = len(track)
    if pairs == 0:
        return share
    saved = (cost[:, track, other] - 1.0).T.ravel()
    up_and_down = np.full(2 * pairs * (slots - 1), change)
    at_most_one, changes = _constraints(track, other, slots)
    solved = linprog(
        np.concatenate([saved, up_and_down]),
        A_ub=at_most_one,
        b_ub=np.ones(at_most_one.shape[0]),
        A_eq=changes if slots > 1 else None,
        b_eq=np.zeros(changes.shape[0]) if slots > 1 else None,
        method="highs",
    )
    if solved.x is None or not solved.success:
        raise RunError(f"the linear programme of the trajectories was not solved: {solved.message}")
    found = np.clip(solved.x[: pairs * slots], 0.0, 1.0)
    share[:, track, other] = found.reshape(pairs, slots).T
    return share


def _constraints(track: IntArray, other: IntArray, slots: int) -> tuple[Any, Any]:
    """Return the sparse constraints: shares of a track and of an object sum to one at most.

    The variables are the shares, pair by pair and slot by slot, then the rises and the falls of
    the shares from each slot to the next; the second matrix equates them.
    """
    from scipy.sparse import csr_array, diags_array, eye_array, hstack, kron, vstack

    pairs = len(track)
    ones, pair = np.ones(pairs), np.arange(pairs)
    of_tracks = csr_array((ones, (np.unique(track, return_inverse=True)[1], pair)))
    of_objects = csr_array((ones, (np.unique(other, return_inverse=True)[1], pair)))
    sums = kron(vstack([of_tracks, of_objects]), eye_array(slots))
    step = diags_array([-1.0, 1.0], offsets=[0, 1], shape=(slots - 1, slots))
    difference = kron(eye_array(pairs), step)
    rises = eye_array(difference.shape[0])
    nothing = csr_array((sums.shape[0], 2 * difference.shape[0]))
    return (
        hstack([sums, nothing], format="csr"),
        hstack([difference, -rises, rises], format="csr"),
    )
