"""Files of an exported library: header, source, example, make files, licence and README."""

import math
import textwrap
from collections.abc import Iterable, Sequence

from ppafo.engine.lanes import SIGNAL_ROWS
from ppafo.engine.run import NEVER_FAILED
from ppafo.engine.step.lane import SAME_MOMENT
from ppafo.exports import filled, in_comment, in_markdown, template
from ppafo.exports.c_library.library import Library, c_identifier
from ppafo.exports.c_library.program import c_text_of_run
from ppafo.exports.c_library.settings import choosing, limits_in_c, numbers_of_second_chamber
from ppafo.metrics import METRICS
from ppafo.parameters.device import SonicOrifice
from ppafo.parameters.effects import effects_of
from ppafo.parameters.graph import ATMOSPHERE_PATH, Graph
from ppafo.running import simulate
from ppafo.signals import CHANNELS
from ppafo.simulation.motion_kind import WALK
from ppafo.simulation.scenario import Scenario, vane_motion
from ppafo.version import __version__

_FOLDER = "ppafo.exports.c_library"
"""Package that contains the templates."""

OUTPUTS = {name: (channel.unit, channel.summary) for name, channel in CHANNELS.items()} | {
    "strides": ("-", "heel strikes so far"),
    "phase": ("-", "gait phase, 0 at heel strike, in turns"),
    "positive_push_off_work": ("J", "positive work of T_ex while the foot rolls over the toes, so far"),
    "net_push_off_work": ("J", "net work of T_ex while the foot rolls over the toes, so far"),
}
"""Unit and meaning of the outputs at each sample: channels of a recording, and totals of a walk."""
SAME_METRIC = 1.0e-12
"""Accepted relative difference between a metric in C and in Python; sums are rounded in another order."""
UNITS = {"1": "-", "Pa_a": "Pa, absolute", "Pa_d": "Pa, a difference"}
_FILES = {"Makefile": "Makefile", "CMakeLists.txt": "CMakeLists.txt"}
"""Templates of the files in every library, with their names in the library."""
_CHECKED = """\
    {
        run_fault fault;
        check_profiles(settings, &fault);
        if (fault.place > 0.0) {
            return SETTING[(int)fault.place - 1].name;
        }
    }"""
_IS_WHOLE = """
/* True for a whole number, within rounding. */
static bool is_whole(double count)
{
    return fabs(count - floor(count + 0.5)) <= 1.0e-9 * count;
}
"""
MOST_ROWS = 1000
"""Maximum number of samples in the table; of a longer run every second, third, ... sample and the last."""

_METRICS_OF_SCENARIO = """\
They equal the metrics of a study (`ppafo sweep`) to the bit. In `ppafo simulate` the same are computed from the
recording, whose sums are rounded in another order: they agree to about 15 digits. Not here, since they need all samples
of a channel: {left_out}."""
_METRICS_OF_WALK = """\
They are means over the strides from the third on, and counts. In `ppafo walk` the same are computed from the recording,
whose sums are rounded in another order: they agree to about 15 digits. Not here, since they need the mean stride or the
healthy one: `healthy_positive_work`, `push_off_share`, `lowest_toes`, `angle_difference`, `dorsiflexor_moment`."""
_OF_TIMES = "whether `run_output_interval` is a whole number of steps of the engine, and whether the supply is suction"
_FOLLOWS = """\
- As in ppafo, these settings depend on others while they equal their default, even if it is given: {followers}."""
_TRAPS_OF_WALK = """\
- `sensors_angle_bandwidth` and `sensors_pressure_bandwidth` 0 are sensors without lag.
- `run_duration` is what `ppafo walk` calls `--minutes`, here in seconds and up to 10^6."""


def expected_csv(scenario: Scenario, channels: Iterable[str], metrics: Iterable[str] = ()) -> bytes:
    """Return samples of a run as CSV in SI units with 17 digits, then its metrics as ``# name = value``.

    Channels and metrics missing in the recording are left out, as are all metrics of a failed run.
    """
    result = simulate(scenario)
    recording = result.recording
    names = [name for name in channels if name in recording.names]
    columns = [recording.time, *(recording[name] for name in names)]
    last = len(recording) - 1
    samples = [*range(0, last, math.ceil(last / MOST_ROWS) or 1), last]
    rows = (",".join(f"{column[sample]:.17g}" for column in columns) for sample in samples)
    values = (f"# {name} = {result.metrics[name].value:.17g}" for name in metrics if name in result.metrics)
    return "\n".join([",".join(["time", *names]), *rows, *values, ""]).encode()


def library_files(library: Library) -> dict[str, bytes]:
    """All files of a library by name."""
    name = library.name
    words = _words(library, name)
    api = library.api
    sources = {api.header: f"{name}.h", api.main: "main.c", api.page: "README.md", api.check: "check.c", **_FILES}
    texts = {target: filled(template(_FOLDER, source), words) for source, target in sources.items()}
    texts["LICENSE"] = template(_FOLDER, "LICENSE")
    head = f'#include "{name}.h"\n\n'
    title = f"{library.title}: functions of a run in ppafo {__version__}. Generated: do not edit."
    # The interface is written around the functions, whose names must not hide its own.
    interface = "".join(filled(template(_FOLDER, file), words) for file in api.sources)
    if api.functions is None:
        head += "#include <string.h>\n\n"
        functions = c_text_of_run(library, title, interface)
    else:
        functions = api.functions(library, title, interface)
    texts[f"{name}.c"] = f"{head}{functions}\n{interface}"
    return {file: text.encode() for file, text in sorted(texts.items())}


def _words(library: Library, name: str) -> dict[str, str]:
    """Template variables of an exported library; its own entries override the defaults."""
    settings = library.settings
    program = library.program
    api = library.api
    outputs = ("time", *program.outputs)
    # The last argument of the loop of a run in C, where it has both kinds of steps.
    in_parts = ", run->needs_parts" if program.program.chooses_parts else ""
    steps = {"name": name, "signal_rows": str(SIGNAL_ROWS), "in_parts": in_parts}
    relations = [*(relation.condition for relation in library.relations), *library.rules]
    table = []
    fields = []
    for setting in settings:
        quantity = setting.quantity
        low, high = limits_in_c(quantity)
        flags = quantity.minimum_allowed, setting.name in library.defaults
        words = ", ".join("true" if flag else "false" for flag in flags)
        table.append(f'    {{"{setting.name}", {setting.value!r}, {low!r}, {high!r}, {words}}},')
        limits = [f"{'from' if quantity.minimum_allowed else 'above'} {quantity.minimum:g}"]
        limits = limits if quantity.minimum > -math.inf else []
        limits += [f"up to {quantity.maximum:g}"] if quantity.maximum < math.inf else []
        meaning = "; ".join(filter(None, (quantity.summary or quantity.name, " ".join(limits))))
        fields.append((setting.name, quantity.unit, library.worded(meaning)))
    # Conditions under which settings require another compiled program, each with the setting to report.
    values = {setting.name: setting.value for setting in settings}
    other_program = []
    for names, is_above in library.switches:
        if is_above:
            # The setting that switches the program on is the one to name where all of them are 0.
            was_above = next(each for each in names if values[each] > 0.0)
            other_program.append((f"!({' || '.join(f'settings->{each} > 0.0' for each in names)})", was_above))
        else:
            other_program += [(f"settings->{each} > 0.0", each) for each in names]
    # Every plant has a supply pressure, which is what a user would try first.
    tried = next((setting for setting in settings if setting.name == "supply_pressure"), settings[0])
    return {
        "never": repr(NEVER_FAILED),
        "same_moment": repr(SAME_MOMENT),
        "signal_rows": str(SIGNAL_ROWS),
        "output_count": str(len(program.outputs)),
        "metric_count": str(len(program.metrics)),
        "setting_count": str(len(settings)),
        "name": name,
        "NAME": name.upper(),
        "title": library.title,
        "description": "\n * ".join(textwrap.wrap(in_comment(library.description), 110)),
        "about": in_markdown(library.description),
        "version": __version__,
        "settings": members_of(fields),
        "outputs": members_of(
            (
                ("time", "s", "since the start"),
                *((output, OUTPUTS[output][0], library.worded(OUTPUTS[output][1])) for output in program.outputs),
            )
        ),
        "metrics": members_of((kind.name, kind.unit, library.worded(kind.summary)) for kind in program.metrics),
        "table": "\n".join(table),
        "relations": _returning((f"!({condition})", setting) for condition, setting in relations),
        "is_whole": _IS_WHOLE if any("is_whole(" in condition for condition, _ in relations) else "",
        "profiles": "" if library.checking is None else _CHECKED,
        "needs_other": _returning([*other_program, *library.other_program]),
        "csv_head": ",".join(outputs),
        "csv_form": ",".join(["%.17g"] * len(outputs)),
        "csv_values": ",\n".join(f"            outputs.{output}" for output in outputs),
        "print_metrics": "\n".join(
            f'        print_metric("{kind.name}", metrics.{kind.name}, "{kind.unit}", '
            f'"{library.worded(kind.summary)}");'
            for kind in program.metrics
        ),
        "example": f"{tried.name} = {tried.value!r};",
        "channel_names": ", ".join(f'"{output}"' for output in outputs),
        "metric_names": ", ".join(f'"{kind.name}"' for kind in program.metrics) or '""',
        "allowed": repr(SAME_METRIC),
        "check_inputs": "",
        "check_first": f"    status = status == {name.upper()}_GOING_ON ? {name}_step(run) : status;",
        "check_metrics": filled(template(_FOLDER, "check_metrics.c"), {"name": name, "NAME": name.upper()}),
        "in_parts": in_parts,
        "run": filled(template(_FOLDER, "run.h"), {"name": name}),
        "steps": filled(template(_FOLDER, "steps.c"), steps),
        "first": "",
        "follow": "" if library.following is None else "    follow(&before, &all);",
        **library.words,
        **api.words,
    }


def _returning(conditions: Iterable[tuple[str, str]]) -> str:
    """C lines that return the name of the setting at fault for the first condition that is true."""
    return "\n".join(f'    if ({condition}) {{\n        return "{name}";\n    }}' for condition, name in conditions)


def members_of(items: Iterable[tuple[str, str, str]]) -> str:
    """C declarations of struct members, each with unit and meaning as a comment."""
    lines = []
    for name, unit, meaning in items:
        comment = in_comment(f"{UNITS.get(unit, unit) or '-'}: {meaning}")
        lines.append(f"    double {name}; /* {comment} */")
    return "\n".join(lines)


def words_of(scenario: Scenario, links: Graph) -> dict[str, str]:
    """Return README texts on a scenario or a walk; ``links`` has the parameters that follow others."""
    kind = scenario.motion.motion_kind
    device = scenario.device
    laws = f"the valve, `{device.valve.kind}`, and the controller, `{scenario.controller.kind}`"
    zero = [f"`valve_{name}`" for name in choosing(device) if not device.valve.settings[name] > 0.0]
    flawless = [] if any(kind.flaws(scenario)) else ["the sensor errors of `sensors_`"]
    selecting = f"which settings of valve and sensors are 0 (here {', '.join([*zero, *flawless]) or 'none'})"
    of_both = [*_fixed_of_device(scenario), selecting]
    # A missing chamber has the pressure of the atmosphere; its other numbers are constants and omitted.
    absent = numbers_of_second_chamber(scenario)
    followed = []
    for path, follows in links.items():
        paths = [each for link in follows for each in link.sources if each not in absent or "pressure" in each]
        paths = [ATMOSPHERE_PATH if each in absent else each for each in paths]
        sources = dict.fromkeys(f"`{c_identifier(each)}`" for each in paths)
        followed.append(f"`{c_identifier(path)}` ({', '.join(sources)})")
    followers = _FOLLOWS.format(followers=", ".join(followed) or "none")
    if kind.layout != WALK:
        moved = vane_motion(scenario)
        profile = moved.profile if moved.leg is None else moved.leg.shank
        along = "" if profile is None else f" along `{profile.kind}`"
        motion = f"the reference, `{scenario.reference.kind}`, and the motion, `{kind.name}`{along}"
        left_out = ", ".join(f"`{kind.name}`" for kind in METRICS.values() if kind.traced)
        return {
            "fixed": _listed([laws, motion, *of_both, _OF_TIMES]),
            "precomputed": "nothing",
            "traps": followers,
            "metrics_said": _METRICS_OF_SCENARIO.format(left_out=left_out),
        }
    from ppafo.walking.motion import walk_of

    gait = walk_of(scenario).gait
    series = f"its series, its events and its stride of {gait.stride_time:.4g} s are numbers in the source"
    return {
        "fixed": _listed([f"the gait, `{gait.name}`: {series}", "the walk: equal strides", laws, *of_both]),
        "precomputed": "the gait alone",
        "traps": f"{followers}\n{_TRAPS_OF_WALK}",
        "metrics_said": _METRICS_OF_WALK,
    }


def _fixed_of_device(scenario: Scenario) -> list[str]:
    """Return README lines on device properties that no setting changes."""
    device = scenario.device
    forms = {"valve": device.valve.orifice}
    if not device.actuator.has_one_chamber:
        forms["leak"] = device.actuator.leak
    lines = "with lines behind the regulators" if scenario.supply_lines is not None else "constant supply pressures"
    effects = ", ".join(f"`{effect.name}`" for effect in effects_of(device) if effect.switch)
    gas = "thermal" if scenario.gas_model is not None else "isothermal"
    verb = "let" if device.supply.takes_back else "do not let"
    return [
        *(
            f"the form of the {name}, `sonic_conductance, critical_ratio`"
            if isinstance(orifice, SonicOrifice)
            else f"the form of the {name}, `area, discharge_coefficient`"
            for name, orifice in forms.items()
        ),
        f"the gas, `{gas}`; {lines}, which {verb} gas flow back from a chamber at higher pressure",
        *([f"the effects, {effects}, none of which can be switched off"] if effects else []),
    ]


def _listed(items: Sequence[str]) -> str:
    return "\n".join(f"- {line}{'.' if line is items[-1] else ';'}" for line in items)
