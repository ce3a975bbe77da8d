"""Words and columns of `echobeam describe` for the ground: arrays and objects in two cosines."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from echobeam.cli.numbers import decibels

if TYPE_CHECKING:
    from echobeam.scenario.model import Scenario
    from echobeam.simulation.ground_budget import GroundBudget, GroundEcho
    from echobeam.simulation.link_budget import Budget

RATES: dict[str, Callable[[Budget], str]] = {
    "one antenna": lambda one: decibels(one.snr),
    "omni SINR": lambda one: decibels(one.omni_sinr),
    "omni rate": lambda one: f"{one.omni_rate:.3g}",
    "beam SNR": lambda one: decibels(one.beam_snr),
    "beam rate": lambda one: f"{one.beam_rate:.3g}",
}
"""Columns of the downlink that do not depend on the geometry."""

DOWNLINK: dict[str, Callable[[GroundBudget], str]] = {
    "object": lambda one: one.name,
    "x m": lambda one: f"{one.position[0]:.1f}",
    "y m": lambda one: f"{one.position[1]:.1f}",
    "u": lambda one: f"{one.cosines[0]:.3f}",
    "v": lambda one: f"{one.cosines[1]:.3f}",
    "distance m": lambda one: f"{one.distance:.1f}",
    **RATES,
}
"""Columns of the downlink."""

DEVIATIONS: dict[str, Callable[[tuple[GroundBudget, str, GroundEcho]], str]] = {
    "object": lambda row: row[0].name,
    "sent": lambda row: row[1],
    "u": lambda row: f"{row[2].cosine_std[0]:.3g}",
    "v": lambda row: f"{row[2].cosine_std[1]:.3g}",
    "distance m": lambda row: f"{row[2].distance_std:.3g}",
    "closing speed m/s": lambda row: f"{row[2].speed_std:.3g}",
    "x m": lambda row: f"{row[2].position_std[0]:.3g}",
    "y m": lambda row: f"{row[2].position_std[1]:.3g}",
}
"""Columns of the accuracies."""


def setting(scenario: Scenario) -> dict[str, str]:
    """Return what is said of array, UAV, filter and coverage."""
    believed, cover = scenario.filter, scenario.coverage
    return {
        "array": _array(scenario),
        "UAV": _flight(scenario),
        "filter": f"process noise per slot {believed.velocity_std:g} m/s of either velocity; "
        f"velocity prior {believed.new_velocity_std:g} m/s",
        "coverage": f"ellipses of {cover.width:g} standard deviations of the direction cosines "
        f"({cover.spread}), half-axes at most {math.sin(min(cover.max_halfwidth, math.pi / 2)):.3g}"
        f"; ripple {scenario.ripple:g}, lattice of step {cover.resolution:.3g}, rate floor "
        f"{cover.min_rate:g} bit/s/Hz",
    }


def _array(scenario: Scenario) -> str:
    from echobeam.schemes.configure import arrays_of

    array, carrier = scenario.array, f"{scenario.radio.carrier / 1e9:g} GHz"
    from echobeam.physics.planar import PlanarArray

    sends, receives = arrays_of(scenario)
    assert isinstance(sends, PlanarArray)  # of a single column, if linear
    if array.kind == "linear":
        return (
            f"{array.n_tx} antennas send, {array.receivers} receive, {array.spacing:g} wavelengths "
            f"apart, {array.axis}: one direction cosine, all around it, {carrier}"
        )
    sent, received = (" x ".join(map(str, one.shape)) for one in (sends, receives))
    widths = " x ".join(f"{width:.2g}" for width in sends.half_power_widths)
    faces = array.facing if isinstance(array.facing, str) else f"to {_vector(array.facing)}"
    polarised = "both polarisations" if array.polarisations == 2 else "one polarisation"
    elements = "isotropic elements" if array.element == "isotropic" else "elements of 8 dBi"
    return (
        f"{sent} elements send, {received} receive, {array.spacing:g} wavelengths apart, facing "
        f"{faces}, {elements} of {polarised}; a matched beam is {widths} wide in u and v between "
        f"its half-power points, {carrier}"
    )


def _flight(scenario: Scenario) -> str:
    uav = scenario.uav
    if uav.waypoints is not None:
        first = uav.waypoints[0]
        return f"past {len(uav.waypoints)} waypoints, from {_vector(first[1:])} m at {first[0]:g} s"
    assert uav.position is not None
    moves = "hovers" if uav.velocity is None else f"flies at {_vector(uav.velocity)} m/s"
    return f"{moves} {'at' if uav.velocity is None else 'from'} {_vector(uav.position)} m"


def _vector(parts: Sequence[float]) -> str:
    return f"({', '.join(f'{part:g}' for part in parts)})"
