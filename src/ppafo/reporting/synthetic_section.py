"""What the report says of the synthetic measurements: identified values, errors of the step response, the presets."""

from typing import Any

from ppafo.identification.estimate import Estimate
from ppafo.reporting.page import inline_figure
from ppafo.reporting.typesetting import quantity
from ppafo.studies.reproduction import Claim, Reproduction
from ppafo.studies.reproduction.bench import IDEAL, REALISTIC, SEED, IdentifiedValue
from ppafo.studies.reproduction.printed import Printed, load_printed
from ppafo.studies.reproduction.synthetic import STEP_PRESET, TASK_PRESET, NoEvidence

_NAMES = {
    "actuator.torque_constant": "torque per pressure difference",
    "friction.static_torque": "static friction",
    "friction.viscous_damping": "rotary damping",
    "friction.dynamic_torque": "dynamic friction",
    "valves.proportional.discharge_coefficient": "Cd of the proportional valve",
    "valves.solenoid.discharge_coefficient": "Cd of the solenoid valves",
    "actuator.leak.area": "area of the leak",
}
_STEP_CLAIMS = "step_rms_"


def synthetic_values(reproduction: Reproduction, figure: bytes | None) -> dict[str, Any]:
    """Return what the template needs of the synthetic measurements; without them only why there are none."""
    evidence = reproduction.synthetic
    if isinstance(evidence, NoEvidence):
        return {"synthetic": None, "no_synthetic": evidence.reason}
    printed = load_printed()
    return {
        "no_synthetic": "",
        "synthetic": {
            "figure": None if figure is None else inline_figure(figure),
            "rows": [_row(printed, value) for value in evidence.bench.values],
            "errors": [_error_row(claim) for claim in reproduction.claims if claim.id.startswith(_STEP_CLAIMS)],
            "ideal": IDEAL,
            "realistic": REALISTIC,
            "step_preset": STEP_PRESET,
            "task_preset": TASK_PRESET,
            "seed": SEED,
            "delay": f"{1e3 * evidence.step.delay.taken_out:.1f} ms",
        },
    }


def _row(printed: Printed, value: IdentifiedValue) -> tuple[str, str, str, str, str]:
    """Return name, experiment, planted value and what both presets gave, in the paper's unit."""
    return (
        _NAMES[value.path],
        value.experiment,
        _shown(printed, value.path, value.planted),
        _estimated(printed, value.path, value.ideal),
        _estimated(printed, value.path, value.realistic),
    )


def _shown(printed: Printed, path: str, number: float) -> str:
    return quantity(printed.in_printed_unit(path, number), _unit(printed, path), 4)


def _estimated(printed: Printed, path: str, estimate: Estimate) -> str:
    """Return value and half the width of its interval in percent; the ends would not differ within four digits."""
    half_width = 50.0 * (estimate.high - estimate.low) / abs(estimate.value)
    return f"{_shown(printed, path, estimate.value)} \u00b1 {half_width:.2g} %"


def _unit(printed: Printed, path: str) -> str:
    """Return the printed unit; a discharge coefficient is a plain number, whatever the paper prints behind it."""
    return "-" if path.endswith("discharge_coefficient") else printed.unit(path)


def _error_row(claim: Claim) -> tuple[str, str, str, str]:
    name = claim.statement.rpartition(" of the ")[2].rstrip(".")
    return name, quantity(claim.paper, claim.unit, 2), quantity(claim.value, claim.unit, 2), claim.verdict_words
