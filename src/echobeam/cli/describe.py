"""Command `echobeam describe`."""

from __future__ import annotations

import dataclasses
import json
import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from echobeam.cli import describe_ground as on_ground
from echobeam.cli import options
from echobeam.cli.columns import filled, table
from echobeam.cli.describe_ground import RATES
from echobeam.cli.numbers import dbm, decibels, degrees, duration, scaled, watts

if TYPE_CHECKING:
    from echobeam.scenario.model import Scenario
    from echobeam.scenario.tables import RadarTable
    from echobeam.simulation.assumption import Assumption
    from echobeam.simulation.description import Description
    from echobeam.simulation.link_budget import Budget, EchoBudget, ObjectBudget, PowerScale

MOST_OBJECTS = 20
"""Largest number of rows (objects) in a table; JSON has all objects."""


@click.command("describe")
@click.argument("scenario")
@options.overrides
@options.trace
@click.option(
    "--json",
    "as_json",
    is_flag=True,
    help="Print all numbers as JSON: SI units, radians, linear powers.",
)
def command(scenario: str, overrides: tuple[str, ...], trace: str | None, as_json: bool) -> None:
    r"""Describe SCENARIO: link budget, first measurements, and assumptions.

    Nothing is run. A warning names each assumption of the model that does not hold.

    \b
    echobeam describe paper-single
    echobeam describe mine.toml --set radio.power=1000 --set array.n_tx=256 --json
    """
    from echobeam.commands.describe import describe

    description = describe(scenario, set=overrides, trace=trace)
    click.echo(_json(description) if as_json else _text(description))


def _json(description: Description) -> str:
    """Return the numbers as strict JSON; NaN and infinity become null."""
    from echobeam.numerals import as_json

    document: dict[str, Any] = {
        "scenario": description.scenario.name,
        "slot": description.slot,
        "scale": dataclasses.asdict(description.scale),
        "objects": [dataclasses.asdict(one) for one in description.objects],
        "assumptions": [dataclasses.asdict(one) for one in description.assumptions],
    }
    return json.dumps(as_json(document), indent=1, allow_nan=False)


def _text(description: Description) -> str:
    scenario, objects = description.scenario, description.objects
    shown = objects[:MOST_OBJECTS]
    lines = [f"{scenario.name}: {scenario.description}".removesuffix(": "), "", *_setting(scenario)]
    lines += ["", "powers", *_powers(description.scale, scenario)]
    if shown:
        place, ground = f"slot {description.slot}", scenario.geometry == "ground"
        link, told = (on_ground.DOWNLINK, on_ground.DEVIATIONS) if ground else (LINK, DEVIATIONS)
        lines += ["", f"downlink in {place}, dB and bit/s/Hz", *table(link, shown)]
        lines += ["", f"echo in {place}, dB", *_echoes(shown, scenario)]
        lines += ["", f"standard deviations of a measurement in {place}"]
        lines += table(told, _phases(shown))
    else:
        lines += ["", "no object in the scene: the UAV senses only"]
    if len(objects) > len(shown):
        lines.append(f"  and {len(objects) - len(shown)} more objects, see --json")
    found = description.assumptions
    lines += ["", *(filled("WARNING ", f"{a.name}: {a.statement}") for a in description.warnings)]
    lines += [filled("holds    ", ", ".join(map(_held, (a for a in found if a.holds))))]
    lines += [filled("taken    ", "; ".join(a.statement for a in found if a.holds is None))]
    return "\n".join(lines)


def _setting(scenario: Scenario) -> list[str]:
    radar, frame = scenario.radar, scenario.frame
    own = on_ground.setting(scenario) if scenario.geometry == "ground" else _on_road(scenario)
    moved = (
        f"of the trace {Path(scenario.trace.file).name}"
        if scenario.trace
        else f"{scenario.n_objects}"
    )
    rows = {
        "array": own["array"],
        "UAV": own["UAV"],
        "objects": moved,
        "frame": f"{frame.slots_per_frame} slots of {duration(frame.slot)}, {frame.frames} of "
        f"these frames ({duration(scenario.n_slots * frame.slot)}); slot 1 of a frame is "
        "omnidirectional or a pilot, the others have beams",
        "radar": f"bandwidth {scaled(radar.bandwidth, 'Hz')}, pulse {duration(radar.pulse_length)}"
        f", integration {_gain(radar)}, {radar.crb} bound, variance "
        + (radar.variance if radar.model == "crb" else "stated by the receiver"),
        "echo": _model(scenario),
        **_target(scenario),
        "filter": own["filter"],
        "coverage": own["coverage"],
        "schemes": ", ".join(_scheme(name, scenario) for name in scenario.schemes),
    }
    if scenario.unlabelled:
        rows |= _unlabelled(scenario)
    return [filled(f"{name:9}", words) for name, words in rows.items()]


def _on_road(scenario: Scenario) -> dict[str, str]:
    """Return what is said of array, UAV, filter and coverage in the road's vertical plane."""
    array, uav, believed, cover = (
        scenario.array,
        scenario.uav,
        scenario.filter,
        scenario.coverage,
    )
    follows = "sine" if array.axis == "vertical" else "cosine"
    prior = (
        f"velocity prior {believed.velocity_prior:g} m/s"
        if believed.velocity_prior
        else "no velocity prior"
    )
    return {
        "array": f"{array.n_tx} antennas send, {array.receivers} receive, {array.spacing:g} "
        f"wavelengths apart, {array.axis} (phase by the {follows} of the angle), "
        f"{scenario.radio.carrier / 1e9:g} GHz",
        "UAV": f"{uav.height:g} m high, {uav.speed:g} m/s at {degrees(uav.heading)} degrees "
        "from the horizontal (-90 descends)",
        "filter": f"{believed.evolution} evolution, process noise per slot "
        f"{degrees(believed.angle_std)} degrees, {believed.distance_std:g} m, "
        f"{believed.velocity_std:g} m/s; {prior}",
        "coverage": f"{cover.width:g} standard deviations of the angle ({cover.spread}), at most "
        f"{degrees(cover.max_halfwidth)} degrees; ripple {scenario.ripple:g}, grid "
        f"{degrees(cover.resolution)} degrees, rate floor {cover.min_rate:g} bit/s/Hz",
    }


def _unlabelled(scenario: Scenario) -> dict[str, str]:
    """Return how detections come about and are associated where nobody labels them."""
    from echobeam.schemes.configure import detection_of

    law, tracks = detection_of(scenario), scenario.tracks
    return {
        "detected": f"unlabelled; {law.cells:,} cells with a false-alarm rate of "
        f"{law.false_alarm:g} each and {law.clutter:g} of clutter: {law.mean_false:.3g} false "
        "detections in a slot",
        "tracks": f"at most {tracks.capacity}, association {tracks.association}, gate "
        f"{tracks.gate:g}; {tracks.confirm} detections in {tracks.window} slots confirm one, "
        f"{tracks.coast} slots without any delete it",
    }


def _gain(radar: RadarTable) -> str:
    """Return the gain of coherent integration and what it is."""
    if radar.integration == "gain":
        return f"{decibels(radar.integrated)} dB (G_m)"
    elements = radar.subcarriers * radar.symbols
    return f"{decibels(radar.integrated)} dB (all {elements} resource elements)"


def _target(scenario: Scenario) -> dict[str, str]:
    """Return the standard's target and what its cross-section is relative to, if there is one."""
    from echobeam.physics.targets import TARGETS

    target = TARGETS.get(scenario.radar.target)
    if target is None:
        return {}
    depends = "depends on the aspect" if target.directional else "is alike from all sides"
    return {
        "target": f"{scenario.radar.target} of TR 38.901: the mean cross-section of "
        f"{target.mean:g} dBsm has the echo of |epsilon|^2; it {depends} and fluctuates by "
        f"{target.fluctuation.std:g} dB, log-normal"
    }


def _fluctuation(scenario: Scenario) -> str:
    """Return the law of an echo's amplitude in words."""
    from echobeam.physics.fluctuation import LogNormal
    from echobeam.schemes.configure import fluctuation_of

    law = fluctuation_of(scenario)
    return (
        "constant" if law.steady else "log-normal" if isinstance(law, LogNormal) else "Swerling I"
    )


def _model(scenario: Scenario) -> str:
    """Return how measurements come about, and what a waveform tells apart."""
    radar, fluctuation = scenario.radar, _fluctuation(scenario)
    if radar.model == "crb":
        return f"measurements Gaussian with the variance of the bound; amplitude {fluctuation}"
    from echobeam.simulation.grid import waveform_of
    from echobeam.units import SPEED_OF_LIGHT

    wave, speed = waveform_of(radar), 0.5 * SPEED_OF_LIGHT / scenario.radio.carrier
    return (
        f"OFDM signal of {radar.subcarriers} subcarriers and {radar.symbols} symbols, "
        f"{radar.modulation}; cells of {0.5 * SPEED_OF_LIGHT / radar.bandwidth:.3g} m and "
        f"{speed / radar.pulse_length:.3g} m/s, unambiguous to "
        f"{0.5 * SPEED_OF_LIGHT * wave.unambiguous_delay:.4g} m and "
        f"{speed * wave.unambiguous_doppler:.4g} m/s; {radar.filter} filter, {radar.cfar} CFAR at "
        f"{radar.false_alarm:g}, angle by {radar.angle.upper()}; amplitude {fluctuation}"
    )


def _scheme(name: str, scenario: Scenario) -> str:
    """Return a scheme's name with the parameters that the scenario gives it."""
    own = scenario.scheme_parameters.get(name, {})
    return f"{name} ({', '.join(f'{key}={value}' for key, value in own.items())})" if own else name


def _powers(scale: PowerScale, scenario: Scenario) -> list[str]:
    figure, bandwidth = decibels(scale.noise_figure), scaled(scale.bandwidth, "Hz")
    said = [
        f"P_T = {scale.power:g} (radio.power, linear): sent by one antenna it gives an SNR of "
        f"{decibels(scale.snr_at_1m)} dB at 1 m, P_T alpha0^2 / sigma_C^2",
        f"in free space at {scenario.radio.carrier / 1e9:g} GHz, with thermal noise of {bandwidth}"
        f" at {scale.temperature:g} K and a noise figure of {figure} dB "
        f"({dbm(scale.noise_power)}), this is a transmit power of {watts(scale.transmit_power)};"
        f" 1 W (30 dBm) is radio.power = {scale.watt:.4g}",
        f"the echo has the power of a target of {scale.cross_section:.3g} m^2 "
        f"({decibels(scale.cross_section)} dBsm); with integration over a whole slot, "
        f"{decibels(scale.full_integration)} dB instead of the {_gain(scenario.radar)}, a "
        f"target of {scale.full_cross_section:.3g} m^2 ({decibels(scale.full_cross_section)} dBsm) "
        "gives the same SNR",
    ]
    return [filled("  ", words) for words in said]


LINK: dict[str, Callable[[ObjectBudget], str]] = {
    "object": lambda one: one.name,
    "angle deg": lambda one: degrees(one.angle),
    "distance m": lambda one: f"{one.distance:.1f}",
    **RATES,
    "beam width deg": lambda one: degrees(one.beam_width),
}
"""Columns of the downlink."""

DEVIATIONS: dict[str, Callable[[tuple[ObjectBudget, str, EchoBudget]], str]] = {
    "object": lambda row: row[0].name,
    "sent": lambda row: row[1],
    "angle deg": lambda row: degrees(row[2].angle_std),
    "distance m": lambda row: f"{row[2].distance_std:.3g}",
    "closing speed m/s": lambda row: f"{row[2].speed_std:.3g}",
    "along the road m/s": lambda row: f"{row[2].velocity_std:.3g}",
}
"""Columns of the accuracies."""


def _echoes(objects: Sequence[Budget], scenario: Scenario) -> list[str]:
    from echobeam.physics.targets import TARGETS

    columns: dict[str, Callable[[Any], str]] = {
        "object": lambda row: row[0].name,
        "sent": lambda row: row[1],
        "one antenna": lambda row: decibels(row[2].raw_snr),
        "matched filter": lambda row: decibels(row[2].snr),
        "receive array": lambda row: decibels(row[2].array_snr),
    }
    if scenario.radar.crb == "paper":
        columns["as (20) counts it"] = lambda row: decibels(row[2].counted_snr)
    target = TARGETS.get(scenario.radar.target)
    if target is not None:
        mean = 10.0 ** (0.1 * target.mean)
        columns["cross-section dBsm"] = lambda row: decibels(mean * row[0].cross_section)
    if scenario.unlabelled:
        columns["detected %"] = lambda row: f"{100.0 * row[2].detection:.3g}"
    return table(columns, _phases(objects))


def _phases(objects: Sequence[Any]) -> list[tuple[Any, str, Any]]:
    """Return every object with both of its transmissions and their echoes."""
    return [
        (one, sent, echo)
        for one in objects
        for sent, echo in (("omni", one.omni_echo), ("beam", one.beam_echo))
    ]


def _held(one: Assumption) -> str:
    """Return the name of an assumption that holds, with its value and limit."""
    if not (math.isfinite(one.value) and math.isfinite(one.limit)):
        return one.name
    return f"{one.name} ({_quantity(one.value, one.unit)}, limit {_quantity(one.limit, one.unit)})"


def _quantity(value: float, unit: str) -> str:
    match unit:
        case "1":
            return f"{value:.3g}"
        case "rad":
            return f"{degrees(value)} deg"
        case "Hz" | "s":
            return scaled(value, unit)
        case _:
            return f"{value:.3g} {unit}"
