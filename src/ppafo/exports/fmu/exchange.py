"""The plant for model exchange: its states, their slopes and its events in C; a tool of others integrates it.

The slopes are those of the reference solver, with the exact flow functions. Stick, slip and stops are modes; two event
indicators end each. What changes at once does so in events: the valve, and effects between it and its command.
"""

from collections.abc import Mapping
from dataclasses import replace

from ppafo.engine.lane_rows import indent
from ppafo.engine.led_leg import torque_lines
from ppafo.engine.program import Program
from ppafo.engine.reference.right_hand_side import (
    PLANT_UNKNOWNS,
    gas_unknowns,
    slope_lines,
    state_cells,
    state_lines,
    unknowns_before_valve,
)
from ppafo.engine.reference.solver import SLOWEST_REBOUND, Roots, mode_at_rest, roots_at_rest, roots_sliding
from ppafo.engine.rows import leaf_paths
from ppafo.engine.source_text import Collector, woven
from ppafo.errors import ProgramError
from ppafo.exports.c_library.boundary import Boundary
from ppafo.exports.c_library.plant import PlantAlone
from ppafo.exports.c_library.program import Entry
from ppafo.exports.fmu.description import ContinuousState
from ppafo.model.orifice import ExactOrifice
from ppafo.model.places import at_valve, friction_at_rest, rebound
from ppafo.model.plant import PlantParameters, PlantState, chamber_pressures, driving_torque
from ppafo.parameters.device import Device, SonicOrifice

SPEED_MARGIN, STOP_MARGIN, TORQUE_MARGIN = 1.0e-9, 1.0e-10, 1.0e-9
"""How far [rad/s, rad, N m] a mode goes beyond its end until its indicator is 0: no mode begins with one at 0."""
_NAMES = ("angle", "angular_velocity", "content_1", "content_2", "supplied_mass", "vented_mass", "leaked_mass")
_UNITS = ("rad", "rad/s", *["kg"] * 5)
_NOMINALS = (1.0, 10.0, *[1.0e-5] * 5)


def check_exchange(alone: PlantAlone) -> None:
    """Refuse a plant that has no slopes in continuous time. ProgramError."""
    program = alone.library.program.program
    if program.walks:
        raise ProgramError(f"{alone.library.title}: model exchange is for a device on a fixture, not on a walking leg")
    if program.has_lines:
        raise ProgramError(f"{alone.library.title}: model exchange has no [supply_line]; omit the section")


def continuous_states(program: Program) -> tuple[ContinuousState, ...]:
    """What a tool integrates: a valve that moves only in events has none, a led vane neither angle nor rate."""
    said = ("angle of the vane", "its rate", "gas in chamber 1", "gas in chamber 2")
    content = " by its pressure at the temperature of the supply" if program.is_thermal else ""
    plant = [*said[:2], *(f"{text}{content}" for text in said[2:]), "gas from the supply so far"]
    plant += ["gas to the atmosphere so far", "gas leaked from chamber to chamber so far"]
    found = [
        ContinuousState(f"state.{name}", unit, text, nominal, place)
        for place, (name, unit, text, nominal) in enumerate(zip(_NAMES, _UNITS, plant, _NOMINALS, strict=True))
    ]
    for place in range(PLANT_UNKNOWNS, gas_unknowns(program)):
        number = place - PLANT_UNKNOWNS + 1
        found.append(ContinuousState(f"state.mass_{number}", "kg", f"mass of gas in chamber {number}", 1.0e-5, place))
    for place, path in enumerate(state_cells(program), gas_unknowns(program)):
        if place >= unknowns_before_valve(program) and program.valve.shift is None:
            break
        owner, rest = path.replace("_state.", ".", 1).split(".", 1)
        summary = f"{rest} of {owner}".replace("_", " ")
        found.append(ContinuousState(f"state.{owner}.{rest}", "", summary, 1.0, place))
    return tuple(found if program.angle is None else found[2:])


def mode_after(
    plant: PlantParameters, angle: float, angular_velocity: float, torque: float, way: float, thrown_back: float
) -> tuple[float, float, float]:
    """Angle [rad], angular velocity [rad/s] and way of the vane after an event; the way is 1, -1, or 0 at rest.

    ``torque`` drives it [N m], ``thrown_back`` is its velocity [rad/s] were it to meet a stop. Equation (10).
    """
    towards = way
    if way == 0.0 and angular_velocity != 0.0:
        towards = 1.0 if angular_velocity > 0.0 else -1.0
    if towards * angular_velocity > 0.0:
        stop = plant.angle_max if towards > 0.0 else plant.angle_min
        if towards * (stop - angle) > 0.0:
            return angle, angular_velocity, towards
        if towards * thrown_back < -SLOWEST_REBOUND:
            return stop, thrown_back, -towards
        return stop, 0.0, mode_at_rest(plant, stop, torque)
    return angle, 0.0, mode_at_rest(plant, angle, torque)


def indicators(plant: PlantParameters, angle: float, angular_velocity: float, torque: float, way: float) -> Roots:
    """Both event indicators of a mode [N m, or rad/s and rad], positive while it lasts. Equation (10)."""
    if way == 0.0:
        held = roots_at_rest(plant, angle, torque)
        return Roots(held.first + TORQUE_MARGIN, held.second + TORQUE_MARGIN)
    moved = roots_sliding(plant, angle, angular_velocity, way)
    return Roots(moved.first + SPEED_MARGIN, moved.second + STOP_MARGIN)


def exchange_entries(alone: PlantAlone, device: Device) -> tuple[Entry, ...]:
    """The functions of model exchange: ``exchange_slopes``, ``exchange_event``, ``exchange_margins``."""
    program = alone.library.program.program
    given = {"parameters": "parameters", "settings": "settings", "y": "numbers", "found": "numbers"}
    now = {"t": "number", "command": "number", "way": "number"}

    def slopes(collector: Collector, boundary: Boundary) -> str:
        add = collector.add
        orifices = _orifice_lines(device, add(ExactOrifice))
        lines = [*_begin(program, collector, boundary), *orifices, *slope_lines(program, add)]
        lines = [line.replace("slopes[", "found[") for line in lines]
        return _function("exchange_slopes", given | now, lines, collector)

    def margins(collector: Collector, boundary: Boundary) -> str:
        found = f"roots = {collector.add(indicators)}(held, angle, rate, torque, way)"
        lines = [*_begin(program, collector, boundary), *_torque(program, collector), found]
        lines += ["found[0] = roots.first", "found[1] = roots.second"]
        return _function("exchange_margins", given | now, lines, collector)

    def event(collector: Collector, boundary: Boundary) -> str:
        return _function("exchange_event", given | now, _event(program, collector, boundary), collector)

    def masses(collector: Collector, boundary: Boundary) -> str:
        add = collector.add
        assert program.gas.start is not None, "gas that is not ideal has true masses"
        state = f"{add(PlantState)}({', '.join(f'y[{place}]' for place in range(PLANT_UNKNOWNS))})"
        lines = [*_begin(program, collector, boundary), f"masses = {add(program.gas.start)}(plant, {state})"]
        lines += ["found[0] = masses.mass_1", "found[1] = masses.mass_2"]
        return _function("exchange_masses", given | now, lines, collector)

    words = tuple((given | now).values())
    found = [
        Entry(
            "exchange_slopes",
            words,
            "The slopes of all unknowns at a time [s], under the command at the valve.",
            slopes,
        ),
        Entry("exchange_event", words, _EVENT, event),
    ]
    if program.angle is None:
        found.append(Entry("exchange_margins", words, "The event indicators of the mode that the vane is in.", margins))
    if is_real(program):
        found.append(Entry("exchange_masses", words, "The masses of gas that is not ideal in both chambers.", masses))
    return tuple(found)


def is_real(program: Program) -> bool:
    """True for gas that is not ideal, whose masses follow from its contents."""
    return program.has_true_masses and not program.is_thermal


_EVENT = """All that changes at once under a command that has reached the valve.

Found are the command that the valve follows, when it changes by itself next [s], and the way of the vane."""


def exchange_words(alone: PlantAlone) -> dict[str, str]:
    """What is filled in where C keeps the unknowns of a plant."""
    program = alone.library.program.program
    shown = continuous_states(program)
    masses = [f"masses.mass_{number}" for number in (1, 2)]
    paths = [*leaf_paths(PlantState, "state"), *(masses if program.is_thermal else ()), *state_cells(program)]
    members = [_member(path) for path in paths]
    led = [] if program.angle is None else ["angle", "angular_velocity"]
    names = [item.name for item in alone.inputs]
    return {
        "fields": _FIELDS.format(unknowns=len(paths)),
        "unknowns": str(len(paths)),
        "first_state": str(shown[0].place),
        "state_count": str(len(shown)),
        "indicator_count": "0" if led else "2",
        "nominals": ", ".join(repr(item.nominal) for item in shown),
        "from_run": "\n".join(f"    y[{place}] = states->{name};" for place, name in enumerate(members)),
        "to_run": "\n".join(f"    states->{name} = y[{place}];" for place, name in enumerate(members)),
        "led": "\n".join(
            f"    item->now.y[{place}] = item->now.inputs[{names.index(name)}];" for place, name in enumerate(led)
        ),
        "masses": "\n".join(f"    states->{_member(path)} = found[{place}];" for place, path in enumerate(masses))
        if is_real(program)
        else "",
        "find_masses": "    call(item, exchange_masses, found, FOUND, item->now.command);" if is_real(program) else "",
        "margins": "" if led else "    call(item, exchange_margins, found, FOUND, item->now.command);",
    }


def _member(path: str) -> str:
    """A path of a row as C has it: items of a tuple lie in ``item``."""
    return path.replace("[", ".item[")


_FIELDS = """double y[{unknowns}];       /* all unknowns: plant, gas, effects, valve */
    double way;          /* of the vane: 1, -1, 0 at rest */
    double command;      /* that the valve follows */
    double arrived;      /* that has reached it */
    double next;         /* when the valve changes by itself */
    int64_t has_sent;    /* 1 once there was a command */
    double sent;         /* the last one */
    int64_t waiting;     /* commands on their way: */
    double on_the_way[512];
    double arrivals[512];"""


def _begin(program: Program, collector: Collector, boundary: Boundary) -> list[str]:
    """Lines that name parameters and states."""
    rows = program.parameter_rows()
    used = ["plant", *program.gas.parameters, "valve", *(() if program.shank is None else ("load", "shank"))]
    used += [effect.name for effect in program.effects]
    lines = [f"{name} = {boundary.taken('parameters', name, rows, collector.add)}" for name in used]
    rate = "y[1] if way != 0.0 else 0.0" if program.angle is None else "y[1]"
    return [*lines, "angle = y[0]", f"rate = {rate}", *state_lines(program, collector.add)]


def _torque(program: Program, collector: Collector) -> list[str]:
    """Lines that make the torque on the vane and the plant with the friction that holds it at rest."""
    add = collector.add
    friction = f"{add(friction_at_rest)}(plant.static_torque, pressure_1, pressure_2)"
    return [
        f"pressure_1, pressure_2 = {add(chamber_pressures)}(plant, angle, y[2], y[3])",
        *torque_lines(program, add, "t", "angle"),
        f"torque = {add(driving_torque)}(plant, angle, pressure_1, pressure_2) + added",
        f"held = {add(with_friction)}(plant, {friction})",
    ]


def with_friction(plant: PlantParameters, static_torque: float) -> PlantParameters:
    """The plant with another largest friction at rest [N m]."""
    return plant._replace(static_torque=static_torque)


def _event(program: Program, collector: Collector, boundary: Boundary) -> list[str]:
    """Lines of what happens at once, in the order of the reference solver: effects, valve, vane."""
    add = collector.add
    lines = [*_begin(program, collector, boundary), f"follows = {add(at_valve)}(command)"]
    for name, kind in program.stated.items():
        if kind.settle is not None:
            lines.append(f"{name}_state = {add(kind.settle)}({name}, {name}_state, follows)")
    lines += [
        f"valve_state = {add(program.valve.settle)}(valve, valve_state, follows, t)",
        *(f"{cell} = {path}" for path, cell in state_cells(program).items()),
        "found[0] = follows",
        f"found[1] = {add(program.valve.next_event)}(valve, valve_state, follows, t)",
        "found[2] = 0.0",
    ]
    if program.angle is not None:
        return lines
    moved = f"{add(mode_after)}(held, y[0], y[1], torque, way, {add(rebound)}(y[1]))"
    return [*lines, *_torque(program, collector), f"y[0], y[1], found[2] = {moved}"]


def _orifice_lines(device: Device, row: str) -> list[str]:
    """Lines that make both orifices with the exact flow function."""
    lines = []
    for name, section, orifice in (
        ("valve", "valve", device.valve.orifice),
        ("leak", "actuator_leak", device.actuator.leak),
    ):
        is_sonic = isinstance(orifice, SonicOrifice)
        number = f"settings.{section}_critical_ratio" if is_sonic else "settings.gas_heat_capacity_ratio"
        given = f"plant.{name}_conductance, {float(is_sonic)!r}, {number}, settings.flow_linear_ratio"
        lines.append(f"{name}_orifice = {row}({given})")
    return lines


def _function(name: str, parameters: Mapping[str, str], lines: list[str], collector: Collector) -> str:
    return "\n".join([f"def {name}({', '.join(parameters)}):", *indent(woven(lines, collector.needs))])


def with_entries(alone: PlantAlone, device: Device) -> PlantAlone:
    """A plant whose library has the functions of model exchange too. ProgramError where there are none."""
    check_exchange(alone)
    return replace(alone, library=replace(alone.library, entries=exchange_entries(alone, device)))
