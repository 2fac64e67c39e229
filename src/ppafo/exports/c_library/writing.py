"""How a function from settings to the numbers of a run is written: names of settings, rows, a device and its gas."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, final

from ppafo.constants import UNIVERSAL_GAS_CONSTANT
from ppafo.engine.lane_rows import indent
from ppafo.engine.program import LaneResult, LaneTiming, Program
from ppafo.engine.rows import leaf_paths, numbers, row_expression
from ppafo.engine.run import NEVER_FAILED, initial_masses, whole_and_rest
from ppafo.engine.scheme.parts import Pace
from ppafo.engine.source_text import Collector, woven
from ppafo.exports.c_library.files import Setting, c_identifier
from ppafo.exports.c_library.program import COUNTS
from ppafo.model.actuators.kind import Range, mean_growth, plant_in_shape
from ppafo.model.gas import specific_gas_constant
from ppafo.model.regulator import SupplyLines
from ppafo.model.sensors import SensorParameters
from ppafo.model.valves.catalog import VALVES
from ppafo.parameters.declaration import members
from ppafo.parameters.device import Device, SonicOrifice
from ppafo.parameters.effects import SEEN_BY_EFFECTS
from ppafo.parameters.graph import Graph, Term
from ppafo.parameters.plant import area_restriction, plant_with, sonic_restriction
from ppafo.simulation.preparation import lines_at_start, thermal_gas
from ppafo.simulation.supply_line import LINES, SECTION

ENTRY = '@njit("void(float64[::1], float64[::1], float64[::1], float64[::1])")'
FLAWS = ("angle_noise", "pressure_noise", "angle_resolution", "pressure_resolution")
"""Settings of noise and rounding, in the order of ``SensorParameters``."""


FOLLOWING = '@njit("void(float64[::1], float64[::1])")'


def following_text(settings: Sequence[Setting], links: Graph, collector: Collector) -> str:
    """The composed function ``follow``: settings that still have their default follow others; see ``Graph``."""
    places = {item.path: place for place, item in enumerate(settings)}
    used = {source for found in links.values() for link in found for source in link.sources}
    rows: list[str] = []
    lines = [f"{c_identifier(path)} = settings[{places[path]}]" for path in places if path in used - set(links)]
    for path, found in links.items():
        name, own = c_identifier(path), f"settings[{places[path]}]"
        text = own
        for link in reversed(found):
            number = " + ".join([*(_term(term, rows, collector) for term in link.terms), repr(link.gap)])
            source = places[link.sources[0]]
            is_set = f"settings[{source}] != {settings[source].value!r}"
            text = f"(({number}) if {is_set} else {text})" if link.when_set else f"({number})"
        lines.append(f"{name} = {text} if {own} == {settings[places[path]].value!r} else {own}")
        lines.append(f"followed[{places[path]}] = {name}")
    return "\n".join([*rows, FOLLOWING, "def follow(settings, followed):", *indent(lines)])


def _term(term: Term, rows: list[str], collector: Collector) -> str:
    """A term of what is followed; rows that only it has are added to ``rows``."""
    given = ", ".join(map(c_identifier, term.sources))
    if term.names:
        row = f"Followed{len(rows)}"
        rows.append(f"{row} = namedtuple({row!r}, {list(term.names)!r})")
        given = f"{row}({given})"
    return f"{collector.add(term.function)}({given})"


@final
class Writing:
    """Writes lines for one device and program; what they call is gathered by ``add``."""

    def __init__(self, device: Device, lines: SupplyLines | None, program: Program, collector: Collector) -> None:
        self.device = device
        self.lines = lines
        self.program = program
        self.add: Callable[[Callable[..., Any] | type], str] = collector.add
        self.needs = collector.needs
        self.rows: dict[str, list[str]] = {}

    def text(self, settings: Iterable[Setting], lines: Iterable[str]) -> str:
        """The composed function ``prepare`` of some lines, and the rows that only it has.

        The lines must name every group of rows of the program, ``counts_of_steps``, delays and ``needs_parts``.
        """
        body = [f"{item.name} = settings[{place}]" for place, item in enumerate(settings)]
        body += lines
        for array, rows in {"parameters": self.program.parameter_rows(), "states": self._initial_rows()}.items():
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
        return "\n".join(
            [*own, ENTRY, "def prepare(settings, parameters, states, counts):", *indent(woven(body, self.needs))]
        )

    def _initial_rows(self) -> dict[str, type]:
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

    def constant(self, row: Any, path: str) -> str:
        """A NamedTuple of numbers that are known."""
        cells = dict(zip(leaf_paths(type(row), path), map(repr, numbers(row)), strict=True))
        return row_expression(type(row), path, cells, self.add)

    def kind(self, name: str, kind: Any, given: Iterable[str]) -> str:
        """Parameters of a controller or profile, of numbers in the order of its quantities."""
        cells = dict(zip(leaf_paths(kind.parameters, name), given, strict=True))
        return row_expression(kind.parameters, name, cells, self.add)

    def plant(self, name: str, torque: str) -> Iterator[str]:
        """Lines that make the device and its plant under a name, with an external torque."""
        add = self.add
        kind = self.device.actuator.kind
        fields = {
            section: self.section(section, [item.name for item in members(section, kind)])
            for section in SEEN_BY_EFFECTS
        }
        if self.program.has_shape:
            fields["actuator"] |= {"torque_constant": "0.0", "volume_per_angle": "0.0"}
        constant = f"{add(specific_gas_constant)}({UNIVERSAL_GAS_CONSTANT!r}, gas_molar_mass)"
        fields["gas"] = fields["gas"] | {"specific_gas_constant": constant}
        takes_back = self.device.supply.relieving or self.lines is not None
        fields["supply"] = fields["supply"] | {"relieving": repr(float(takes_back))}
        for section, inner in fields.items():
            yield f"{section} = {self.row(section.title().replace('_', ''), inner)}"
        yield f"device = {self.row('Device', {section: section for section in fields})}"
        yield f"valve_restriction = {self._restriction('valve', self.device.valve.orifice)}"
        yield f"leak_restriction = {self._restriction('actuator.leak', self.device.actuator.leak)}"
        for effect in self.program.effects:
            own = self.section(effect.section, [item.name for item in effect.quantities])
            settings = self.row(f"{effect.name.title().replace('_', '')}Settings", own)
            yield f"{effect.name} = {add(effect.prepare)}({settings}, device)"
        made = f"vane_{name}" if self.program.has_shape else name
        yield f"{made} = {add(plant_with)}(device, valve_restriction, leak_restriction, {torque})"
        if self.program.has_shape:
            yield from self._shape(made, name)

    def _shape(self, vane: str, name: str) -> Iterator[str]:
        """Lines that make a plant of that of a vane and the actuator's shape; what came from a file is constant."""
        add, actuator, model = self.add, self.device.actuator, self.program.actuator
        settings = self.section("actuator", list(actuator.settings))
        measured = "" if actuator.table is None else f", {self.constant(actuator.table, 'table')}"
        yield f"stops = {add(Range)}({', '.join(self.section('actuator', Range._fields).values())})"
        yield f"shape = {add(model.prepare)}({self.row('ActuatorSettings', settings)}, stops{measured})"
        gauge = f"{vane}.supply_pressure - {vane}.atmospheric_pressure"
        yield f"growth = {add(mean_growth)}(shape, stops, {gauge}, {add(model.chambers)})"
        yield f"{name} = {add(plant_in_shape)}({vane}, shape, growth)"

    def _restriction(self, section: str, orifice: Any) -> str:
        """An orifice with the gas, in the form that it has."""
        is_sonic = isinstance(orifice, SonicOrifice)
        names = ("sonic_conductance", "critical_ratio") if is_sonic else ("area", "discharge_coefficient")
        made = self.row("SonicOrifice" if is_sonic else "Orifice", self.section(section, names))
        return f"{self.add(sonic_restriction if is_sonic else area_restriction)}({made}, gas, flow_linear_ratio)"

    def timing(self, signal_delay: str) -> Iterator[str]:
        """Lines that make the valve, delays in steps, and the timing, once there are ``counts_of_steps``."""
        add, model = self.add, self.program.valve
        names = [item.name for item in VALVES[self.device.valve.kind].quantities]
        yield f"valve_settings = {self.row('ValveSettings', self.section('valve', names))}"
        yield f"valve = {add(model.prepare)}(valve_settings)"
        yield "step = counts_of_steps.step"
        yield f"command_delay = {add(model.command_delay)}(valve_settings)"
        yield f"command_steps, command_lag = {add(whole_and_rest)}(command_delay, step)"
        yield f"signal_steps, signal_lag = {add(whole_and_rest)}({signal_delay}, step)"
        period = "step * counts_of_steps.steps_per_sample"
        yield f"timing = {add(LaneTiming)}(step, {period}, command_lag, signal_lag, 1.0)"

    def gas(self) -> Iterator[str]:
        """Lines that make the noise of the sensors, how the gas takes up heat, and the lines of the supply."""
        add = self.add
        flaws = self.section("sensors", FLAWS)
        yield f"sensors = {add(SensorParameters)}({', '.join(flaws.values())}, sensors_seed)"
        if self.program.is_thermal:
            walls = {
                "heat_transfer_coefficient": "gas_model_heat_transfer_coefficient",
                "area_per_volume": "gas_model_wall_area_per_volume",
            }
            yield f"thermal = {add(thermal_gas)}({self.row('Walls', walls)}, gas)"
        if self.lines is not None:
            of_lines = [
                c_identifier(f"{SECTION}.{line}.{name}")
                for line in LINES
                for name in ("droop", "largest_flow", "volume")
            ]
            yield f"lines = {add(SupplyLines)}({', '.join(of_lines)}, {self.lines.relieving!r})"

    def start(self) -> Iterator[str]:
        """Lines that make the states at the start, once there are ``state`` and ``plant``."""
        program, add = self.program, self.add
        yield f"result = {add(LaneResult)}(0.0, {NEVER_FAILED!r}, 0.0)"
        yield f"pace = {add(Pace)}(step)"
        if program.is_thermal:
            yield f"masses = {add(initial_masses)}(state)"
        yield f"valve_state = {add(program.valve.initial)}()"
        if program.controller is not None:
            yield f"controller_state = {self.constant(program.controller.initial, 'controller_state')}"
        if program.has_lines:
            yield f"line_state = {add(lines_at_start)}(plant, lines)"
