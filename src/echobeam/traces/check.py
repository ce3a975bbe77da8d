"""Consistency check of a trace: contradictions are refused, or reported and corrected."""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path

from echobeam.traces.breaks import FASTEST, Breaks, Jump
from echobeam.traces.causes import cause_of, could_be_degrees
from echobeam.traces.sample import TraceError, fault
from echobeam.traces.speeds import Verdict
from echobeam.traces.totals import Totals, Vehicle

_LIGHT = 299_792_458.0
_STANDSTILL = 0.1
"""Largest speed of a vehicle at rest, m/s; motion without a higher speed means wrong units."""

_DEGREES = 2e-3
"""Largest speed of a vehicle in longitude, also far in the north, degrees/s."""

_CRAWL, _FAR = 1.0, 10.0
"""Speed, m/s, and path, m: a longer path without a higher speed suggests times in frames."""

_DRIFT, _STEADY = 1e-4, 0.5
"""Smallest net displacement of a moving vehicle, m and as a share of its path, against jitter."""

_TYPICAL = 55.0
"""Speed, m/s (200 km/h), above which the mean traffic suggests positions in feet."""


def check_trace(path: Path, totals: Totals, found: dict[str, Breaks]) -> tuple[str, ...]:
    """Check a trace; return a sentence for each kind of data omitted or reinterpreted.

    Parameters
    ----------
    path
        Name of the file, for messages.
    totals
        Sums over all vehicles.
    found
        Findings on the steps of each vehicle.

    Raises
    ------
    TraceError
        If speeds, times and positions contradict each other; the message names the likely cause,
        the vehicle and the first line that shows it.
    """
    _check_jumps(path, totals, found)
    _check_units(path, totals)
    _check_fastest(path, totals)
    _check_slowest(path, totals)
    return tuple(_notes(totals, found))


def _check_jumps(path: Path, totals: Totals, found: dict[str, Breaks]) -> None:
    """Refuse a trace in which most steps are impossible for a vehicle."""
    steps = sum(each.steps for each in found.values())
    jumps = sum(each.jumps for each in found.values())
    often = 2 * jumps > steps
    for name, each in found.items():
        if each.first_jump and (often or (each.steps > 1 and 2 * each.jumps > each.steps)):
            raise _jump_fault(path, totals, name, each, each.first_jump)


def _jump_fault(path: Path, totals: Totals, name: str, found: Breaks, jump: Jump) -> TraceError:
    speed = jump.speed
    if speed > _LIGHT:
        limit = ", faster than light"
    elif speed > FASTEST:
        limit = f", faster than any road vehicle ({FASTEST:g} m/s)"
    else:
        limit = ", unlike the steps before and after it"
    given = [abs(each.speed) for each in jump if abs(each.speed) > 0]
    cause = None
    if given and speed > 2 * max(given):
        ratio = sum(given) / len(given) / speed
        cause = cause_of(ratio, degrees=False, whole_times=totals.clock.digits == 0)
    said = f"speed says {given[-1]:g} m/s; " if cause else ""
    cause = cause or "are x, y metres and t seconds, and is the id that of one vehicle?"
    return fault(
        path,
        jump.after.line,
        f"vehicle {name!r} moves {jump.distance:.4g} m in "
        f"{jump.after.time - jump.before.time:.4g} s, {speed:.4g} m/s{limit}; so do "
        f"{found.jumps} of its {found.steps} steps; {said}{cause}",
    )


def _check_units(path: Path, totals: Totals) -> None:
    """Refuse speeds that are inconsistent with the positions."""
    verdicts = {name: each.speeds.verdict() for name, each in totals.vehicles.items()}
    tested = sum(each.speeds.counted > 0 for each in totals.vehicles.values())
    wrong = [name for name, verdict in verdicts.items() if verdict is Verdict.WRONG]
    gross = [name for name, verdict in verdicts.items() if verdict is Verdict.GROSS]
    if wrong or 2 * len(gross) > tested:
        chosen = wrong or gross
        raise _unit_fault(path, totals, {name: totals.vehicles[name] for name in chosen}, tested)


def _unit_fault(
    path: Path, totals: Totals, vehicles: dict[str, Vehicle], tested: int
) -> TraceError:
    name, vehicle = min(vehicles.items(), key=lambda each: each[1].first.line)
    speeds = vehicle.speeds
    ratios = sorted(each.speeds.ratio() for each in vehicles.values())
    ratio = ratios[len(ratios) // 2]
    moved = speeds.moved / speeds.time
    stated = speeds.ratio() * moved if speeds.moved > 0 else max(-speeds.low, speeds.high)
    cause = cause_of(ratio, degrees=_degrees(totals), whole_times=totals.clock.digits == 0)
    if cause is None and speeds.constant and not 0 < speeds.high <= FASTEST:
        cause = (
            f"is {speeds.high:g}, which is in every row, a mark for an unknown speed? Then leave "
            "the field empty"
        )
    cause = cause or "speeds, times or positions are in other units than m/s, s and m"
    return fault(
        path,
        vehicle.first.line,
        f"vehicle {name!r} moves {moved:.3g} m/s by its positions, but {stated:.3g} m/s by its "
        f"speed, {ratio:.4g} times as much ({len(vehicles)} of {tested} vehicles with speeds "
        f"are inconsistent like this); {cause}; accepted are metres, seconds and metres per "
        "second, or no speed",
    )


def _check_fastest(path: Path, totals: Totals) -> None:
    """Refuse vehicles that are slightly too fast at all times."""
    for name, vehicle in totals.vehicles.items():
        speeds = vehicle.speeds
        if speeds.net > FASTEST * speeds.time:
            raise fault(
                path,
                vehicle.first.line,
                f"vehicle {name!r} moves {speeds.net:.4g} m in {speeds.time:.4g} s, faster than "
                f"any road vehicle ({FASTEST:g} m/s); accepted are metres and seconds",
            )


def _check_slowest(path: Path, totals: Totals) -> None:
    """Refuse traces without speeds in which nothing moves as fast as a vehicle."""
    if any(
        each.speeds.known and each.speeds.verdict() is not Verdict.MARK and each.speeds.high > 0
        for each in totals.vehicles.values()
    ):
        return
    name, vehicle = max(totals.vehicles.items(), key=lambda each: each[1].speeds.path)
    fastest = max(each.speeds.fastest for each in totals.vehicles.values())
    path_driven, net = vehicle.speeds.path, vehicle.speeds.net
    moves_on = net > max(_DRIFT, _STEADY * path_driven)
    if moves_on and fastest < _DEGREES and _degrees(totals):
        cause = "are x, y degrees instead of metres (SUMO's --fcd-output.geo)?"
    elif moves_on and fastest < _STANDSTILL:
        cause = "are the times in ms, or the positions in km?"
    elif (
        fastest < _CRAWL
        and path_driven > _FAR
        and totals.clock.digits == 0
        and totals.clock.shortest == 1.0
    ):
        cause = "are the times numbers of frames?"
    else:
        return
    raise fault(
        path,
        vehicle.first.line,
        f"vehicle {name!r} moves {path_driven:.3g} m in {vehicle.speeds.time:.4g} s, and no "
        f"vehicle is ever faster than {fastest:.3g} m/s; {cause} accepted are metres and seconds",
    )


def _degrees(totals: Totals) -> bool:
    return could_be_degrees(totals.low, totals.high, totals.position_digits)


def _notes(totals: Totals, found: dict[str, Breaks]) -> Iterable[str]:
    unplaced = {name: each for name, each in found.items() if each.first_unplaced}
    if unplaced:
        name, each = next(iter(unplaced.items()))
        assert each.first_unplaced is not None
        yield (
            f"{_count(sum(each.unplaced for each in unplaced.values()), 'sample')} without a "
            f"position (SUMO's -1073741824) dropped, first of vehicle {name!r} in line "
            f"{each.first_unplaced.line}; the vehicle is absent at that time"
        )
    jumped = {name: each for name, each in found.items() if each.first_jump}
    if jumped:
        name, each = next(iter(jumped.items()))
        jump = each.first_jump
        assert jump is not None
        yield (
            f"{_count(sum(each.jumps for each in jumped.values()), 'jump')} of "
            f"{_count(len(jumped), 'vehicle')} that no vehicle can drive, first of {name!r} in "
            f"line {jump.after.line} ({jump.distance:.4g} m in "
            f"{jump.after.time - jump.before.time:.3g} s); the vehicle is absent in between"
        )
    yield from _speed_notes(totals)
    path = sum(each.speeds.path for each in totals.vehicles.values())
    time = sum(each.speeds.time for each in totals.vehicles.values())
    if path > _TYPICAL * time:
        yield (
            f"the vehicles drive {path / time:.3g} m/s ({3.6 * path / time:.3g} km/h) on average; "
            "are the positions in feet instead of metres?"
        )


def _speed_notes(totals: Totals) -> Iterable[str]:
    vehicles = totals.vehicles
    verdicts = {name: each.speeds.verdict() for name, each in vehicles.items()}
    marked = [name for name, verdict in verdicts.items() if verdict is Verdict.MARK]
    if marked:
        first = vehicles[marked[0]]
        yield (
            f"speed is {first.speeds.low:g} in every row of vehicle {marked[0]!r}, which moves "
            f"(line {first.first.line}; {_count(len(marked), 'vehicle')} in all): read as unknown, "
            "speeds are those of the positions"
        )
    inexact = [
        name for name, verdict in verdicts.items() if verdict in (Verdict.INEXACT, Verdict.GROSS)
    ]
    if inexact:
        worst = max(inexact, key=lambda name: abs(math.log(vehicles[name].speeds.ratio())))
        ratio, line = vehicles[worst].speeds.ratio(), vehicles[worst].first.line
        yield (
            f"the speeds of {_count(len(inexact), 'vehicle')} of {len(vehicles)} differ from those "
            f"of the positions, most that of {worst!r} in line {line} ({ratio - 1:+.1%}): taken "
            "from the positions"
        )


def _count(number: int, noun: str) -> str:
    return f"{number} {noun}{'s' * (number != 1)}"
