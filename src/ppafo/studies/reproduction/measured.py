"""Claims that rest on recordings which the paper does not print: stated, and left open with the reason."""

from dataclasses import dataclass

from ppafo.studies.reproduction.claim import Claim
from ppafo.studies.reproduction.printed import Printed

_VALIDATION = "section 'PPAFO Model Validation'"
_NO_CURVES = "Needs the measured curves of figure 7; only their picture is published."


@dataclass(frozen=True, slots=True)
class _StepError:
    """A printed root-mean-square difference between simulation and measurement in the step response."""

    id: str
    quantity: str
    paper: float
    unit: str


_STEP_ERRORS = (
    _StepError("step_rms_position", "vane angle", 2.1, "deg"),
    _StepError("step_rms_pressure_1", "pressure in chamber 1", 3.7, "psi"),
    _StepError("step_rms_pressure_2", "pressure in chamber 2", 1.4, "psi"),
    _StepError("step_rms_pressure_difference", "pressure difference", 4.8, "psi"),
)


def measured_claims(printed: Printed) -> list[Claim]:
    """Return the claims that need a measurement: torque constant, static friction, leak and the step response."""
    return [
        _parameter(
            printed,
            "k_actuator",
            "actuator.torque_constant",
            "The actuator's torque per pressure difference is the slope of figure 3.",
            "Needs the recording of static torque over rising and falling pressure; only its picture is published.",
        ),
        _parameter(
            printed,
            "static_friction",
            "friction.static_torque",
            "The largest static friction is half the difference between falling and rising pressure in figure 3.",
            "Needs the same recording of static torque as the torque constant.",
        ),
        _parameter(
            printed,
            "leak_area",
            "actuator.leak.area",
            "The leak across the vane passes as much as an opening of this area.",
            "Needs the measured flow across the vane, its pressures and its discharge coefficient; none is legible.",
        ),
        *(_step_error(error) for error in _STEP_ERRORS),
    ]


def _parameter(printed: Printed, identifier: str, path: str, statement: str, reason: str) -> Claim:
    number, unit, source = printed.number(path), printed.unit(path), printed.source(path)
    return Claim(identifier, statement, number, None, unit, "not_testable", source, reason)


def _step_error(error: _StepError) -> Claim:
    statement = f"Step response, simulated against measured: RMS error of the {error.quantity}."
    return Claim(error.id, statement, error.paper, None, error.unit, "not_testable", _VALIDATION, _NO_CURVES)
