"""Preparation in C: numbers of a run from settings, composed for any device, and the needs of a scenario."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, final

from ppafo.constants import UNIVERSAL_GAS_CONSTANT
from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.engine.entries import indent
from ppafo.engine.program import Program
from ppafo.engine.rows import leaf_paths, numbers, row_expression
from ppafo.engine.run import NEVER_FAILED, moment_at_start, whole_and_rest
from ppafo.engine.scheme.motion import Pace
from ppafo.engine.scheme.pneumatics import is_slow
from ppafo.engine.source_text import SourceCollector, composed_lines
from ppafo.engine.step.lane import LaneResult, LaneTiming
from ppafo.exports.c_library.boundary import Boundary
from ppafo.exports.c_library.exported import COUNTS
from ppafo.exports.c_library.files import Relation, Setting, c_identifier
from ppafo.model.actuators.kind import Range, mean_growth
from ppafo.model.catalog import VALVES, device_effects
from ppafo.model.columns import larger, smaller
from ppafo.model.declaration import Quantity, quantities_of
from ppafo.model.gait import ShankSeries
from ppafo.model.gas import specific_gas_constant
from ppafo.model.plant import PlantParameters
from ppafo.model.regulator import SupplyLines
from ppafo.model.sensors import SensorParameters
from ppafo.parameters.building import consistency
from ppafo.parameters.declaration import members
from ppafo.parameters.device import Device, SonicOrifice
from ppafo.parameters.graph import Graph, Term
from ppafo.parameters.plant import SEEN_BY_EFFECTS, area_restriction, effects_of, plant_with, sonic_restriction
from ppafo.simulation.clock import TIMES, step_unless_given, step_with_output, time_texts
from ppafo.simulation.declaration import LOCKED_ANGLE, SUPPLY_LINE, SUPPLY_LINES, THERMAL, gas_settings, value_at
from ppafo.simulation.leg import foot_load, shank_kind, with_load
from ppafo.simulation.numbers import declared_numbers, number_at, other_form, path_of_locked_angle
from ppafo.simulation.plan import (
    relative_tolerance,
    state_with_volumes,
    step_counts,
    thermal_gas,
)
from ppafo.simulation.profiles import TOLERANCE
from ppafo.simulation.scenario import Leg, Scenario, vane_motion
from ppafo.simulation.supply_lines import lines_at_start
from ppafo.units import parse_quantity

FLAWS = ("angle_noise", "pressure_noise", "angle_resolution", "pressure_resolution")
"""Settings of noise and rounding, in the order of ``SensorParameters``."""


def following_text(settings: Sequence[Setting], links: Graph, collector: SourceCollector, boundary: Boundary) -> str:
    """The composed function ``follow``: settings that still have their default follow others; see ``Graph``."""
    places = {setting.path: index for index, setting in enumerate(settings)}

    def cell(array: str, path: str) -> str:
        return boundary.cell(array, places[path], c_identifier(path))

    used = {source for follows in links.values() for link in follows for source in link.sources}
    rows: list[str] = []
    lines = [f"{c_identifier(path)} = {cell('settings', path)}" for path in places if path in used - set(links)]
    for path, follows in links.items():
        name, own = c_identifier(path), cell("settings", path)
        text = own
        # The first link that holds wins, so it is the outermost choice.
        for link in reversed(follows):
            number = " + ".join([*(_term(term, rows, collector) for term in link.terms), repr(link.gap)])
            source = link.sources[0]
            # Compared with the default to the bit: a value that was written again counts as not set.
            is_set = f"{cell('settings', source)} != {settings[places[source]].value!r}"
            text = f"(({number}) if {is_set} else {text})" if link.when_set else f"({number})"
        lines.append(f"{name} = {text} if {own} == {settings[places[path]].value!r} else {own}")
        lines.append(f"{cell('followed', path)} = {name}")
    head = boundary.head("follow", dict.fromkeys(("settings", "followed"), "float64[::1]"))
    return "\n".join([*rows, head, *indent(lines)])


def _term(term: Term, rows: list[str], collector: SourceCollector) -> str:
    """A term of what is followed; structs that only it has are added to ``rows``."""

    def filled(row: type, numbers: Sequence[str]) -> str:
        name = f"Followed{len(rows)}"
        rows.append(f"{name} = namedtuple({name!r}, {[quantity.name for quantity in quantities_of(row)]!r})")
        return f"{name}({', '.join(numbers)})"

    arguments = term.arguments([c_identifier(source) for source in term.sources], filled)
    return f"{collector.add(term.function)}({', '.join(arguments)})"


@final
class Writing:
    """Writes lines for one device and program; what they call is gathered by ``add``."""

    def __init__(self, device: Device, lines: SupplyLines | None, program: Program, collector: SourceCollector) -> None:
        self.device = device
        self.lines = lines
        self.program = program
        self.add = collector.add
        self.needs = collector.needs
        self.rows: dict[str, list[str]] = {}

    def text(self, settings: Iterable[Setting], lines: Iterable[str], boundary: Boundary) -> str:
        """The composed function ``prepare`` of some lines, and the rows that only it has.

        The lines must name every group of rows of the program, ``counts_of_steps``, delays and ``needs_parts``.
        """
        body = [*boundary.named("settings", [setting.name for setting in settings], list(lines))]
        body += boundary.given("parameters", self.program.parameter_rows())
        # Task sequence and meters begin with the first sample.
        later = {"course", *self.program.meter_groups}
        begun = {name: row for name, row in self.program.state_rows().items() if name not in later}
        body += boundary.given("states", begun)
        counted = {
            "interval": "counts_of_steps.record_every",
            "steps": "counts_of_steps.step_count",
            "steps_per_sample": "counts_of_steps.steps_per_sample",
            "signal_delay": "signal_steps",
            "command_delay": "command_steps",
            "needs_parts": "1.0 if needs_parts else 0.0",
        }
        body += [f"{boundary.cell('counts', index, name)} = {counted[name]}" for index, name in enumerate(COUNTS)]
        own = [f"{name} = namedtuple({name!r}, {fields!r})" for name, fields in self.rows.items()]
        head = boundary.head("prepare", dict.fromkeys(("settings", "parameters", "states", "counts"), "float64[::1]"))
        return "\n".join([*own, head, *indent(composed_lines(body, self.needs))])

    def row(self, name: str, fields: Mapping[str, str]) -> str:
        """A row that is made here alone, by its fields."""
        self.rows[name] = list(fields)
        return f"{name}({', '.join(f'{field}={value}' for field, value in fields.items())})" if fields else "()"

    @property
    def stiffness(self) -> str:
        """Stiffness of the gas pressure relative to constant temperature, as an expression."""
        return "gas_heat_capacity_ratio" if self.program.is_thermal else "1.0"

    def section(self, section: str, names: Sequence[str]) -> dict[str, str]:
        """The names in C of some settings of a section, by their own."""
        return {name: c_identifier(f"{section}.{name}") for name in names}

    def constant(self, row: Any, path: str) -> str:
        """A NamedTuple of numbers that are known."""
        cells = dict(zip(leaf_paths(type(row), path), map(repr, numbers(row)), strict=True))
        return row_expression(type(row), path, cells, self.add)

    def kind(self, section: str, kind: Any, known: Mapping[str, str] | None = None) -> str:
        """Parameters of a controller or profile: the settings of a section, some of them ``given`` in other words."""
        numbers = self.section(section, [quantity.name for quantity in kind.quantities]) | dict(known or {})
        cells = dict(zip(leaf_paths(kind.parameters, section), numbers.values(), strict=True))
        return row_expression(kind.parameters, section, cells, self.add)

    def plant(self, name: str, torque: str) -> Iterator[str]:
        """Lines that make the device and its plant under a name, with an external torque."""
        add = self.add
        kind = self.device.actuator.kind
        fields = {
            section: self.section(section, [quantity.name for quantity in members(section, kind)])
            for section in SEEN_BY_EFFECTS
        }
        has_shape = self.program.actuator.shape is not None
        if has_shape:
            # The vane's own numbers have no meaning for another shape; the text that reads them is shared.
            fields["actuator"] |= {"torque_constant": "0.0", "displacement_per_radian": "0.0"}
        constant = f"{add(specific_gas_constant)}({UNIVERSAL_GAS_CONSTANT!r}, gas_molar_mass)"
        fields["gas"] = fields["gas"] | {"specific_gas_constant": constant}
        # Lines have a check valve of their own, so that the valve may push gas back into them.
        is_relieving = self.device.supply.relieving or self.lines is not None
        fields["supply"] = fields["supply"] | {"relieving": repr(float(is_relieving))}
        for section, inner in fields.items():
            yield f"{section} = {self.row(section.title().replace('_', ''), inner)}"
        yield f"device = {self.row('Device', {section: section for section in fields})}"
        yield f"valve_restriction = {self._restriction('valve', self.device.valve.orifice)}"
        yield f"leak_restriction = {self._restriction('actuator.leak', self.device.actuator.leak)}"
        for effect in self.program.effects:
            own = self.section(effect.section, [quantity.name for quantity in effect.quantities])
            if effect.prepare is None:
                yield f"{effect.name} = {add(effect.parameters)}({', '.join(own.values())})"
                continue
            settings = self.row(f"{effect.name.title().replace('_', '')}Settings", own)
            yield f"{effect.name} = {add(effect.prepare)}({settings}, device)"
        made = f"vane_{name}" if has_shape else name
        yield f"{made} = {add(plant_with)}(device, valve_restriction, leak_restriction, {torque})"
        if has_shape:
            yield from self._shape(made, name)

    def _shape(self, vane: str, name: str) -> Iterator[str]:
        """Lines that make a plant from a vane's and the actuator's shape; what came from a file is constant."""
        add, actuator, model = self.add, self.device.actuator, self.program.actuator
        settings = self.section("actuator", list(actuator.settings))
        # A file that the set names is read here, not by the library.
        measured = "" if actuator.table is None else f", {self.constant(actuator.table, 'table')}"
        yield f"stops = {add(Range)}({', '.join(self.section('actuator', Range._fields).values())})"
        yield f"shape = {add(model.prepare)}({self.row('ActuatorSettings', settings)}, stops{measured})"
        # The mean growth is taken at the supply's pressure, at which most of the work is done.
        gauge = f"{vane}.supply_pressure - {vane}.atmospheric_pressure"
        yield f"growth = {add(mean_growth)}(shape, stops, {gauge}, {add(model.chambers)})"
        fields = [
            "growth" if field in ("torque_constant", "displacement_per_radian") else f"{vane}.{field}"
            for field in PlantParameters._fields
        ]
        yield f"{name} = {add(model.plant)}({', '.join(fields)}, shape)"

    def _restriction(self, section: str, orifice: Any) -> str:
        """An orifice with the gas, in the form that it has."""
        # Each form of an orifice has its own settings and its own way to a conductance.
        is_sonic = isinstance(orifice, SonicOrifice)
        names = ("sonic_conductance", "critical_ratio") if is_sonic else ("area", "discharge_coefficient")
        made = self.row("SonicOrifice" if is_sonic else "Orifice", self.section(section, names))
        return f"{self.add(sonic_restriction if is_sonic else area_restriction)}({made}, gas, flow_linear_ratio)"

    def timing(self, signal_delay: str, tolerance: str = "1.0") -> Iterator[str]:
        """Lines that make the valve, delays in steps, and the timing, once there are ``counts_of_steps``."""
        add, model = self.add, self.program.valve
        names = [quantity.name for quantity in VALVES[self.device.valve.kind].quantities]
        yield f"valve_settings = {self.row('ValveSettings', self.section('valve', names))}"
        yield f"valve = {add(model.prepare)}(valve_settings)"
        # The step that the counts found, not the one that was asked for.
        yield "step = counts_of_steps.step"
        yield f"command_delay = {add(model.command_delay)}(valve_settings)"
        yield f"command_steps, command_lag = {add(whole_and_rest)}(command_delay, step)"
        yield f"signal_steps, signal_lag = {add(whole_and_rest)}({signal_delay}, step)"
        period = "step * counts_of_steps.steps_per_sample"
        yield f"timing = {add(LaneTiming)}(step, {period}, command_lag, signal_lag, {tolerance})"

    def gas(self) -> Iterator[str]:
        """Lines that make the noise of the sensors, how the gas takes up heat, and the lines of the supply."""
        add = self.add
        flaws = self.section("sensors", FLAWS)
        yield f"sensors = {add(SensorParameters)}({', '.join(flaws.values())}, sensors_seed)"
        if self.program.is_thermal:
            walls = self.section("gas_model", [quantity.name for quantity in gas_settings(THERMAL)])
            yield f"thermal = {add(thermal_gas)}({self.row('Walls', walls)}, gas)"
        if self.lines is not None:
            # Droop, largest flow and volume, line by line, as the struct of the lines has them.
            of_lines = [
                c_identifier(f"{SUPPLY_LINE}.{line}.{name}")
                for line in SUPPLY_LINES
                for name in ("droop", "largest_flow", "volume")
            ]
            yield f"lines = {add(SupplyLines)}({', '.join(of_lines)}, {self.lines.relieving!r})"

    def start(self) -> Iterator[str]:
        """Lines that make the states at the start, once there are ``state`` and ``plant``."""
        program, add = self.program, self.add
        yield f"result = {add(LaneResult)}(0.0, {NEVER_FAILED!r}, 0.0)"
        yield f"pace = {add(Pace)}(step)"
        if program.gas.START is not None:
            yield f"masses = {add(program.gas.START)}(plant, state)"
        yield f"valve_state = {self.constant(program.valve.initial(), 'valve_state')}"
        if program.controller is not None:
            yield f"controller_state = {self.constant(program.controller.initial, 'controller_state')}"
        if program.feed is not None:
            yield f"line_state = {add(lines_at_start)}(plant, lines)"
        if any(kind.start is not None for kind in program.stated.values()):
            yield f"at_start = {add(moment_at_start)}(plant, state)"
        for name, kind in program.stated.items():
            started = (
                self.constant(kind.row(), f"{name}_state")
                if kind.start is None
                else f"{add(kind.start)}({name}, at_start)"
            )
            yield f"{name}_state = {started}"


SAID = {
    "run.step": "longest step of the engine",
    "run.output_interval": "time from one sample to the next",
    "controller.period": "time between two decisions of the controller",
}
"""Meanings of some settings outside a file."""


def settings_of(scenario: Scenario) -> tuple[Setting, ...]:
    """Every number of a scenario in SI units, under the path that overrides know it by."""
    # The file's step, from which the engine makes one that divides a sample.
    texts = time_texts(scenario)
    duration, period = scenario.run.duration, scenario.controller.period
    step, output = (value_at(texts, f"run.{name}") for name in ("step", "output_interval"))
    if step is not None:
        longest = parse_quantity(str(step), "s")
    elif output is None:
        longest = step_unless_given(duration, period)
    else:
        longest = step_with_output(duration, period, scenario.run.output_interval)
    times = {
        "run.duration": duration,
        "run.step": longest,
        "run.output_interval": scenario.run.output_interval,
        "controller.period": period,
    }
    return tuple(
        Setting(
            c_identifier(path),
            path,
            replace(quantity, summary=SAID.get(path, quantity.summary)),
            times[path] if path in TIMES else number_at(scenario, path),
        )
        for path, quantity in declared_settings(scenario).items()
    )


def relations_of(scenario: Scenario) -> tuple[Relation, ...]:
    """Settings that contradict each other, as they would in a file."""
    rules: list[tuple[str, str, str, float]] = [
        *((path, relation, other, 0.0) for path, relation, other, _ in consistency(scenario.device)),
        ("run.step", "at most", "run.duration", 0.0),
        ("run.output_interval", "at most", "run.duration", 0.0),
        ("sensors.delay", "at most", "run.duration", 0.0),
    ]
    # A vane that stays at an angle, or starts there.
    stays = path_of_locked_angle(scenario) or LOCKED_ANGLE
    if stays in declared_settings(scenario):
        rules.append((stays, "at least", "actuator.angle_min", TOLERANCE))
        rules.append((stays, "at most", "actuator.angle_max", TOLERANCE))
    if scenario.supply_lines is not None:
        rules.append(("supply.dorsiflexion_pressure", "at most", "supply.pressure", 0.0))
    of_steps = (
        Relation("run_step", "at most", longer, TOLERANCE, is_share=True)
        for longer in ("controller_period", "run_output_interval")
    )
    return (
        *(Relation(c_identifier(path), relation, c_identifier(other), slack) for path, relation, other, slack in rules),
        *of_steps,
    )


def declared_settings(scenario: Scenario) -> dict[str, Quantity]:
    """Declarations by path, without the form of an orifice that is not used, effects that are off, second names."""
    device = scenario.device
    unused = {"controller.rate"}
    unused |= {f"{section}.{name}" for section in ("valve", "actuator.leak") for name in other_form(device, section)}
    is_on = effects_of(device)
    unused |= {
        f"{effect.section}.{quantity.name}"
        for effect in device_effects()
        if effect not in is_on
        for quantity in effect.quantities
    }
    return {path: quantity for path, quantity in declared_numbers(scenario).items() if path not in unused}


def preparation_of(scenario: Scenario, program: Program, collector: SourceCollector, boundary: Boundary) -> str:
    """The composed function ``prepare`` of a scenario, once everything it calls is gathered."""
    writing = Writing(scenario.device, scenario.supply_lines, program, collector)
    return writing.text(settings_of(scenario), _lines(scenario, writing), boundary)


def _lines(scenario: Scenario, writing: Writing) -> Iterator[str]:
    """Lines from settings to the numbers of a run; each needs names that lines before it have made."""
    program, add, leg, path = writing.program, writing.add, vane_motion(scenario).leg, writing.program.angle
    torque = "motion_external_torque" if leg is None else "-motion_ankle_torque"
    yield from writing.plant("plant", torque if path is None else "0.0")
    if leg is not None:
        yield from _leg(leg, writing)

    # Steps, delays in them, and whether the error decides about their parts.
    times = "run_duration, run_step, run_output_interval, controller_period"
    yield f"counts_of_steps = {add(step_counts)}({times})"
    yield f"tolerance = {add(relative_tolerance)}(run_tolerance)"
    yield from writing.timing("sensors_delay", "tolerance")
    stays = path_of_locked_angle(scenario)
    level = c_identifier(stays or LOCKED_ANGLE)
    if not program.chooses_parts:
        yield "needs_parts = True"
    else:
        shortened = f"step / {add(smaller)}(1.0, tolerance)"
        within = f"{add(smaller)}({add(larger)}({level}, plant.angle_min), plant.angle_max)"
        room, stiffness = "plant.atmospheric_pressure", writing.stiffness
        yield f"smallest = {add(program.actuator.chambers)}(plant, {within}, {room}, {room})"
        yield f"needs_parts = not {add(is_slow)}(plant, {shortened}, smallest.volume_1, smallest.volume_2, {stiffness})"

    # Controller, reference, prescribed angle and gas.
    if program.controller is not None:
        yield f"controller = {writing.kind('controller', CONTROLLERS[scenario.controller.kind])}"
    profile, settings = PROFILES[scenario.reference.kind], scenario.reference.settings
    # Where no reference is followed, the one that stands in its place is written out.
    known = (
        {}
        if scenario.follows_reference
        else {quantity.name: repr(settings[quantity.name]) for quantity in profile.quantities}
    )
    yield f"reference = {writing.kind('reference', profile, known)}"
    if path is not None:
        held = {} if stays is None else {"level": level}
        yield f"path = {writing.kind('motion.profile', path, held)}"
    yield from writing.gas()

    # The states at the start.
    moved = "motion_angle", "motion_angular_velocity"
    if path is not None:
        moved = "angle", "angular_velocity"
        yield f"angle, angular_velocity, _ = {add(path.value)}(path, 0.0)"
    pressures = "initial_pressure_1, initial_pressure_2"
    yield f"filled = {add(program.actuator.chambers)}(plant, {moved[0]}, {pressures})"
    volumes = "filled.volume_1, filled.volume_2"
    yield f"state = {add(state_with_volumes)}(plant, {', '.join(moved)}, {volumes}, {pressures})"
    yield from writing.start()


def _leg(leg: Leg, writing: Writing) -> Iterator[str]:
    """Lines that put a leg on the plant; of a gait only where it begins is a setting."""
    add = writing.add
    foot = writing.section("motion", ["foot_mass", "foot_mass_centre", "foot_inertia", "shank_length"])
    yield f"load = {add(foot_load)}(plant.inertia, plant.gravity_torque, {', '.join(foot.values())})"
    yield f"plant = {add(with_load)}(plant, load)"
    if leg.curves is None:
        yield f"shank = {writing.kind('motion.shank', shank_kind(leg))}"
        return
    constant = dict(zip(leaf_paths(ShankSeries, "shank"), map(repr, numbers(leg.curves)), strict=True))
    cells = constant | {"shank.start": c_identifier("motion.shank.start"), "shank.toe_lever": "motion_toe_lever"}
    yield f"shank = {row_expression(ShankSeries, 'shank', cells, add)}"
