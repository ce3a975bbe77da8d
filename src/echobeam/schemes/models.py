"""Models of the paper's filter in the coordinates of a scenario."""

from __future__ import annotations

from echobeam.physics.coordinates import Geometry
from echobeam.physics.plane import GroundGeometry
from echobeam.scenario.tables import FilterTable
from echobeam.schemes.base import System, View
from echobeam.tracking import plane_start
from echobeam.tracking.ground import GroundMotion
from echobeam.tracking.initial import initial_state
from echobeam.tracking.models import MeasurementModel, MotionModel
from echobeam.tracking.plane import PlaneMeasurement
from echobeam.tracking.polar import PolarMeasurement, PolarMotion
from echobeam.values import Array, GaussianState


def motion_of(system: System) -> MotionModel:
    """Return the motion model of a scheme's filter."""
    settings = system.filter
    if isinstance(system.geometry, GroundGeometry):
        return GroundMotion(system.slot_duration, settings.velocity_std, 2, known_height=True)
    return PolarMotion(
        system.slot_duration,
        settings.angle_std,
        settings.distance_std,
        settings.velocity_std,
        settings.evolution,
    )


def exact_motion(geometry: Geometry, slot_duration: float) -> MotionModel:
    """Return the motion of nature without noise."""
    if isinstance(geometry, GroundGeometry):
        return GroundMotion(slot_duration, 0.0, 2, known_height=True)
    return PolarMotion(slot_duration, 0.0, 0.0, 0.0, "exact")


def measurement_model(geometry: Geometry, carrier: float) -> MeasurementModel:
    """Return the measurement model of a geometry; ``carrier`` in Hz."""
    if isinstance(geometry, GroundGeometry):
        return PlaneMeasurement(geometry, carrier)
    return PolarMeasurement(carrier)


def measurement_of(system: System) -> MeasurementModel:
    """Return the measurement model of a scheme's filter."""
    return measurement_model(system.geometry, system.radio.carrier)


def velocity_prior_of(geometry: str, settings: FilterTable) -> float:
    """Return the standard deviation of a new object's velocity, m/s; 0 for no prior."""
    return settings.new_velocity_std if geometry == "ground" else settings.velocity_prior


def first_state(value: Array, variance: Array, view: View) -> GaussianState:
    """Return the state that a first measurement alone gives (the paper's Note 2).

    On the ground one Doppler does not tell two velocities, so that there is always a prior.
    """
    system = view.system
    prior = velocity_prior_of(system.geometry.name, system.filter)
    if isinstance(system.geometry, GroundGeometry):
        model = PlaneMeasurement(system.geometry, system.radio.carrier)
        return plane_start.first_state(value, variance, model, view.uav, prior)
    return initial_state(
        value, variance, PolarMeasurement(system.radio.carrier), view.uav, prior or None
    )
