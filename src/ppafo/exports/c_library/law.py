"""Export of the law of a scenario or walk alone: a state passed by the caller, its settings, and one function a sample.

The plant is not in it. Its numbers that the law needs stand in the C as constants: those of a torque computed from
angle and pressures, and those of a valve whose command depends on the pressures.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from ppafo.control.kind import ControllerKind
from ppafo.engine.entries import HEADER, INLINE, indent
from ppafo.engine.lanes import Batch, LaneBlock, effort_for, load_program
from ppafo.engine.linking import link_program
from ppafo.engine.rows import leaf_paths, leaves, row_expression, row_numbers
from ppafo.engine.run import batch_of
from ppafo.engine.source_text import SourceCollector, composed_lines
from ppafo.errors import ProgramError
from ppafo.exports.c_library import check_law
from ppafo.exports.c_library.files import library_files, members_of
from ppafo.exports.c_library.library import ExportedProgram, Library, LibraryApi, c_identifier
from ppafo.exports.c_library.plant import Drive, Input, PlantAlone
from ppafo.exports.c_library.program import readable_c, struct_of_numbers
from ppafo.exports.c_library.settings import settings_of
from ppafo.model.ports import sent_command
from ppafo.model.sensors import GaitMeasurement, Measurement
from ppafo.simulation.plan import plan_run
from ppafo.simulation.python_controller import SampledRun, parameter_group
from ppafo.simulation.scenario import PYTHON_CONTROLLER, Control, Scenario, with_control
from ppafo.translation.value_types import FLOAT

PERIOD = "controller.period"
"""Path of the setting for the time between two samples."""
COMMAND = "last_command"
"""Member of the state in C that holds the command of the last sample."""
MOST_SAMPLES = 3000
"""Largest number of samples in the table of a run for comparison."""
_MEASURED = {
    "angle": ("rad", "angle of the joint, 90 deg neutral, growing in plantarflexion"),
    "pressure_1": ("Pa", "absolute pressure in chamber 1"),
    "pressure_2": ("Pa", "absolute pressure in chamber 2"),
    "torque": ("N m", "torque of the actuator, measured, or by observe() from angle and pressures"),
    "heel_force": ("N", "force under the heel"),
    "toe_force": ("N", "force under the toes"),
}
"""Unit and meaning of each number of a measurement."""
_REFERENCE = Input("reference", "-", "what is wanted, in SI units; a walking law requests its torque itself", 0.0)


@dataclass(frozen=True, slots=True)
class _LawText:
    """Law of one batch as text: numbers of the plant as constants, settings and state as members of structs."""

    batch: Batch
    law: ControllerKind

    @property
    def measured(self) -> Any:
        """Class of a measurement."""
        return GaitMeasurement if self.batch.program.walks else Measurement

    @property
    def states(self) -> dict[str, str]:
        """Names of the state in C, by path."""
        return {path: c_identifier(path) for path in leaf_paths(type(self.law.initial), "")}

    def constant(self, name: str, collector: SourceCollector) -> str:
        """Return the text of a group of parameters with its numbers. Raises ProgramError for a group of states."""
        row = self.batch.program.parameter_rows().get(name)
        if row is None:
            raise ProgramError(f"the law reads '{name}', a state of the plant, and cannot be exported alone")
        numbers = map(repr, leaves(parameter_group(self.batch, name)))
        return row_expression(row, name, dict(zip(leaf_paths(row, name), numbers, strict=True)), collector.add)

    def __call__(self, library: Library, title: str, around: str) -> str:
        """Return the C functions ``decide`` and ``observe`` for a library; ``around`` declares their structs."""
        program = self.batch.program
        collector = SourceCollector(INLINE)
        link_program(program, collector.replacements)
        torque = collector.add(program.actuator.torque)
        seen = "measurement.angle, measurement.pressure_1, measurement.pressure_2"
        observed = [f"measurement.torque = {torque}({self.constant('plant', collector)}, {seen})"]
        entries = [self._decide(collector), self._entry("observe(measurement)", observed, collector)]
        composed = "\n\n".join([HEADER, collector.text(), *entries, ""])
        name = library.name
        settings = struct_of_numbers(f"{name}_settings", [setting.name for setting in library.settings])
        state = struct_of_numbers(f"{name}_state", [*self.states.values(), COMMAND])
        measurement = struct_of_numbers(f"{name}_measurement", self.measured._fields)
        types = {"decide": (settings, state, FLOAT, measurement), "observe": (measurement,)}
        return readable_c(library, collector, composed, types, (settings, state, measurement), title, around)

    def _decide(self, collector: SourceCollector) -> str:
        """Return the source of a sample, as ``engine.step.sample.control`` takes it."""
        program = self.batch.program
        law = self.law
        settings = (f"settings.{c_identifier(f'controller.{quantity.name}')}" for quantity in law.quantities)
        of_settings = dict(zip(leaf_paths(law.parameters, "controller"), settings, strict=True))
        of_state = {f"state{path}": f"state.{name}" for path, name in self.states.items()}
        parameters = row_expression(law.parameters, "controller", of_settings, collector.add)
        state = row_expression(type(law.initial), "state", of_state, collector.add)
        numbers = ", ".join(f"measurement.{name}" for name in self.measured._fields)
        seen = f"{collector.add(self.measured)}({numbers})"
        period = f"settings.{c_identifier(PERIOD)}"
        update = collector.add(law.update)
        lines = [f"command, after = {update}({parameters}, {state}, reference, {seen}, {period})"]
        if program.valve.command_for is not None and program.has_reference:
            command_for = collector.add(program.valve.command_for)
            valve = self.constant("valve", collector)
            lines += [f"command = {command_for}({valve}, command, measurement.pressure_1, measurement.pressure_2)"]
        if program.inverts_valve:
            lines += [f"command = {collector.add(sent_command)}(command)"]
        lines += [f"state.{name} = after{path}" for path, name in self.states.items()]
        lines += [f"state.{COMMAND} = command"]
        return self._entry("decide(settings, state, reference, measurement)", lines, collector)

    def _entry(self, head: str, lines: list[str], collector: SourceCollector) -> str:
        """Return a function whose calls get the constants of effects that they need."""
        passed = composed_lines(lines, collector.needs)
        needed = dict.fromkeys(name for names in collector.needs.values() for name in names)
        constants = [f"{name} = {self.constant(name, collector)}" for name in needed]
        return "\n".join([f"def {head}:", *indent([*constants, *passed])])


def law_of(scenario: Scenario) -> PlantAlone:
    """Return the law of a scenario or a walk, stepped from outside by reference and measurement.

    Raises ProgramError for a controller that is a Python object or in fixed point.
    """
    check_law(scenario)
    batch = batch_of(plan_run(scenario))
    law = batch.program.controller
    assert law is not None, "a law decides"
    text = _LawText(batch, law)
    # The samples of the engine, whose period is a whole number of its steps.
    period = parameter_group(batch, "timing").period
    recorded = scenario.run.output_interval
    settings = tuple(
        replace(setting, value=period) if setting.path == PERIOD else setting
        for setting in settings_of(scenario, recorded if batch.program.walks else None)
        if setting.path.startswith("controller.")
    )
    inputs = tuple(Input(name, *_MEASURED[name], 0.0) for name in text.measured._fields)
    start = dict(zip(text.states.values(), leaves(law.initial), strict=True)) | {COMMAND: 0.0}
    api = LibraryApi("law.h", "law_main.c", "law_README.md", ("law.c",), {}, "law_check.c", text)
    library = Library(
        title=f"{scenario.name}-law",
        description=f"Law without plant, {law.name}, of this scenario: {' '.join(scenario.description.split())}",
        program=ExportedProgram(replace(batch.program, meters=(), traced=("command",)), ()),
        settings=settings,
        joint=scenario.device.joint,
        actuator=scenario.device.actuator.kind,
    )
    name = library.name
    words = {
        "law": f"{law.name}: {law.summary}",
        "source": law.source,
        "measurement": members_of((item.name, item.unit, library.worded(item.summary)) for item in inputs),
        "state": members_of((member, "", "0 before the first sample") for member in start),
        "reset": "\n".join(f"    state->{member} = {value!r};" for member, value in start.items()),
        "columns": str(len(inputs) + 3),
        "read": "\n".join(
            f"        measurement.{item.name} = values[{place}];" for place, item in enumerate(inputs, 2)
        ),
        "keep": "\n".join(f"    run->measurement.{item.name} = {item.name};" for item in inputs),
        "arguments": ", ".join(f"double {item.name}" for item in (_REFERENCE, *inputs)),
    }
    drive = Drive(f"The law of {name} takes a sample every <code>{PERIOD}</code>.", _REFERENCE, inputs, steps=PERIOD)
    library = replace(library, api=replace(api, words=words))
    return PlantAlone(library, drive, frozenset(), period)


def law_library(scenario: Scenario) -> dict[str, bytes]:
    """Return the C files of a law by name, with samples of the run of the scenario for comparison."""
    return {**library_files(law_of(scenario).library), "expected.csv": samples_csv(scenario, 0)}


def samples_csv(scenario: Scenario, late: int) -> bytes:
    """Return reference, measurement and command of the samples of a run as CSV in SI units with 17 digits.

    The time is that of the sample, or ``late`` periods after it.
    """
    rows = list(_samples(scenario, late))
    names = ("time", "reference", *rows[0][2]._fields, "command")
    lines = (",".join(f"{number:.17g}" for number in leaves(row)) for row in rows)
    return "\n".join([",".join(names), *lines, ""]).encode()


def _samples(scenario: Scenario, late: int) -> Iterator[tuple[float, float, Any, float]]:
    """Yield time, reference, measurement and command of each sample of the compiled run.

    The same run, with these commands from outside, tells the measurements.
    """
    batch = batch_of(plan_run(scenario))
    program = batch.program
    command_row = row_numbers(program.state_rows())["result.command"]
    block = LaneBlock(load_program(program, effort_for(batch)), program, batch.clock, batch.parameters, batch.states)
    outside = with_control(scenario, Control(PYTHON_CONTROLLER, {}, scenario.controller.period))
    sampled = SampledRun(batch_of(plan_run(outside)))
    period = parameter_group(batch, "timing").period
    for sample in range(min(sampled.samples, MOST_SAMPLES)):
        measurement = sampled.measurement()
        reference = sampled.reference
        remaining = batch.clock.step_count - sample * batch.clock.steps_per_sample
        block.advance(min(batch.clock.steps_per_sample, remaining))
        command = float(block.states[command_row, 0])
        yield (sample + late) * period, reference, measurement, command
        sampled.advance(command)
