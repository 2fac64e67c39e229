"""Claims that rest on recordings which the paper does not print: tested on synthetic ones, or left open with a reason.

What a synthetic recording shows is that the procedure works. It says nothing about the paper's device, so that none of
these claims is ever plainly reproduced.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from ppafo.constants import PASCALS_PER_PSI
from ppafo.parameters.audit.evidence import Interval
from ppafo.questions.reproduce.assumed import AssumedValue
from ppafo.questions.reproduce.bench import IDEAL, REALISTIC, SEED, BenchStudy
from ppafo.questions.reproduce.claim import Claim, Verdict
from ppafo.questions.reproduce.printed import Printed
from ppafo.questions.reproduce.synthetic import STEP_PRESET, NoEvidence, SyntheticEvidence
from ppafo.validation import RecordingAgreement

ACCEPTABLE = 0.10
"""Fraction of the full range [-] that the paper calls an acceptable RMS error."""

_VALIDATION = "section 'PPAFO Model Validation'"
_NO_CURVES = "Needs the measured curves of figure 7; only a picture of them is published."
_ONLY_THE_PROCEDURE = "The measurement is synthetic: it shows that the procedure works, not that the paper's device"


@dataclass(frozen=True, slots=True)
class _Parameter:
    """A printed parameter that the bench gives: what the paper says, why it stays open without one, which preset."""

    id: str
    path: str
    statement: str
    reason: str
    preset: str
    why: str


@dataclass(frozen=True, slots=True)
class _StepError:
    """A printed root-mean-square difference between simulation and measurement.

    ``full_range`` is the paper's, ``scale`` the unit in SI.
    """

    id: str
    quantity: str
    paper: float
    unit: str
    full_range: float
    channel: str
    scale: float


_PARAMETERS = (
    _Parameter(
        "k_actuator",
        "actuator.torque_constant",
        "The actuator's torque per pressure difference is the slope of figure 3.",
        "Needs the recording of static torque over rising and falling pressure; only a picture of it is published.",
        REALISTIC,
        "with every effect of a bench on",
    ),
    _Parameter(
        "static_friction",
        "friction.static_torque",
        "The largest static friction is half the difference between falling and rising pressure in figure 3.",
        "Needs the same recording of static torque as the torque constant.",
        IDEAL,
        "for on paper-bench friction grows with the pressure and is not one number",
    ),
    _Parameter(
        "leak_area",
        "actuator.leak.area",
        "The leak across the vane passes as much as an opening of this area.",
        "Needs the measured flow across the vane, its pressures and its discharge coefficient; none is legible.",
        IDEAL,
        "for on paper-bench a part of the leak is laminar and has no area",
    ),
)
_STEP_ERRORS = (
    _StepError("step_rms_position", "vane angle", 2.1, "deg", 110.0, "angle", math.pi / 180.0),
    _StepError("step_rms_pressure_1", "pressure in chamber 1", 3.7, "psi", 55.0, "pressure_1", PASCALS_PER_PSI),
    _StepError("step_rms_pressure_2", "pressure in chamber 2", 1.4, "psi", 55.0, "pressure_2", PASCALS_PER_PSI),
    _StepError(
        "step_rms_pressure_difference",
        "pressure difference",
        4.8,
        "psi",
        110.0,
        "pressure_difference",
        PASCALS_PER_PSI,
    ),
)


def measured_claims(
    printed: Printed, evidence: SyntheticEvidence | NoEvidence, assumed: Sequence[AssumedValue]
) -> list[Claim]:
    """Return the claims that need a measurement: torque constant, static friction, leak and the step response.

    ``assumed`` is what the simulated step response rests on.
    """
    if isinstance(evidence, NoEvidence):
        return [
            *(_open_parameter(printed, item, evidence.reason) for item in _PARAMETERS),
            *(_open_step_error(item, evidence.reason) for item in _STEP_ERRORS),
        ]
    rests_on = tuple(value.sentence() for value in assumed)
    return [
        *(_identification_claim(printed, item, evidence.bench) for item in _PARAMETERS),
        *(_step_error(item, evidence.step, rests_on) for item in _STEP_ERRORS),
    ]


def _open_parameter(printed: Printed, item: _Parameter, reason: str) -> Claim:
    number, unit, source = printed.number(item.path), printed.unit(item.path), printed.source(item.path)
    note = f"{item.reason} {_no_rig(reason)}"
    return Claim(item.id, item.statement, number, None, unit, "not_testable", source, note)


def _open_step_error(item: _StepError, reason: str) -> Claim:
    note = f"{_NO_CURVES} {_no_rig(reason)}"
    return Claim(item.id, _step_statement(item), item.paper, None, item.unit, "not_testable", _VALIDATION, note)


def _no_rig(reason: str) -> str:
    return f"No synthetic measurement stands in for it: {reason}."


def _step_statement(item: _StepError) -> str:
    return f"Step response, simulated against measured: RMS error of the {item.quantity}."


def _identification_claim(printed: Printed, item: _Parameter, bench: BenchStudy) -> Claim:
    """Ask whether the identified interval holds the planted value, which is the paper's, to its printed digits."""
    found = bench[item.path].ideal if item.preset == IDEAL else bench[item.path].realistic
    holds = printed.range(item.path).meets(Interval(found.low, found.high))
    value, low, high = (printed.in_printed_unit(item.path, number) for number in (found.value, found.low, found.high))
    unit = printed.unit(item.path)
    note = (
        f"{_ONLY_THE_PROCEDURE} has this value. The paper's value was planted in the virtual rig "
        f"(preset {item.preset}, {item.why}); the {100.0 * found.confidence:g}% interval, "
        f"{low:.4g} to {high:.4g} {unit}, "
        f"{'holds' if holds else 'does not hold'} it."
    )
    return Claim(
        id=item.id,
        statement=item.statement,
        paper=printed.number(item.path),
        value=value,
        unit=unit,
        verdict=_verdict(holds),
        source=printed.source(item.path),
        note=note,
        assumptions=(_rig(item.preset),),
        is_synthetic=True,
    )


def _step_error(item: _StepError, agreement: RecordingAgreement, rests_on: tuple[str, ...]) -> Claim:
    """Judge an RMS error by the range that the paper calls acceptable."""
    channel = next(channel for channel in agreement.channels if channel.channel == item.channel)
    value, plain = channel.rms / item.scale, channel.rms_unaligned / item.scale
    fraction, plain_fraction = value / item.full_range, plain / item.full_range
    holds = fraction <= ACCEPTABLE
    delay = f"{1e3 * agreement.delay.correction:.1f} ms"
    note = (
        f"{_ONLY_THE_PROCEDURE} behaved so. Model against the virtual rig (preset {STEP_PRESET}): {fraction:.1%} of "
        f"the full range of {item.full_range:g} {item.unit}, {'within' if holds else 'beyond'} the {ACCEPTABLE:.0%} "
        f"that the paper calls acceptable. The rig's delay of {delay} was removed; with it the error is {plain:.2g} "
        f"{item.unit}, {plain_fraction:.1%}{'' if plain_fraction <= ACCEPTABLE else ', which is beyond'}."
    )
    return Claim(
        id=item.id,
        statement=_step_statement(item),
        paper=item.paper,
        value=value,
        unit=item.unit,
        verdict=_verdict(holds),
        source=_VALIDATION,
        note=note,
        assumptions=(
            _rig(STEP_PRESET),
            f"the delay of {delay} is removed: the paper does not state whether it shifted its curves",
            f"the error is taken over {agreement.measured.duration:g} s: the paper does not state over which time",
            *rests_on,
        ),
        is_synthetic=True,
    )


def _verdict(holds: bool) -> Verdict:
    return "shown_on_synthetic" if holds else "contradicted"


def _rig(preset: str) -> str:
    return f"the measurement is synthetic: virtual rig, preset {preset}, seed {SEED}, the paper's values planted"
