"""Firmware of a controller for the paper's processor, an MSP430F2013: law in C, numbers, board layer, make file."""

from ppafo.control.catalog import CONTROLLERS
from ppafo.exports import filled, in_markdown, template
from ppafo.parameters.plant import plant_parameters
from ppafo.processor.controller import TICK, FixedPointController, fixed_point_controller
from ppafo.processor.fixed_point import SETTINGS
from ppafo.processor.law_in_c import law_source, macro
from ppafo.simulation.scenario import Scenario
from ppafo.units.shown import written_text
from ppafo.version import __version__

_LONGEST_FEEDING = 2.05e-3
"""Time after which the watchdog resets a processor that does not feed it [s]."""
_TEMPLATES = (
    *("Makefile", "README.md", "board.h", "board_msp430f2013.c", "board_simulated.c", "controller.h", "host.c"),
    *("main.c", "msp430f2013.ld", "start_msp430.c"),
)


def firmware(scenario: Scenario) -> dict[str, bytes]:
    """Return the firmware files of a controller by name. Raises ScenarioError without an integer form."""
    fixed = fixed_point_controller(scenario)
    scenario, steps, (top, middle) = fixed.scenario, fixed.steps, fixed.limits
    words = {
        "title": scenario.name,
        "description": in_markdown(scenario.description),
        "kind": fixed.law.kind.name,
        "version": __version__,
        "period": written_text(scenario.controller.period, "s"),
        "range": f"{scenario.controller.settings[SETTINGS[1].name] / 1.0e3:.6g} kPa",
        "step": f"{steps.pressure_step:.4g} Pa",
        "torque_step": f"{steps.torque_step * 1.0e3:.4g} mN m",
        "lowest": f"{-middle * steps.torque_step:.4g} N m",
        "highest": f"{(top - middle) * steps.torque_step:.4g} N m",
        "silence": f"{(2 * fixed.ticks * TICK + _LONGEST_FEEDING) * 1.0e3:.4g} ms",
    }
    texts = {name: filled(template("ppafo.processor", name), words) for name in _TEMPLATES}
    texts["LICENSE"] = template("ppafo.exports.c_library", "LICENSE")
    texts["controller.c"] = law_source(fixed.law)
    texts["parameters.h"] = parameters_header(fixed)
    return {name: text.encode() for name, text in sorted(texts.items())}


def parameters_header(fixed: FixedPointController) -> str:
    """Return ``parameters.h``: the numbers of a law with unit, meaning, origin and range check."""
    scenario, law = fixed.scenario, fixed.law
    control = scenario.controller
    declared = {quantity.name: quantity for quantity in CONTROLLERS[control.kind].quantities}
    source = scenario.origin.file or "a scenario without a file"
    settings = (
        f"{name} {value:.9g} {declared[name].unit} (controller.{name})".replace("  ", " ")
        for name, value in control.settings.items()
    )
    constant = plant_parameters(scenario.device, 0.0).torque_constant
    lines = [
        f"/* Numbers of the controller '{law.kind.name}' of {scenario.name}, made by ppafo {__version__} from:",
        f" *   period {control.period:.9g} s (controller.rate or controller.period of {source.rpartition('/')[2]})",
        *(f" *   {line}" for line in settings),
        f" *   torque over pressure {constant:.9g} N m/Pa (actuator of the set {scenario.origin.parameter_set})",
        " * Every number must stay within its range: for that the arithmetic is proved not to overflow. */",
        "#ifndef PPAFO_PARAMETERS_H",
        "#define PPAFO_PARAMETERS_H",
        "",
        f"#define CONTROLLER_TICKS {fixed.ticks}u /* of 125 us in a sample period of {control.period:.9g} s */",
        f"#define CONTROLLER_BITS {int(control.settings[SETTINGS[0].name])} /* of the converter */",
    ]
    for quantity in law.number_quantities:
        number = int(fixed.numbers[quantity.name])
        lines.append(
            f"#define {macro(quantity)} {number} /* {quantity.summary}; {quantity.minimum:g} to {quantity.maximum:g} */"
        )
        # A user may edit this file: the proof that nothing overflows holds within these ranges only.
        lines += [f"#if {macro(quantity)} < {quantity.minimum:.0f} || {macro(quantity)} > {quantity.maximum:.0f}"]
        lines += [f'#error "{macro(quantity)} is beyond its range"', "#endif"]
    return "\n".join([*lines, "", "#endif", ""])
