"""Grid of a scenario's waveform, its noise, and what it can tell apart."""

from __future__ import annotations

import numpy as np

from echobeam.physics.waveform import Waveform
from echobeam.scenario.checking import ScenarioError
from echobeam.scenario.model import Scenario
from echobeam.scenario.tables import RadarTable
from echobeam.values import Array


def waveform_of(radar: RadarTable) -> Waveform:
    """Return the waveform of a scenario's radar."""
    return Waveform(
        radar.bandwidth, radar.pulse_length, radar.subcarriers, radar.symbols, radar.modulation
    )


def element_noise(radar: RadarTable) -> float:
    """Return the noise in one resource element, with which integration gives the gain stated."""
    return radar.noise * radar.subcarriers * radar.symbols / radar.integrated


def check_unambiguous(scenario: Scenario, ideal: Array) -> None:
    """Refuse objects whose delay or Doppler shift the waveform would fold.

    Objects that move beyond later on are not measured there.

    Parameters
    ----------
    ideal
        ``(..., A + 2)``: measurements without noise; NaN where nobody is.

    Raises
    ------
    ScenarioError
        If an object present is beyond.
    """
    wave = waveform_of(scenario.radar)
    delay = float(np.fmax.reduce(ideal[..., -2], axis=None, initial=0.0))
    doppler = float(np.fmax.reduce(np.abs(ideal[..., -1]), axis=None, initial=0.0))
    if delay >= wave.unambiguous_delay:
        raise ScenarioError(
            f"{scenario.name}: an object's echo has a delay of {delay:.3g} s; expected below "
            f"{wave.unambiguous_delay:.3g} s, radar.subcarriers / radar.bandwidth"
        )
    if doppler >= wave.unambiguous_doppler:
        raise ScenarioError(
            f"{scenario.name}: an object's echo has a Doppler shift of {doppler:.3g} Hz; expected "
            f"below {wave.unambiguous_doppler:.3g} Hz, radar.symbols / (2 radar.pulse_length)"
        )
