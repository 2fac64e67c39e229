"""Integer controller of a scenario: law, numbers, converter and sample period, and its decisions in Python."""

from dataclasses import replace
from typing import Any, NamedTuple

from ppafo.control.catalog import FIXED_POINT
from ppafo.engine.composer import each
from ppafo.errors import ScenarioError
from ppafo.model.controlled import TORQUE
from ppafo.processor.fixed_point import SETTINGS, ConverterCounts, CountResolution
from ppafo.processor.torque_laws.law import FixedLaw
from ppafo.processor.torque_laws.on_off import DEAD_ZONE, ON_OFF
from ppafo.processor.torque_laws.pid import PID
from ppafo.simulation.default_gains import converter_range
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import Scenario

FIXED_LAWS: dict[str, FixedLaw] = {law.kind.name: law for law in (PID, ON_OFF, DEAD_ZONE)}
"""Integer controllers by name in scenarios."""
TICK = 125.0e-6
"""Timer tick [s], the unit of the sample period."""
MOST_TICKS = 32767
"""Largest number of timer ticks in a signed 16-bit integer."""


class FixedPointController(NamedTuple):
    """Integer controller: scenario, law with its integers, converter resolution, timer ticks per sample."""

    scenario: Scenario
    law: FixedLaw
    numbers: Any
    steps: CountResolution
    ticks: int


def fixed_point_controller(scenario: Scenario) -> FixedPointController:
    """Return the integer controller of a scenario. Raises ScenarioError if the timer cannot produce its period."""
    scenario = integer_form(scenario)
    period = scenario.controller.period
    ticks = round(period / TICK)
    # Half of the range: the watchdog waits for two sample periods.
    if not 1 <= ticks <= MOST_TICKS // 2 or abs(ticks * TICK - period) > 1.0e-9 * period:
        raise ScenarioError(
            f"{scenario.name}: controller.period = {period:.9g} s: must be a multiple of 0.125 ms on the processor, "
            f"at most {MOST_TICKS // 2 * TICK:.3g} s"
        )
    law = FIXED_LAWS[scenario.controller.kind]
    run = plan_run(scenario)
    if run.program.valve.regulates:
        raise ScenarioError(f"{scenario.name}: device.valve: the firmware sets no pressure; give a valve that it opens")
    if "sent_command" in run.program.ports_with_laws:
        raise ScenarioError(
            f"{scenario.name}: effects.opening: the firmware inverts no table of openings; omit the table"
        )
    row = run.controller
    return FixedPointController(scenario, law, each(int, row.numbers), row.steps, ticks)


def integer_form(scenario: Scenario) -> Scenario:
    """Return a scenario with its controller in integer arithmetic, with default converter settings.

    Raises ScenarioError if the controller has no integer form.
    """
    kind = scenario.controller.kind
    if scenario.controlled != TORQUE:
        raise ScenarioError(
            f"{scenario.name}: reference.of = '{scenario.controlled}': a fixed-point controller follows a torque "
            f"only; give a scenario with reference.of = 'torque'"
        )
    if kind in FIXED_LAWS:
        return scenario
    if f"{kind}{FIXED_POINT}" not in FIXED_LAWS:
        raise ScenarioError(
            f"{scenario.name}: the controller '{kind}' has no fixed-point form; available: "
            f"{', '.join(name.removesuffix(FIXED_POINT) for name in FIXED_LAWS)}"
        )
    scenario.device.check_torque_constant("a fixed-point controller")
    supply = scenario.device.supply
    bits, pressure_range = SETTINGS
    shown = converter_range(float(supply.pressure), float(supply.dorsiflexion_pressure))
    settings = {**scenario.controller.settings, bits.name: bits.default or 0.0, pressure_range.name: shown}
    return replace(scenario, controller=replace(scenario.controller, kind=f"{kind}{FIXED_POINT}", settings=settings))


class PythonProcessor:
    """Integer controller of a scenario in Python, with processor arithmetic."""

    def __init__(self, fixed: FixedPointController) -> None:
        self.law = fixed.law
        self.numbers = fixed.numbers
        self.state: Any = fixed.law.begins

    def begin(self) -> None:
        """Reset the controller state."""
        self.state = self.law.begins

    def sample(self, readings: ConverterCounts) -> tuple[int, int]:
        """Return command [steps] and validity flag for readings."""
        command, self.state = self.law.sample(self.numbers, self.state, readings)
        return command, self.state.sound
