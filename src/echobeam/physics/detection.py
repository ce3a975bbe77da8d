"""Detection of echoes in noise: probability, false alarms, and where false ones are spread."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from echobeam.physics.fluctuation import STEADY, Fluctuation
from echobeam.physics.planar import AntennaArray, PlanarArray, linear
from echobeam.units import SPEED_OF_LIGHT
from echobeam.values import Array

TOP_SPEED = 60.0
"""Speed of the fastest road user, m/s: Doppler shifts beyond it are not looked at."""


def detection_probability(
    snr: npt.ArrayLike, false_alarm: float, fluctuation: Fluctuation = STEADY
) -> Array:
    """Return the probability that an echo exceeds the threshold of its cell.

    A square-law detector in noise of known power has the threshold -ln P_FA. A constant echo
    exceeds it with the probability of Marcum's function, one that fluctuates with its mean over
    the law, see `echobeam.physics.fluctuation`.

    Parameters
    ----------
    snr
        ``(...)``: SNR of the cell after all integration, at its mean if it fluctuates.
    false_alarm
        P_FA of a cell.
    fluctuation
        Law of the echo's strength.
    """
    snr = np.maximum(np.asarray(snr, dtype=np.float64), 0.0)
    return fluctuation.detection(snr, false_alarm)


@dataclass(frozen=True, slots=True)
class DetectionLaw:
    """Detection in the cells that a receiver searches, which the UAV knows as its equipment.

    The cells fill the directions that the array tells apart, the delays of the grid, and the
    Doppler shifts of road users. False alarms of the noise and clutter are uniform over them.

    Attributes
    ----------
    receiver
        The receive array; its gain, the number of its elements, is in the SNR of a cell.
    false_alarm
        P_FA of a cell.
    clutter
        Mean number of detections of no object in a slot, beyond those of the noise.
    longest
        Delay, s, up to which echoes are looked for.
    widest
        Doppler shift, Hz, up to which (on either side).
    cells
        Number of resolution cells.
    fluctuation
        Law of the strength of echoes.
    """

    receiver: AntennaArray
    false_alarm: float
    clutter: float
    longest: float
    widest: float
    cells: int
    fluctuation: Fluctuation

    @property
    def mean_false(self) -> float:
        """Mean number of detections in a slot that are of no object."""
        return self.false_alarm * self.cells + self.clutter

    @property
    def directions(self) -> tuple[float, float]:
        """Range of the spatial frequency u; a vertical array sees sin(theta), both sides as one."""
        return linear(self.receiver).visible

    def probability(self, snr: Array) -> Array:
        """Return P_D ``(...)`` for the echo SNR of one receive antenna, Eqs. (14), (16)."""
        return detection_probability(
            self.receiver.elements * snr, self.false_alarm, self.fluctuation
        )

    def density(self, direction: Array) -> Array:
        """Return the density of false detections in a direction ``(...)``, 1 / (rad s Hz).

        They are uniform in u, and so not in the angle: |du / dtheta| is cos or sin of it. Those of
        a planar array are uniform in (u, v) over the disc that is visible, 1 / (s Hz).
        """
        if isinstance(self.receiver, PlanarArray):
            on_disc = self.density_without_angle / np.pi
            return np.full(direction.shape[:-1], on_disc)
        angle = direction
        low, high = self.directions
        slope = np.abs(self.receiver.slope(angle))
        density: Array = self.density_without_angle * slope / (high - low)
        return density

    @property
    def density_without_angle(self) -> float:
        """Density of false detections over delay and Doppler alone, 1 / (s Hz)."""
        return self.mean_false / (self.longest * 2.0 * self.widest)


def detection_law(
    receiver: AntennaArray,
    *,
    false_alarm: float,
    clutter: float,
    subcarriers: int,
    bandwidth: float,
    pulse_length: float,
    carrier: float,
    uav_speed: float,
    fluctuation: Fluctuation,
) -> DetectionLaw:
    """Return the detection law of a receiver.

    Delays are searched up to the grid's longest one without ambiguity, N / B; the Doppler shifts
    up to that of `TOP_SPEED` towards the UAV's own speed. A cell is 1 / B by 1 / T by 1 / N_r.
    """
    widest = 2.0 * carrier * (TOP_SPEED + uav_speed) / SPEED_OF_LIGHT
    doppler_cells = int(np.ceil(2.0 * widest * pulse_length))
    return DetectionLaw(
        receiver=receiver,
        false_alarm=false_alarm,
        clutter=clutter,
        longest=subcarriers / bandwidth,
        widest=widest,
        cells=subcarriers * doppler_cells * receiver.elements,
        fluctuation=fluctuation,
    )
