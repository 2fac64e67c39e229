"""Preparation of a walk in C: one composed function that calls the planning on the settings.

What a gait comes to (series, events, how its heel rolls) and a task sequence in time are numbers written out.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace

from ppafo.control.walking.catalog import walking_controllers
from ppafo.engine.program import Program
from ppafo.engine.source_text import SourceCollector
from ppafo.errors import ScenarioError
from ppafo.exports.c_library.boundary import Boundary
from ppafo.exports.c_library.files import Relation, Setting, c_identifier
from ppafo.exports.c_library.preparation import SAID, Writing, declared_settings
from ppafo.model.declaration import Quantity
from ppafo.model.gait import gait_at
from ppafo.model.sensors import NOTHING_SEEN
from ppafo.model.shut_off import NEVER, POWERED
from ppafo.parameters.building import consistency
from ppafo.parameters.graph import Follows, Graph, Term, holding
from ppafo.simulation.declaration import RUN, SUPPLY_LINES
from ppafo.simulation.numbers import device_numbers, number_at
from ppafo.simulation.profiles import profile_parameters
from ppafo.simulation.scenario import Scenario
from ppafo.walking.contradictions import PAIRS
from ppafo.walking.declaration import PERSON, STEP, fault_numbers
from ppafo.walking.gait_series import fit_rocker, gait_series, gait_timing
from ppafo.walking.motion import record_interval, walk_of
from ppafo.walking.planning import NO_REFERENCE, failing_of, law_of, task_sequence_of_walk
from ppafo.walking.preparation import (
    DISTORTED,
    DISTORTING,
    FROZEN,
    HIGHEST_ANGLE,
    LOWEST_ANGLE,
    device_share,
    distorting_fault,
    fixed_fault,
    gait_sensors,
    longest_delay,
    rocker_on_heel,
    smallest_chamber,
    standing_on,
    vented_state,
    walk_from_standing,
    walk_from_strike,
    walk_step_counts,
    with_leg,
)
from ppafo.walking.task_sequence import flat_foot
from ppafo.walking.wearer import WEARER, leg_parameters

_FORCES = ("force_bandwidth", "force_noise", "force_resolution", "lost_share")
_OTHERS = ("angle_bandwidth", "pressure_bandwidth", "angle_lost_share", "pressure_lost_share")
_RELATIONS = (
    *((pair.path, pair.relation, pair.other) for pair in PAIRS),
    ("controller.swing_angle", "above", "controller.lowest_angle"),
    ("controller.swing_angle", "below", "controller.highest_angle"),
    ("controller.swing_angle", "above", "actuator.angle_min"),
    ("controller.swing_angle", "below", "actuator.angle_max"),
    ("controller.lowest_pressure", "below", "supply.atmospheric_pressure"),
    ("controller.filled_pressure", "above", "supply.atmospheric_pressure"),
    ("controller.filled_pressure", "below", "supply.pressure"),
    ("controller.filled_pressure", "below", "supply.dorsiflexion_pressure"),
)
"""Contradictions of a walk file between two numbers; those with a third, or with the gait, are left to the caller."""


def check_can_leave(configuration: Scenario) -> None:
    """Raise ScenarioError for a walk that has no exported form."""
    if walk_of(configuration).person:
        raise ScenarioError(
            f"{configuration.name}: wearer.person is drawn in Python, so a walk with one cannot be exported: leave it "
            "out"
        )
    if walk_of(configuration).bottle is not None:
        raise ScenarioError(
            f"{configuration.name}: a walk on a bottle cannot be exported: bottle and device are advanced in "
            "alternation, in Python; leave the bottle out, or give it lines with [supply_line]"
        )


def settings_of_walk(configuration: Scenario) -> tuple[Setting, ...]:
    """Every number of a walk in SI units, under the path that overrides know it by."""
    run, control = configuration.run, _control(configuration)
    of_run = {"run.duration": run.duration, "run.step": run.step, "run.output_interval": record_interval(run.duration)}
    times = of_run | {"controller.period": configuration.controller.period}
    declared = (
        declared_settings(configuration) | control | {f"run.{quantity.name}": quantity for quantity in (*RUN, STEP)}
    )
    # What fails of the plant, with its shut-off valve, is written out in the source; persons are drawn in Python.
    fixed = ("shut_off.", *(f"faults.{part}." for part in walk_of(configuration).broken), f"wearer.{PERSON.name}")
    # The structures of libraries have the times behind the device.
    wearer = (f"wearer.{quantity.name}" for quantity in (*WEARER, PERSON))
    paths = dict.fromkeys((*device_numbers(configuration.device), *of_run, *wearer, *times, *control, *declared))
    return tuple(
        Setting(
            c_identifier(path),
            path,
            replace(declared[path], summary=SAID.get(path, declared[path].summary)),
            times[path] if path in times else number_at(configuration, path),
        )
        for path in paths
        if path in declared and not path.startswith(fixed)
    )


def _control(configuration: Scenario) -> dict[str, Quantity]:
    """Settings of controller and timing by path, in the order of the controller's parameters."""
    control = law_of(configuration)
    law = walking_controllers().get(configuration.controller.kind, control)
    own = {quantity.name for quantity in law.quantities}
    return {
        f"{'controller' if quantity.name in own else 'timing'}.{quantity.name}": quantity
        for quantity in control.quantities
    }


def links_of_walk(configuration: Scenario) -> Graph:
    """Settings of a walk that follow others as long as nobody changes them."""
    known = {setting.path: setting.value for setting in settings_of_walk(configuration)}
    recorded = {"run.output_interval": (Follows((Term(("run.duration",), record_interval),)),)}
    # A plant alone has no settings of the controller that its walk had.
    links = {path: links for path, links in {**configuration.graph, **recorded}.items() if path in known}
    return holding(links, known)


def relations_of_walk(configuration: Scenario) -> tuple[Relation, ...]:
    """Settings that contradict each other, as they would in a file."""
    rules = [(path, relation, other) for path, relation, other, _ in consistency(configuration.device)]
    if configuration.supply_lines is not None:
        rules.append(("supply.dorsiflexion_pressure", "at most", "supply.pressure"))
    rules += _RELATIONS
    known = {setting.path for setting in settings_of_walk(configuration)}
    return tuple(
        Relation(c_identifier(path), relation, c_identifier(other))
        for path, relation, other in rules
        if path in known and other in known
    )


def preparation_of_walk(
    configuration: Scenario, program: Program, collector: SourceCollector, boundary: Boundary
) -> str:
    """The composed function ``prepare`` of a walk, once everything it calls is gathered."""
    writing = Writing(configuration.device, configuration.supply_lines, program, collector)
    return writing.text(settings_of_walk(configuration), _lines(configuration, writing), boundary)


def _lines(configuration: Scenario, writing: Writing) -> Iterator[str]:
    """Lines from settings to the numbers of a run; each needs names that lines before it have made."""
    add = writing.add
    yield from writing.plant("bare", "0.0")
    yield from _leg(configuration, writing)

    # Sensors with their faults, and the longest time by which one is late.
    faults = walk_of(configuration).faults
    for sensor, fault in faults.items():
        names = writing.section(f"faults.{sensor}", [quantity.name for quantity in fault_numbers(sensor, fault.kind)])
        yield f"{sensor}_fault = {_fault(writing, fault.kind, names)}"
    row = writing.row("SensorNumbers", writing.section("sensors", (*_FORCES, *_OTHERS)))
    failing_sensors = ", ".join(f"{sensor}_fault" for sensor in faults)
    yield f"gait_sensors = {add(gait_sensors)}({row}, controller_period, {failing_sensors})"
    yield f"signal_delay = {add(longest_delay)}(gait_sensors) * controller_period"

    # What fails of the plant and the shut-off valve, numbers written out.
    failing = failing_of(configuration)
    if failing is not None:
        yield f"plant_faults = {writing.constant(failing[0], 'plant_faults')}"
        yield f"shut_off = {writing.constant(failing[1], 'shut_off')}"
        yield f"unpowered = {writing.constant(POWERED, 'unpowered')}"

    # Steps: the smallest volume limits them, and adiabatic gas, which is stiffer by the heat capacity ratio.
    yield "room = plant.atmospheric_pressure"
    filled = add(writing.program.actuator.chambers)
    ends = (f"{filled}(plant, {angle!r}, room, room)" for angle in (LOWEST_ANGLE, HIGHEST_ANGLE))
    yield f"volume = {add(smallest_chamber)}({', '.join(ends)})"
    if configuration.supply_lines is not None:
        volumes = (c_identifier(f"supply_line.{line}.volume") for line in SUPPLY_LINES)
        yield f"volume = min(volume, {', '.join(volumes)})"
    times = "run_duration, run_step, run_output_interval, controller_period"
    yield f"counts_of_steps = {add(walk_step_counts)}({times}, plant, volume, {writing.stiffness})"
    yield "needs_parts = False"
    yield from writing.timing("signal_delay")

    # Controller, gas and task sequence.
    settings = {quantity.name: c_identifier(path) for path, quantity in _control(configuration).items()}
    yield f"controller = {writing.kind('controller', law_of(configuration), settings)}"
    yield f"reference = {writing.constant(profile_parameters(NO_REFERENCE), 'reference')}"
    yield from writing.gas()
    planned = task_sequence_of_walk(configuration)
    if planned is not None:
        yield f"task_sequence = {writing.constant(planned.timed, 'task_sequence')}"

    yield from _start(configuration, writing)
    yield from writing.start()


def _leg(configuration: Scenario, writing: Writing) -> Iterator[str]:
    """Lines that make the leg, the gait on it, and the plant with both."""
    # The rocker is fitted to the gait here: a fit has no place in a library.
    add, fit = writing.add, fit_rocker(walk_of(configuration).gait)
    yield f"wearer = {writing.row('Wearer', writing.section('wearer', [quantity.name for quantity in WEARER]))}"
    fitted = ", ".join(map(repr, fit))
    yield f"rocker = {add(rocker_on_heel)}({fitted}, wearer_heel_lever)"
    yield f"leg = {add(leg_parameters)}(wearer, rocker)"
    yield f"share = {add(device_share)}(bare, leg.gravity)"
    yield f"plant = {add(with_leg)}(bare, leg)"
    yield f"gait = {writing.constant(gait_series(walk_of(configuration).gait), 'gait')}"
    yield f"gait_timing = {writing.constant(gait_timing(walk_of(configuration).gait), 'gait_timing')}"


def _fault(writing: Writing, kind: str, names: Mapping[str, str]) -> str:
    """A fault of a sensor from its settings, or none."""
    if not kind:
        # A sensor without a fault has one that never begins, so that one program serves both.
        return f"{writing.add(fixed_fault)}({NEVER!r}, 0.0, 0.0, 0.0)"
    if kind != DISTORTED:
        # A frozen sensor keeps its last value; the other kinds show a reading of their own.
        holds = 1.0 if kind == FROZEN else 0.0
        reading = names.get("reading", "0.0")
        return f"{writing.add(fixed_fault)}({names['time']}, {holds!r}, {reading}, {names['period']})"
    numbers = ", ".join(names.get(name, "0.0") for name in DISTORTING)
    return f"{writing.add(distorting_fault)}({numbers}, controller_period)"


def _start(configuration: Scenario, writing: Writing) -> Iterator[str]:
    """Lines that make the states at the start: at a heel strike, or standing where there is a task sequence."""
    add, planned = writing.add, task_sequence_of_walk(configuration)
    if planned is None:
        yield f"walk = {add(walk_from_strike)}({add(gait_at)}(gait, gait_timing, leg, 0.0))"
    else:
        first = planned.timed.parts[0]
        sine, cosine = map(float, flat_foot(gait_timing(walk_of(configuration).gait)))
        numbers = f"leg, gait_timing.ground_angle, {sine!r}, {cosine!r}, {first.turns!r}, {first.load!r}"
        yield f"walk = {add(walk_from_standing)}({add(standing_on)}({numbers}))"
    yield f"gait_seen = {writing.constant(NOTHING_SEEN, 'gait_seen')}"
    filled = f"{add(writing.program.actuator.chambers)}(plant, walk.now.ankle, room, room)"
    yield f"state = {add(vented_state)}(plant, {filled}, walk.now.ankle, walk.now.ankle_rate)"
