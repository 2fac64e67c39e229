"""Page that simulates: content, WebAssembly module, and HTML file.

No rule of a scenario is repeated here or in ``page.js``: ranges, followers, default gains and metrics are those of the
C library that ``ppafo export c`` writes.
"""

import base64
import functools
import hashlib
import importlib.util
import json
import math
import shlex
import shutil
import sys
import zlib
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from functools import partial
from html import escape
from pathlib import Path
from typing import Any

from ppafo.arguments import Overrides, checked
from ppafo.engine.cache import kept_bytes
from ppafo.errors import ProgramError, ScenarioError
from ppafo.exports import filled, template
from ppafo.exports.c_library import library_of
from ppafo.exports.c_library.entries import with_reach
from ppafo.exports.c_library.files import OUTPUTS, library_files
from ppafo.exports.c_library.library import ExportParameter, Library
from ppafo.exports.c_library.settings import limits_in_c
from ppafo.exports.fmu.platforms import FLAGS
from ppafo.loading import load_scenario
from ppafo.model.controlled import CONTROLLED
from ppafo.parameters.graph import ATMOSPHERE_PATH
from ppafo.plugins import Plugins
from ppafo.report.kind import label_of, metric_quantity, metric_words
from ppafo.running import simulate
from ppafo.signals.recording import Recording
from ppafo.simulation.scenario import Scenario
from ppafo.storage.files import temporary_folder
from ppafo.translation.compiling import asked, complaint
from ppafo.units import conversion
from ppafo.units.shown import QUANTITIES, quantity_of_unit, shown_in, shown_unit, unit_of
from ppafo.version import __version__

DEFAULT = ("torque-task-solenoid", "torque-task-proportional")
FIRST = (
    *("reference.level", "reference.ramp_time", "supply.pressure", "valve.area", "valve.sonic_conductance"),
    *("controller.period", "controller.proportional_gain", "controller.largest_torque", "controller.command"),
    *("motion.angle", "wearer.body_mass"),
)
"""Settings shown first by default."""
_HIDDEN = ("run.step", "run.output_interval", "run.tolerance", "sensors.seed")
_LONGER = 4.0
"""Longest run on a page, as a multiple of its duration as written: a browser waits for a run."""
_PANELS = (
    *(("Torque", ("torque", "reference", "within_reach")), ("Angle", ("angle", "reference_angle"))),
    ("Pressures, chamber 2 dashed", ("pressure_1", "pressure_2", "reference_pressure_1", "reference_pressure_2")),
    *(("Command to the valve", ("command",)), ("Gas taken from the supply", ("supplied_mass",))),
)
"""Panels: title and channels, of which all but the first are dashed."""
_HEADLINES = ("gas_supplied", "positive_push_off_work")
"""Metrics that are said after each change, beside the first one."""
_WORDS = {"_g": " gauge", "_a": " abs", "_d": "", "^2": "²", "^3": "³"}
_ALONE = ("-ffreestanding", "-nostdlib", "-fvisibility=hidden", "-I.", "-Wl,--no-entry", "-Wl,--strip-all")
_FLAGS = (*FLAGS, *_ALONE, "-Wl,-z,stack-size=262144")
_ZIG = ("-m", "ziglang", "cc", "--target=wasm32-freestanding", "-mcpu=generic+bulk_memory", "-fno-sanitize=undefined")
_CLANG = ("clang", "--target=wasm32", "-mbulk-memory")
_REMEDY = "a page needs a compiler for WebAssembly: pip install 'ppafo[workbench]', or clang with lld"


def module_of(library: Library) -> bytes:
    """Return the WebAssembly module of a library; raises ProgramError without a compiler for it."""
    has_reach = "reference" in library.program.outputs
    words = {"name": library.name, "NAME": library.name.upper(), "REACH": str(int(has_reach))}
    written = library_files(replace(library, further=partial(with_reach, library)) if has_reach else library)
    sources = {f"{library.name}{end}": written[f"{library.name}{end}"] for end in (".c", ".h")}
    sources |= dict.fromkeys(("math.h", "string.h"), template("ppafo.page", "standard.h").encode())
    sources["module.c"] = filled(template("ppafo.page", "module.c"), words).encode()
    digests = [hashlib.sha256(text).hexdigest() for _, text in sorted(sources.items())]
    return kept_bytes("wasm", "\n".join([*compiler(), *_FLAGS, *digests]), lambda: built(sources))


def compiler() -> list[str]:
    """Return the command of a compiler for WebAssembly; raises ProgramError without one."""
    if importlib.util.find_spec("ziglang") is not None:
        return [sys.executable, *_ZIG]
    if shutil.which("clang") and shutil.which("wasm-ld"):
        return [*_CLANG]
    raise ProgramError(_REMEDY)


def built(sources: Mapping[str, bytes]) -> bytes:
    """Return the module of ``module.c`` and the files beside it; raises ProgramError where it cannot be built."""
    line = [*compiler(), *_FLAGS, "module.c", "-o", "module.wasm"]
    with temporary_folder("ppafo", sources) as folder:
        done = asked(line, _REMEDY, folder, Path(folder))
        made = Path(folder) / "module.wasm"
        if done.returncode != 0 or not made.is_file():
            raise ProgramError(f"the WebAssembly module could not be built: {complaint(done)}")
        return made.read_bytes()


@checked
def workbench(
    scenarios: Sequence[str | Path] = DEFAULT,
    *,
    overrides: Overrides = (),
    sliders: Sequence[str] = (),
    plugins: Plugins = (),
) -> bytes:
    """Create one HTML page that simulates scenarios again as their numbers change.

    The page needs a browser and nothing else. It checks that its unchanged run has the samples of Python to the bit.

    Arguments:
        scenarios: names or files of scenarios and walks
        overrides: changes of all scenarios, as texts or a dictionary
        sliders: paths of the settings that come first, such as ``valve.area``
        plugins: modules of your own, files or names, whose objects files may name

    Returns:
        the page, in UTF-8

    Raises:
        ScenarioError: no scenario, two of one name, or a slider that no scenario has
        ProgramError: no compiler for WebAssembly, or code that cannot be translated

    >>> import ppafo
    >>> ppafo.workbench(["torque-task-proportional"])[:15]
    b'<!DOCTYPE html>'
    """
    sliders = tuple(map(str, sliders))
    simulations = [_simulation(str(name), tuple(overrides), sliders) for name in scenarios]
    names = [simulation["name"] for simulation in simulations]
    if len({*names}) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise ScenarioError(f"two scenarios are named '{twice}'; a page needs different names")
    found = {setting["path"] for simulation in simulations for setting in simulation["settings"]}
    if not simulations or not found.issuperset(sliders):
        missing = ", ".join(sorted({*sliders} - found)) or "no scenario"
        raise ScenarioError(f"{missing}: a page needs scenarios, and settings that one of them has and may change")
    content = json.dumps({"simulations": simulations}, ensure_ascii=False, separators=(",", ":"))
    script = template("ppafo.page", "page.js")
    words = {
        "engine": template("ppafo.page", "engine.js"),
        "title": escape(", ".join(names)),
        "digest": base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(),
        "style": template("ppafo.page", "page.css"),
        "content": content.replace("<", "\\u003c"),
        "script": script,
        "version": __version__,
    }
    return filled(template("ppafo.page", "page.html"), words).encode()


def _simulation(name: str, overrides: Sequence[str], sliders: Sequence[str]) -> dict[str, Any]:
    """Return all that the page needs of a scenario, as plain data for JSON."""
    scenario = load_scenario(name, overrides)
    library = library_of(scenario)
    recording = simulate(scenario).recording
    outputs = library.program.outputs
    metrics = library.program.metrics
    compared = [output for output in outputs if output in recording.names]
    drawn = {name: OUTPUTS[name] for name in outputs}
    if "reference" in outputs:
        drawn["within_reach"] = "N m", "reference torque as far as the actuator reaches it"
    found = [(title, [name for name in channels if name in drawn]) for title, channels in _PANELS]
    panels = [{"title": title, "channels": channels} for title, channels in found if channels]
    with shown_in(scenario.device.shown):
        return {
            "name": scenario.name,
            "description": library.description,
            "command": shlex.join(
                ["ppafo", "simulate", name, *(word for text in overrides for word in ("--set", text))]
            ),
            "settings": _settings(scenario, library, sliders or FIRST),
            "outputs": outputs,
            "channels": [
                {"name": one, "label": _sentence(meaning, library), **_shown(unit)}
                for one, (unit, meaning) in drawn.items()
            ],
            "panels": sorted(panels, key=lambda panel: not any("reference" in name for name in panel["channels"])),
            "metrics": [
                {
                    "name": kind.name,
                    "short": metric_words(kind.name),
                    "label": _sentence(kind.summary, library),
                    **_shown(kind.unit),
                }
                for kind in metrics
            ],
            "headlines": [metrics[0].name, *(kind.name for kind in metrics[1:] if kind.name in _HEADLINES)],
            "compared": compared,
            "samples": len(recording),
            "checksum": _checksum(recording, compared),
            "wasm": base64.b64encode(module_of(library)).decode(),
        }


def _checksum(recording: Recording, channels: Sequence[str]) -> int:
    """Return the CRC-32 of all samples of some channels of a recording."""
    check = 0
    for name in channels:
        # A sum with 0 has no negative zero.
        check = zlib.crc32((recording[name] + 0.0).astype("<f8").tobytes(), check)
    return check


def _settings(scenario: Scenario, library: Library, first: Sequence[str]) -> list[dict[str, Any]]:
    """Return the settings of a library in their order; those that are not to be changed have no slider."""
    # Above 0, these need functions that the module does not have.
    absent = {name for names, is_above in library.switches if not is_above for name in names}
    words = CONTROLLED[scenario.controlled].words
    order = {path: place for place, path in enumerate(first)}
    absent |= {"controller_period"} if library.program.program.samples_inside else set()
    sample = min(one.value for one in library.settings if one.path in ("run.output_interval", "controller.period"))
    return [
        {
            "path": setting.path,
            "name": setting.name,
            "ends": limits_in_c(setting.quantity),
            "least": "at least" if setting.quantity.minimum_allowed else "more than",
            "rules": _rules(setting, library, words),
            "label": library.worded(label_of(setting.path, words)),
            "summary": library.worded(setting.quantity.summary or setting.quantity.name),
            "si": "" if setting.quantity.unit == "1" else setting.quantity.unit,
            "value": setting.value,
            "first": order.get(setting.path, -1),
            **_slider(setting, scenario.device.supply.atmospheric_pressure, absent, sample),
        }
        for setting in library.settings
    ]


def _rules(setting: ExportParameter, library: Library, words: str) -> str:
    """Return what a setting has to be beside others, in words; empty for what only its program knows."""
    rules = [f"{one.relation} {label_of(one.other, words)}" for one in library.relations if one.path == setting.path]
    return f"it must be {' and '.join(rules)}" if rules else ""


def _slider(setting: ExportParameter, atmosphere: float, absent: Collection[str], sample: float) -> dict[str, Any]:
    """Return how a setting is shown, with the ends of its slider in this unit: from 0 to 2.5 times its value."""
    quantity = setting.quantity
    shown = _shown(quantity.unit, quantity_of_unit, is_absolute=setting.path == ATMOSPHERE_PATH)
    zero = float(shown["offset"]) + (atmosphere if shown["gauge"] else 0.0)
    value, low, high = (
        (number - zero) / float(shown["scale"]) for number in (setting.value, quantity.minimum, quantity.maximum)
    )
    size = _round_up(2.5 * abs(value)) if value else 1.0
    step = 0.0
    if setting.path == "controller.period":
        # Other periods may have samples between steps, which is another program.
        low = step = sample / float(shown["scale"])
        size = max(size, 20.0 * step)
    if setting.path == "run.duration":
        size = high = _LONGER * value
    start = max(low, -size if value < 0.0 else 0.0)
    end = min(high, size)
    start = min(start, value)
    end = max(end, value)
    step = step or _round_up((end - start) / 250.0)
    if not quantity.minimum_allowed and start <= low:
        start = low + step
    is_hidden = setting.path in _HIDDEN or setting.name in absent
    is_length = setting.path == "run.duration"
    return {**shown, "from": start, "to": end, "step": step, "hidden": is_hidden, "longest": is_length}


def _round_up(value: float) -> float:
    """Return the next number of 1, 2, 5 times a power of ten."""
    decade = 10.0 ** math.floor(math.log10(value))
    return float(f"{next(n * decade for n in (1.0, 2.0, 5.0, 10.0) if n * decade >= value * (1.0 - 1e-9)):.1g}")


def _shown(
    si: str, quantity_of: Callable[[str], str] = metric_quantity, *, is_absolute: bool = False
) -> dict[str, Any]:
    """Return the display unit of an SI unit, with scale and offset as decimals, as ``ppafo.units`` computes.

    SI value = offset + scale * shown value, for a gauge pressure plus the atmosphere.
    """
    si = {"-": "1", "Pa": "Pa_a"}.get(si, si)
    quantity = quantity_of(si)
    unit = unit_of(quantity) if quantity == "gas mass" else shown_unit(si)
    unit = f"{unit[:-2]}_a" if is_absolute else unit
    scale, offset, is_gauge = conversion(unit, "" if si == "1" else si)
    zero = QUANTITIES[quantity].zero if quantity else 0.0
    numbers = {"scale": str(scale), "offset": str(offset), "gauge": is_gauge, "zero": zero}
    typeset = functools.reduce(lambda before, word: before.replace(*word), _WORDS.items(), unit)
    return {"unit": typeset, "typed": unit, **numbers}


def _sentence(summary: str, library: Library) -> str:
    text = library.worded(summary)
    return text[:1].upper() + text[1:]
