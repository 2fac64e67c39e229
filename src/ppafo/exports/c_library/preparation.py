"""From the settings of a scenario to the numbers of a run: one composed function, which calls those of the planning."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

from ppafo.constants import UNIVERSAL_GAS_CONSTANT
from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.engine.lane_rows import indent
from ppafo.engine.program import LaneResult, LaneTiming, Program
from ppafo.engine.rows import leaf_paths, numbers, row_expression
from ppafo.engine.run import NEVER_FAILED, initial_masses, sensors_at_start, whole_and_rest
from ppafo.engine.scheme.parts import Pace
from ppafo.engine.source_text import SourceCollector
from ppafo.exports.c_library.files import Relation, Setting, c_identifier
from ppafo.exports.c_library.program import COUNTS
from ppafo.model.declaration import Quantity
from ppafo.model.gas import specific_gas_constant
from ppafo.model.regulator import SupplyLines
from ppafo.model.sensors import SensorParameters
from ppafo.model.valves.catalog import VALVES
from ppafo.parameters.building import consistency
from ppafo.parameters.declaration import SECTIONS
from ppafo.parameters.device import SonicOrifice
from ppafo.parameters.plant import area_restriction, plant_with, sonic_restriction
from ppafo.simulation.motion import TOLERANCE
from ppafo.simulation.numbers import HELD_ANGLE, TIMES, declared_numbers, number_at, other_form
from ppafo.simulation.preparation import (
    is_slow_held,
    lines_at_start,
    rates_of_sensors,
    state_at_start,
    step_counts,
    thermal_gas,
)
from ppafo.simulation.scenario import FreeMotion, PrescribedMotion, Scenario
from ppafo.simulation.supply_line import LINES, SECTION

ENTRY = '@njit("void(float64[::1], float64[::1], float64[::1], float64[::1])")'
_SAID = {
    "run.step": "longest step of the engine",
    "run.output_interval": "time from one sample to the next",
    "controller.period": "time between two decisions of the controller",
}
"""What some settings are where no file stands around them."""
_LEVEL_OF_HELD = "motion.profile.level"
_SECTIONS = ("gas", "actuator", "friction", "foot_plate", "supply")


def settings_of(scenario: Scenario) -> tuple[Setting, ...]:
    """Every number of a scenario in SI units, under the path that overrides know it by."""
    times = {
        "run.duration": scenario.duration,
        "run.step": scenario.time_step,
        "run.output_interval": scenario.output_interval,
        "controller.period": scenario.control.period,
    }
    return tuple(
        Setting(
            c_identifier(path),
            path,
            replace(item, summary=_SAID.get(path, item.summary)),
            times[path] if path in TIMES else number_at(scenario, path),
        )
        for path, item in _declared(scenario).items()
    )


def relations_of(scenario: Scenario) -> tuple[Relation, ...]:
    """Settings that contradict each other, as they would in a file."""
    rules: list[tuple[str, str, str, float]] = [
        *((path, relation, other, 0.0) for path, relation, other, _ in consistency(scenario.device)),
        ("run.step", "at most", "run.duration", 0.0),
        ("run.step", "at most", "run.output_interval", TOLERANCE * scenario.time_step),
        ("run.output_interval", "at most", "run.duration", 0.0),
        ("sensors.delay", "at most", "run.duration", 0.0),
    ]
    if HELD_ANGLE in _declared(scenario):
        rules.append((HELD_ANGLE, "at least", "actuator.angle_min", TOLERANCE))
        rules.append((HELD_ANGLE, "at most", "actuator.angle_max", TOLERANCE))
    if scenario.supply_lines is not None:
        rules.append(("supply.dorsiflexion_pressure", "at most", "supply.pressure", 0.0))
    return tuple(
        Relation(c_identifier(path), relation, c_identifier(other), slack) for path, relation, other, slack in rules
    )


def _declared(scenario: Scenario) -> dict[str, Quantity]:
    """Declarations by path, without the form of an orifice that is not used, and without second names."""
    declared = declared_numbers(scenario)
    unused = {"controller.rate"}
    unused |= {f"{section}.{name}" for section in ("valve", "actuator.leak") for name in other_form(scenario, section)}
    if HELD_ANGLE in declared and isinstance(scenario.motion, PrescribedMotion):
        unused.add(_LEVEL_OF_HELD)
    return {path: item for path, item in declared.items() if path not in unused}


class Preparation:
    """Writes the function that fills the numbers of a run; ``text`` is it, once everything it calls is gathered."""

    def __init__(self, scenario: Scenario, program: Program, collector: SourceCollector) -> None:
        self.scenario = scenario
        self.program = program
        self.add = collector.add
        self.rows: dict[str, list[str]] = {}
        self.settings = settings_of(scenario)

    def text(self) -> str:
        """The composed function ``prepare``, and the rows that only it has."""
        names = [item.name for item in self.settings]
        body = [f"{name} = settings[{place}]" for place, name in enumerate(names)]
        body += [*self.device(), *self.steps(), *self.pieces(), *self.start()]
        groups = {"parameters": self.program.parameter_rows(), "states": self.initial_rows()}
        for array, rows in groups.items():
            paths = [path for name, row in rows.items() for path in leaf_paths(row, name)]
            body += [f"{array}[{place}] = {path}" for place, path in enumerate(paths)]
        counted = {
            "interval": "counts_of_steps.record_every",
            "steps": "counts_of_steps.step_count",
            "steps_per_sample": "counts_of_steps.steps_per_sample",
            "signal_delay": "signal_steps",
            "command_delay": "command_steps",
            "needs_parts": "1.0 if needs_parts else 0.0",
        }
        body += [f"counts[{place}] = {counted[name]}" for place, name in enumerate(COUNTS)]
        own = [f"{name} = namedtuple({name!r}, {fields!r})" for name, fields in self.rows.items()]
        return "\n".join([*own, ENTRY, "def prepare(settings, parameters, states, counts):", *indent(body)])

    def initial_rows(self) -> dict[str, type]:
        """State rows that a run begins with; those of meters begin with the first sample."""
        later = {"course", *self.program.meter_groups}
        return {name: row for name, row in self.program.state_rows().items() if name not in later}

    def row(self, name: str, fields: Mapping[str, str]) -> str:
        """A row that is made here alone, by its fields."""
        self.rows[name] = list(fields)
        return f"{name}({', '.join(f'{field}={value}' for field, value in fields.items())})" if fields else "()"

    def section(self, section: str, names: Sequence[str]) -> dict[str, str]:
        """The names in C of some settings of a section, by their own."""
        return {name: c_identifier(f"{section}.{name}") for name in names}

    def device(self) -> Iterator[str]:
        """Lines that make the device and its plant."""
        scenario, add = self.scenario, self.add
        fields = {name: self.section(name, [item.name for item in SECTIONS[name]]) for name in _SECTIONS}
        constant = f"{add(specific_gas_constant)}({UNIVERSAL_GAS_CONSTANT!r}, gas_molar_mass)"
        fields["gas"] = fields["gas"] | {"specific_gas_constant": constant}
        takes_back = scenario.device.supply.relieving or scenario.supply_lines is not None
        fields["supply"] = fields["supply"] | {"relieving": repr(float(takes_back))}
        for name, inner in fields.items():
            yield f"{name} = {self.row(name.title().replace('_', ''), inner)}"
        yield f"device = {self.row('Device', {name: name for name in fields})}"
        yield f"valve_restriction = {self.restriction('valve', scenario.device.valve.orifice)}"
        yield f"leak_restriction = {self.restriction('actuator.leak', scenario.device.actuator.leak)}"
        torque = "motion_external_torque" if isinstance(scenario.motion, FreeMotion) else "0.0"
        yield f"plant = {add(plant_with)}(device, valve_restriction, leak_restriction, {torque})"

    def restriction(self, section: str, orifice: Any) -> str:
        """An orifice with the gas, in the form that it has."""
        is_sonic = isinstance(orifice, SonicOrifice)
        names = ("sonic_conductance", "critical_ratio") if is_sonic else ("area", "discharge_coefficient")
        made = self.row("SonicOrifice" if is_sonic else "Orifice", self.section(section, names))
        return f"{self.add(sonic_restriction if is_sonic else area_restriction)}({made}, gas, flow_linear_ratio)"

    def steps(self) -> Iterator[str]:
        """Lines that make the steps, delays in them, and whether the error decides about their parts."""
        scenario, add = self.scenario, self.add
        valve = VALVES[scenario.device.valve.kind]
        names = [item.name for item in valve.quantities]
        yield f"valve_settings = {self.row('ValveSettings', self.section('valve', names))}"
        given = "run_duration, run_step, run_output_interval, controller_period"
        yield f"counts_of_steps = {add(step_counts)}({given})"
        yield "step = counts_of_steps.step"
        yield f"command_delay = {add(self.program.valve.command_delay)}(valve_settings)"
        yield f"command_steps, command_lag = {add(whole_and_rest)}(command_delay, step)"
        yield f"signal_steps, signal_lag = {add(whole_and_rest)}(sensors_delay, step)"
        period = "step * counts_of_steps.steps_per_sample"
        yield f"timing = {add(LaneTiming)}(step, {period}, command_lag, signal_lag, 1.0)"
        if scenario.supply_lines is not None or not self.program.is_held:
            yield "needs_parts = True"
            return
        stiffness = "1.0" if scenario.thermal is None else "gas_heat_capacity_ratio"
        yield f"needs_parts = not {add(is_slow_held)}(plant, step, motion_angle, {stiffness})"

    def pieces(self) -> Iterator[str]:
        """Lines that make the parameters of valve, controller, profiles, sensors, gas and lines."""
        scenario, program, add = self.scenario, self.program, self.add
        yield f"valve = {add(program.valve.prepare)}(valve_settings)"
        if program.controller is not None:
            yield f"controller = {self.kind('controller', CONTROLLERS[scenario.control.kind])}"
        yield f"reference = {self.reference()}"
        if isinstance(scenario.motion, PrescribedMotion):
            held = {"level": "motion_angle"} if program.is_held else {}
            yield f"path = {self.kind('motion.profile', PROFILES[scenario.motion.profile.kind], held)}"
        flaws = self.section("sensors", ["angle_noise", "pressure_noise", "angle_resolution", "pressure_resolution"])
        yield f"sensors = {add(SensorParameters)}({', '.join(flaws.values())}, sensors_seed)"
        if program.slow_sensors:
            yield f"sensor_rates = {add(rates_of_sensors)}(sensors_angle_bandwidth, sensors_pressure_bandwidth)"
        if program.is_thermal:
            walls = {
                "heat_transfer_coefficient": "gas_model_heat_transfer_coefficient",
                "area_per_volume": "gas_model_wall_area_per_volume",
            }
            yield f"thermal = {add(thermal_gas)}({self.row('Walls', walls)}, gas)"
        if scenario.supply_lines is not None:
            of_lines = [
                c_identifier(f"{SECTION}.{line}.{name}")
                for line in LINES
                for name in ("droop", "largest_flow", "volume")
            ]
            yield f"lines = {add(SupplyLines)}({', '.join(of_lines)}, {scenario.supply_lines.relieving!r})"

    def kind(self, section: str, kind: Any, given: Mapping[str, str] | None = None) -> str:
        """Parameters of a controller or profile from its settings, in the order of its quantities."""
        names = self.section(section, [item.name for item in kind.quantities]) | dict(given or {})
        cells = dict(zip(leaf_paths(kind.parameters, section), names.values(), strict=True))
        return row_expression(kind.parameters, section, cells, self.add)

    def reference(self) -> str:
        """The reference; where none is followed, the one that stands in its place."""
        choice = self.scenario.reference
        kind = PROFILES[choice.kind]
        if self.program.has_reference:
            return self.kind("reference", kind)
        return self.kind("reference", kind, {item.name: repr(choice.settings[item.name]) for item in kind.quantities})

    def start(self) -> Iterator[str]:
        """Lines that make the states at the start."""
        program, add = self.program, self.add
        moved = "motion_angle", "motion_angular_velocity"
        if isinstance(self.scenario.motion, PrescribedMotion):
            moved = "angle", "angular_velocity"
            assert program.angle is not None
            yield f"angle, angular_velocity, _ = {add(program.angle.value)}(path, 0.0)"
        given = "initial_pressure_1, initial_pressure_2"
        yield f"state = {add(state_at_start)}(plant, {', '.join(moved)}, {given})"
        yield f"result = {add(LaneResult)}(0.0, {NEVER_FAILED!r}, 0.0)"
        yield f"pace = {add(Pace)}(step)"
        if program.is_thermal:
            yield f"masses = {add(initial_masses)}(state)"
        yield f"valve_state = {add(program.valve.initial)}()"
        if program.controller is not None:
            yield f"controller_state = {self.constant(program.controller.initial, 'controller_state')}"
        if program.has_lines:
            yield f"line_state = {add(lines_at_start)}(plant, lines)"
        if program.slow_sensors:
            yield f"sensor_state = {add(sensors_at_start)}(plant, state)"

    def constant(self, row: Any, path: str) -> str:
        """A NamedTuple of numbers that are known."""
        cells = dict(zip(leaf_paths(type(row), path), map(repr, numbers(row)), strict=True))
        return row_expression(type(row), path, cells, self.add)
