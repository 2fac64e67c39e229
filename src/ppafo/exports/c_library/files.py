"""The files of an exported library: header, source, example, make files, licence and a page on how to use it."""

import itertools
import math
import re
import sys
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

from ppafo.engine.lanes import SIGNAL_ROWS
from ppafo.engine.run import NEVER_FAILED
from ppafo.engine.step.lane import SAME_MOMENT
from ppafo.exports import filled, in_comment, in_markdown, template
from ppafo.exports.c_library.exported import ExportedProgram, Further
from ppafo.metrics import METRICS
from ppafo.model.catalog import VALVES
from ppafo.model.controlled import CONTROLLED
from ppafo.model.declaration import Quantity
from ppafo.parameters.device import Device, SonicOrifice
from ppafo.parameters.graph import Graph
from ppafo.parameters.plant import effects_of
from ppafo.simulation.scenario import Scenario, vane_motion
from ppafo.version import __version__

if TYPE_CHECKING:
    from ppafo.gait import Gait
    from ppafo.walking.preparation import FaultSettings
    from ppafo.walking.task_sequence import TaskSequence


_FOLDER = "ppafo.exports.c_library"
"""The package whose templates these are."""

OUTPUTS = {
    "angle": ("rad", "angle of the vane"),
    "angular_velocity": ("rad/s", "its rate"),
    "pressure_1": ("Pa", "pressure in chamber 1, absolute"),
    "pressure_2": ("Pa", "pressure in chamber 2, absolute"),
    "torque": ("N m", "torque of the actuator, above 0 turns the toes down"),
    "command": ("-", "command to the valve, -1 to 1"),
    **{kind.reference: (kind.unit, f"requested {kind.words}") for kind in CONTROLLED.values()},
    "temperature_1": ("K", "temperature in chamber 1"),
    "temperature_2": ("K", "temperature in chamber 2"),
    "mass_1": ("kg", "gas in chamber 1"),
    "mass_2": ("kg", "gas in chamber 2"),
    "supplied_mass": ("kg", "gas from the supply so far"),
    "vented_mass": ("kg", "gas to the atmosphere so far"),
    "leaked_mass": ("kg", "gas leaked from chamber to chamber so far"),
    "strides": ("-", "heel strikes so far"),
    "phase": ("-", "gait phase, 0 at heel strike, in turns"),
    "contact": ("-", "where the foot stands: 0 swing, 1 heel, 2 flat, 3 toes"),
    "shank_angle": ("rad", "shank from the vertical, above 0 with the ankle before the knee"),
    "healthy_angle": ("rad", "angle of the healthy ankle of this gait"),
    "external_torque": ("N m", "torque T_ex of the device on the wearer"),
    "heel_force": ("N", "force under the heel, as the sensor shows it without faults"),
    "toe_force": ("N", "force under the toes, likewise"),
    "positive_push_off_work": ("J", "positive work of T_ex while the foot rolls over the toes, so far"),
    "net_push_off_work": ("J", "net work of T_ex while the foot rolls over the toes, so far"),
    "controller_phase": ("-", "phase that the controller sees: 0 swing, 1 landing, 2 mid-stance, 3 push-off"),
    "safe_state": ("-", "0 the controller helps, 1 lifts only, 2 pauses, 3 has stopped"),
    "gait_fraction": ("-", "gait phase that the controller goes by, in turns"),
}
"""Unit and meaning of the outputs at each sample."""
SAME_METRIC = 1.0e-12
"""Difference of a metric in C from Python's, as a share of it: sums are rounded in another order."""
UNITS = {"1": "-", "Pa_a": "Pa, absolute", "Pa_d": "Pa, a difference"}
_SIGNS = {"below": "<", "at most": "<=", "at least": ">=", "above": ">"}
_FILES = {"Makefile": "Makefile", "CMakeLists.txt": "CMakeLists.txt", "check.c": "check.c"}
"""Templates of files that every library has, and what they are called in it."""


_OWN_FILES = {"main", "expected", "unit", "plugin", "fmi2", "fmi3", "makefile", "readme", "license"}
_OWN_TARGETS = {"all", "check", "clean", "test"}
_OF_BOARDS = {"board", "board_simulated", "start_cortex"}
_OF_CMAKE = {"help", "install", "package", "m"}
_WITH_ANOTHER_END = {"prepare", "prepared", "is", "begin", "ppafo_whole", "at_result", "at_step_aside_result"}
"""Names that become another function or type with ``_run``, ``_size`` or ``_TOO_MANY_PARTS`` behind them."""
_OF_WINDOWS = {"con", "aux", "nul", "prn"}
_HEADERS_1 = {"assert", "complex", "ctype", "errno", "fenv", "float", "inttypes", "iso646", "limits", "locale", "math"}
_HEADERS_2 = {"setjmp", "signal", "stdarg", "stdbool", "stddef", "stdint", "stdio", "stdlib", "string", "tgmath"}
_OF_C = _HEADERS_1 | _HEADERS_2 | {"time", "wchar", "wctype"}
_TAKEN = _OWN_FILES | _OWN_TARGETS | _OF_BOARDS | _OF_CMAKE | _OF_WINDOWS | _OF_C | _WITH_ANOTHER_END
"""Names that a library cannot have: of its other files and types, of targets in make files, of headers of C."""


@dataclass(frozen=True, slots=True)
class ExportParameter:
    """Something that can be chosen before a run: its name in C and in ppafo, what it is, and what the scenario has."""

    name: str
    path: str
    quantity: Quantity
    value: float


@dataclass(frozen=True, slots=True)
class Relation:
    """A setting that must be ``below``, ``at most``, ``at least`` or ``above`` another, but for a ``tolerance``.

    The tolerance is in the unit of both, or a share of the other where it ``is_share``.
    """

    name: str
    relation: str
    other: str
    tolerance: float = 0.0
    is_share: bool = False


Rule = tuple[str, str, tuple[str, ...]]
"""A rule of settings: the setting that is named, the condition as text in C, the settings that it holds in order."""


@dataclass(frozen=True, slots=True)
class SwitchedSettings:
    """Settings of which any ``is_above`` 0, or none: the other case is another program."""

    names: tuple[str, ...]
    is_above: bool


@dataclass(frozen=True, slots=True)
class LibraryApi:
    """API variant of an exported library: header, example, README and source templates; ``words`` fill them.

    The settings ``as_step`` are ``step`` whatever they are.
    """

    header: str
    main: str
    page: str
    source: str
    words: Mapping[str, str] = field(default_factory=dict)
    step: str = ""
    as_step: tuple[str, ...] = ()


LOOP = LibraryApi("interface.h", "main.c", "README.md", "loop.c")
"""The closed loop, which goes from sample to sample."""


@dataclass(frozen=True, slots=True)
class Library:
    """Library to be written: program, parameters, outputs, metrics and texts.

    ``further`` adds the function that makes the numbers of a run from the settings. ``switches`` choose the program,
    ``other_program`` has further conditions in C under which another would be needed, with the setting that is named;
    ``rules`` are between its times, as in a file. ``following`` adds the function that lets settings follow others,
    None where none does, and ``defaults`` names the settings whose default does so, which has no range; ``links`` say
    what follows what. ``words`` fill the page. ``surface`` is how it is called.
    """

    title: str
    description: str
    program: ExportedProgram
    settings: tuple[ExportParameter, ...]
    relations: tuple[Relation, ...]
    switches: tuple[SwitchedSettings, ...]
    other_program: tuple[tuple[str, str], ...]
    words: Mapping[str, str]
    further: Further | None = None
    following: Further | None = None
    defaults: frozenset[str] = frozenset()
    links: Graph = field(default_factory=dict)
    surface: LibraryApi = LOOP
    rules: tuple[Rule, ...] = ()

    @property
    def name(self) -> str:
        """Name of the library in C, and of its files."""
        name = c_identifier(self.title)
        # A scenario may be called "main" or "math"; C, make and the board's files already are.
        return f"run_{name}" if name in _TAKEN else name


def c_identifier(name: str) -> str:
    """Return a name as C can have it."""
    # A name in C begins with a letter here: those that begin with an underscore belong to compilers.
    identifier = re.sub(r"[^A-Za-z0-9]+", "_", name).strip("_").lower()
    return identifier if identifier[:1].isalpha() else f"run_{identifier}"


def library_files(library: Library) -> dict[str, bytes]:
    """All files of a library by name."""
    from ppafo.exports.c_library.program import c_text_of_run  # a page needs to know of what, not the text

    name, program = library.name, library.program
    words = _words(library, name)
    surface = library.surface
    sources = {surface.header: f"{name}.h", surface.main: "main.c", surface.page: "README.md", **_FILES}
    texts = {target: filled(template(_FOLDER, source), words) for source, target in sources.items()}
    texts["LICENSE"] = template(_FOLDER, "LICENSE")
    head = f'#include "{name}.h"\n\n#include <string.h>\n\n'
    title = f"{library.title}: the functions of ppafo {__version__} that a run is made of. Not to be edited."
    further = [add for add in (library.further, library.following) if add is not None]
    settings = [setting.name for setting in library.settings]
    # The interface is written around the functions, whose names must not hide its own.
    interface = "".join(filled(template(_FOLDER, file), words) for file in ("interface.c", surface.source))
    functions = c_text_of_run(program, title, name, settings, further, interface)
    texts[f"{name}.c"] = f"{head}{functions}\n{interface}"
    return {file: text.encode() for file, text in sorted(texts.items())}


def run_words(library: Library) -> dict[str, str]:
    """Marks of every template in which a run of a library is made of its settings."""
    program = library.program
    return {
        "never": repr(NEVER_FAILED),
        "same_moment": repr(SAME_MOMENT),
        "signal_rows": str(SIGNAL_ROWS),
        "output_count": str(len(program.outputs)),
        "metric_count": str(len(program.metrics)),
        "setting_count": str(len(library.settings)),
    }


def _words(library: Library, name: str) -> dict[str, str]:
    """Marks of the templates of a library, and the text in the place of each; words of its own go before these."""
    # The last argument of the loop of a run in C, where it has both kinds of steps.
    in_parts = ", run->needs_parts" if library.program.program.chooses_parts else ""
    steps = {"name": name, "signal_rows": str(SIGNAL_ROWS), "in_parts": in_parts}
    surface = library.surface
    return {
        **run_words(library),
        **_title_words(library, name),
        **_struct_words(library),
        **_check_words(library),
        **_example_words(library),
        **_comparing_words(library, name),
        "in_parts": in_parts,
        "run": filled(template(_FOLDER, "run.h"), {"name": name}),
        "steps": filled(template(_FOLDER, "steps.c"), steps),
        "first": "".join(f"    before.{setting} = before.{surface.step};\n" for setting in surface.as_step),
        "follow": "" if library.following is None else "    follow(&before, &all);",
        **library.words,
        **surface.words,
    }


def _title_words(library: Library, name: str) -> dict[str, str]:
    """Title and description of a library for comments and pages."""
    return {
        "name": name,
        "NAME": name.upper(),
        "title": library.title,
        "description": "\n * ".join(textwrap.wrap(in_comment(library.description), 110)),
        "about": in_markdown(library.description),
        "version": __version__,
    }


def _struct_words(library: Library) -> dict[str, str]:
    """Members of the structs of settings, outputs and metrics, and the table of the settings with their ranges."""
    settings, program = library.settings, library.program
    outputs = (("time", "s", "since the start"), *((name, *OUTPUTS[name]) for name in program.outputs))
    return {
        "settings": _members((setting.name, setting.quantity.unit, _said(setting.quantity)) for setting in settings),
        "outputs": _members(outputs),
        "metrics": _members((kind.name, kind.unit, kind.summary) for kind in program.metrics),
        "table": "\n".join(_table_line(setting, setting.name in library.defaults) for setting in settings),
    }


def _table_line(setting: ExportParameter, follows: bool) -> str:
    """Line of the table in C: name, value, range, whether its lower end is allowed, whether the default ``follows``."""
    low, high = _limits(setting.quantity)
    flags = ", ".join("true" if flag else "false" for flag in (setting.quantity.minimum_allowed, follows))
    return f'    {{"{setting.name}", {setting.value!r}, {low!r}, {high!r}, {flags}}},'


def _check_words(library: Library) -> dict[str, str]:
    """Lines in C that return the name of a setting which contradicts another one, or which needs another program."""
    relations = _relations(library)
    refused = [(f"!({condition})", name) for condition, name in relations]
    return {
        "relations": _returning(refused),
        "is_whole": _IS_WHOLE if any("is_whole(" in condition for condition, _ in relations) else "",
        "needs_other": _returning(conditions_of_program(library)),
    }


def _returning(conditions: Iterable[tuple[str, str]]) -> str:
    """Lines in C that return a name under its condition."""
    return "\n".join(f'    if ({condition}) {{\n        return "{name}";\n    }}' for condition, name in conditions)


def _example_words(library: Library) -> dict[str, str]:
    """Outputs and metrics that the example prints, and the parameter that it changes."""
    outputs = ["time", *library.program.outputs]
    # Every scenario has a supply pressure, which is what a user would try first.
    (pressure,) = [setting for setting in library.settings if setting.name == "supply_pressure"]
    return {
        "csv_head": ",".join(outputs),
        "csv_form": ",".join(["%.17g"] * len(outputs)),
        "csv_values": ",\n".join(f"            outputs.{name}" for name in outputs),
        "print_metrics": "\n".join(
            f'        print_metric("{kind.name}", metrics.{kind.name}, "{kind.unit}", "{kind.summary}");'
            for kind in library.program.metrics
        ),
        "example": f"{pressure.name} = {pressure.value!r};",
    }


def _comparing_words(library: Library, name: str) -> dict[str, str]:
    """Words of the program that compares the library with Python: channels, metrics, and what a closed loop adds."""
    return {
        "channel_names": ", ".join(f'"{channel}"' for channel in ("time", *library.program.outputs)),
        "metric_names": ", ".join(f'"{kind.name}"' for kind in library.program.metrics) or '""',
        "allowed": repr(SAME_METRIC),
        "check_inputs": "",
        "check_first": f"    status = status == {name.upper()}_GOING_ON ? {name}_step(run) : status;",
        "check_metrics": filled(template(_FOLDER, "check_metrics.c"), {"name": name, "NAME": name.upper()}),
    }


def _members(items: Iterable[tuple[str, str, str]]) -> str:
    """Members of a struct, each with its unit and meaning."""
    lines = []
    for name, unit, said in items:
        comment = in_comment(f"{UNITS.get(unit, unit) or '-'}: {said}")
        lines.append(f"    double {name}; /* {comment} */")
    return "\n".join(lines)


def _said(quantity: Quantity) -> str:
    """Meaning and range of a parameter."""
    low, high = (limit if abs(limit) < math.inf else None for limit in (quantity.minimum, quantity.maximum))
    beyond = "from" if quantity.minimum_allowed else "above"
    above = "" if low is None else f"{beyond} {low:g}"
    below = "" if high is None else f"up to {high:g}"
    limits = " ".join(filter(None, (above, below)))
    return "; ".join(filter(None, (quantity.summary or quantity.name, limits)))


def conditions_of_program(library: Library) -> list[tuple[str, str]]:
    """Conditions in C under which the settings ask for another program, with the setting that is named."""
    values = {setting.name: setting.value for setting in library.settings}
    conditions = []
    for switch in library.switches:
        if switch.is_above:
            # The setting that switches the program on is the one to name where all of them are 0.
            was_above = next(name for name in switch.names if values[name] > 0.0)
            conditions.append((f"!({' || '.join(f'settings->{name} > 0.0' for name in switch.names)})", was_above))
        else:
            conditions += [(f"settings->{name} > 0.0", name) for name in switch.names]
    return [*conditions, *library.other_program]


def conditions_of(library: Library) -> list[tuple[str, str]]:
    """Conditions on settings as text in C, each with the setting that is named where it fails, also for NaN."""
    ranges = []
    for setting in library.settings:
        value, sign = f"settings->{setting.name}", ">=" if setting.quantity.minimum_allowed else ">"
        low, high = _limits(setting.quantity)
        ranges.append((f"{value} {sign} {low!r} && {value} <= {high!r}", setting.name))
    return [*ranges, *_relations(library)]


RULES_OF_TIMES: tuple[Rule, ...] = (
    ("run_output_interval", "is_whole({} / {})", ("run_duration", "run_output_interval")),
    ("run_duration", "{} / {} <= 1.0e8", ("run_duration", "run_step")),
    ("run_duration", "{} / {} <= 5.0e6", ("run_duration", "run_output_interval")),
    ("sensors_delay", "{} / {} <= 1.0e5", ("sensors_delay", "run_step")),
)
"""Rules of the times of a scenario (``simulation/clock.py``)."""


_IS_WHOLE = """
/* True for a number that is a whole one but for rounding. */
static bool is_whole(double count)
{
    return fabs(count - floor(count + 0.5)) <= 1.0e-9 * count;
}
"""


def _relations(library: Library) -> list[tuple[str, str]]:
    """Conditions between settings as text in C, each with the setting that is named."""
    relations = []
    for relation in library.relations:
        other, sign = f"settings->{relation.other}", "-" if relation.relation == "at least" else "+"
        if relation.tolerance:
            # With the tolerance of files, or a setting that a file accepts would be refused in C.
            slack = repr(relation.tolerance)
            other = f"{other} * (1.0 {sign} {slack})" if relation.is_share else f"{other} {sign} {slack}"
        relations.append((f"settings->{relation.name} {_SIGNS[relation.relation]} {other}", relation.name))
    return [
        *relations,
        *((rule.format(*(f"settings->{name}" for name in names)), named) for named, rule, names in library.rules),
    ]


def _limits(quantity: Quantity) -> tuple[float, float]:
    # C can write no infinity as a literal; no setting is that large.
    return max(quantity.minimum, -sys.float_info.max), min(quantity.maximum, sys.float_info.max)


_METRICS_OF_SCENARIO = """\
They equal the metrics of a study (`ppafo sweep`) to the bit. In `ppafo simulate` the same are computed from the
recording, whose sums are rounded in another order: they agree to about 15 digits. Not here, since they need all samples
of a channel: {left_out}."""
_METRICS_OF_WALK = """\
They are means over the strides with help, from the third on, and counts; of a task sequence counts alone. In
`ppafo walk` the same are computed from the recording, whose sums are rounded in another order: they agree to about 15
digits. Not here, since they need the mean stride or the healthy one: `healthy_positive_work`, `push_off_share`,
`lowest_toes`, `angle_difference`, `dorsiflexor_moment`; nor safety events and the segments of a task sequence."""
_FOLLOWS = """\
- As in ppafo, these follow others as long as they have their default, also where that is given: {followers}."""
_TRAPS_OF_WALK = """\
- `sensors_angle_bandwidth` and `sensors_pressure_bandwidth` 0 are sensors that follow at once.
- `run_duration` is what `ppafo walk` calls `--minutes`, here in seconds and up to 10^6.
- `..._bad_setting` looks at ranges and at contradictions of two settings. A walk file is also refused where a setting
  contradicts the gait, or several others at once."""


def words_of(scenario: Scenario, links: Graph) -> dict[str, str]:
    """Texts about this scenario on the page of the library; ``links`` has the parameters that follow others."""
    fixed = [
        f"the valve, `{scenario.device.valve.kind}`, and the controller, `{scenario.controller.kind}`",
        f"the reference, `{scenario.reference.kind}`, and the motion, {vane_motion(scenario).form}",
        *_fixed_of_device(scenario.device, scenario.gas_model is not None, scenario.supply_lines is not None),
        _at_zero(scenario.device, scenario.sensors.flaws),
        "whether `run_output_interval` is a whole number of steps of the engine",
    ]
    left_out = [kind.name for kind in METRICS.values() if kind.traced]
    return {
        "fixed": _listed(fixed),
        "precomputed": "nothing",
        "traps": _followers(links),
        "metrics_said": _METRICS_OF_SCENARIO.format(left_out=", ".join(f"`{name}`" for name in left_out)),
    }


def _followers(links: Graph) -> str:
    """The line on what follows what."""
    pairs = {
        path: dict.fromkeys(source for link in follows for source in link.sources) for path, follows in links.items()
    }
    said = (
        f"`{c_identifier(path)}` ({', '.join(f'`{c_identifier(source)}`' for source in sources)})"
        for path, sources in pairs.items()
    )
    return _FOLLOWS.format(followers=", ".join(said) or "none")


def _fixed_of_walk(gait: "Gait", sequence: "TaskSequence | None") -> tuple[tuple[str, ...], str]:
    """Fixed properties of an exported walk, in words, and the source of its precomputed numbers."""
    way = "stride after equal stride"
    if sequence is not None:
        way = f"the task sequence `{sequence.name}`, which stays as it is"
    led = (
        f"the gait, `{gait.name}`: its series, its events and its stride of "
        f"{gait.stride_time:.4g} s are numbers in the source",
        f"how it is walked: {way}",
    )
    return led, "the gait alone" if sequence is None else "the gait and its task sequence alone"


def words_of_walk(configuration: Scenario, links: Graph, failing: "Mapping[str, FaultSettings]") -> dict[str, str]:
    """Texts about this walk on the library's page, with linked parameters (``links``) and ``failing`` sensors."""
    faults = [f"{sensor} `{fault.kind}`" for sensor, fault in failing.items()]
    from ppafo.walking.motion import walk_of
    from ppafo.walking.planning import has_ideal_sensors

    motion = walk_of(configuration)
    led, precomputed = _fixed_of_walk(motion.gait, motion.task_sequence)
    fixed = [
        *led,
        f"the valve, `{configuration.device.valve.kind}`, and the controller, `{configuration.controller.kind}`",
        *_fixed_of_device(
            configuration.device, configuration.gas_model is not None, configuration.supply_lines is not None
        ),
        f"which sensors fail, and how: {', '.join(faults) or 'none'}; and whether one is late",
        _at_zero(configuration.device, () if has_ideal_sensors(configuration) else (1.0,)),
    ]
    return {
        "fixed": _listed(fixed),
        "precomputed": precomputed,
        "traps": f"{_followers(links)}\n{_TRAPS_OF_WALK}",
        "metrics_said": _METRICS_OF_WALK,
    }


def _fixed_of_device(device: Device, is_thermal: bool, has_lines: bool) -> list[str]:
    """Lines on what no setting of a device changes."""
    forms = {"valve": device.valve.orifice, "leak": device.actuator.leak}
    lines = "with lines behind the regulators" if has_lines else "constant supply pressures"
    effects = ", ".join(f"`{effect.name}`" for effect in effects_of(device) if effect.switch)
    gas = "thermal" if is_thermal else "isothermal"
    let = "let" if device.supply.takes_back else "do not let"
    return [
        *(
            f"the form of the {name}, `sonic_conductance, critical_ratio`"
            if isinstance(orifice, SonicOrifice)
            else f"the form of the {name}, `area, discharge_coefficient`"
            for name, orifice in forms.items()
        ),
        f"the gas, `{gas}`; {lines}, which {let} gas back in from a chamber above them",
        *([f"the effects, {effects}, none of which can be switched off"] if effects else []),
    ]


def _at_zero(device: Device, flaws: Sequence[float]) -> str:
    """Parameters that select functions and are 0."""
    zero = [f"`valve_{name}`" for name in choosing(device) if not device.valve.settings[name] > 0.0]
    flawless = [] if any(flaws) else ["what makes a sensor of `sensors_` less than ideal"]
    here = ", ".join([*zero, *flawless]) or "none"
    return f"which of the settings of the valve and of the sensors are 0: here 0 are {here}"


def _listed(items: Sequence[str]) -> str:
    return "\n".join(f"- {line}{'.' if line is items[-1] else ';'}" for line in items)


def choosing(device: Device) -> list[str]:
    """Settings of the valve that choose its functions by being 0 or not."""
    kind = VALVES[device.valve.kind]
    names = [quantity.name for quantity in kind.quantities]
    chosen = {}
    # A valve may look only at which settings are 0, so both cases of each tell what chooses.
    for pattern in itertools.product((0.0, 0.01), repeat=len(names)):
        # The model and whether it has a dead time: both decide which program is composed.
        settings = kind.settings(*pattern)
        model = kind.choose(settings)
        chosen[pattern] = model, model.command_delay(settings) > 0.0
    return [
        name
        for index, name in enumerate(names)
        if any(chosen[pattern] != chosen[*pattern[:index], 0.0, *pattern[index + 1 :]] for pattern in chosen)
    ]
