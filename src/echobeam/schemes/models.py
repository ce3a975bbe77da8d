"""Models of the paper's filter in the coordinates of a scenario."""

from __future__ import annotations

from echobeam.physics.coordinates import Geometry
from echobeam.schemes.base import System, View
from echobeam.tracking.initial import initial_state
from echobeam.tracking.models import MeasurementModel, MotionModel
from echobeam.tracking.polar import PolarMeasurement, PolarMotion
from echobeam.values import Array, GaussianState


def motion_of(system: System) -> MotionModel:
    """Return the motion model of a scheme's filter."""
    settings = system.filter
    return PolarMotion(
        system.slot_duration,
        settings.angle_std,
        settings.distance_std,
        settings.velocity_std,
        settings.evolution,
    )


def exact_motion(geometry: Geometry, slot_duration: float) -> MotionModel:
    """Return the motion of nature without noise."""
    return PolarMotion(slot_duration, 0.0, 0.0, 0.0, "exact")


def measurement_model(geometry: Geometry, carrier: float) -> MeasurementModel:
    """Return the measurement model of a geometry; ``carrier`` in Hz."""
    return PolarMeasurement(carrier)


def measurement_of(system: System) -> MeasurementModel:
    """Return the measurement model of a scheme's filter."""
    return measurement_model(system.geometry, system.radio.carrier)


def first_state(value: Array, variance: Array, view: View) -> GaussianState:
    """Return the state that a first measurement alone gives (the paper's Note 2)."""
    system = view.system
    prior = system.filter.velocity_prior or None
    return initial_state(value, variance, PolarMeasurement(system.radio.carrier), view.uav, prior)
