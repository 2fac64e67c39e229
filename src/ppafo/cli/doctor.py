"""``ppafo doctor``: compilers, compiled models and bits of this computer, schemas of files."""

import importlib
import time
from pathlib import Path
from typing import Any

from ppafo.arguments import Name
from ppafo.cli.output import EXIT_CHECK_FAILED, EXIT_GOOD, CommandOutput
from ppafo.documents.json_text import json_text
from ppafo.errors import DataError, SimulationError
from ppafo.wording import check_known

FORMATS: dict[str, str] = {
    "parameters": "ppafo.parameters.loading",
    "scenario": "ppafo.loading",
    "study": "ppafo.studies.declaration",
    "tuning": "ppafo.analyses.tuning",
    "design": "ppafo.analyses.design.problem",
    "walk": "ppafo.walking.declaration",
    "identification": "ppafo.identification.problem",
    "columns": "ppafo.storage.column_map",
    "rig": "ppafo.rig.preset",
    "gait": "ppafo.gait.document",
    "gait-map": "ppafo.gait.recorded.mapping",
    "bottle": "ppafo.parameters.bottles.bottle",
    "publication": "ppafo.parameters.publications.publication",
}
"""Modules with a ``json_schema()``, by file format."""

_DAY = 86400.0


def doctor(
    *,
    warm: bool = False,
    clear: bool = False,
    bits: bool = False,
    programs: bool = False,
    schema: Name | None = None,
) -> CommandOutput:
    """Show compilers and compiled models of this computer, check its bits; print the schema of a file.

    Exit code 1 where a run has other bits than on every other computer.

    warm: compile the models of the scenarios of the package
    clear: remove all compiled models
    programs: list the compiled models one by one, with their sizes and when each was last used
    bits: run each scenario and walk of the package for a moment, and compare every bit with those it has elsewhere
    schema: print the JSON Schema of a file format instead, such as scenario

    >>> print(doctor(schema="study").text.splitlines()[1])
      "$schema": "https://json-schema.org/draft/2020-12/schema",
    """
    from ppafo.engine import cache
    from ppafo.engine.loading import compilers_to_try

    requests = {"--warm": warm, "--clear": clear, "--bits": bits, "--schema": schema, "--programs": programs}
    options = [option for option, value in requests.items() if value]
    # Two of them contradict each other, or are two answers.
    if len(options) > 1:
        raise DataError(f"{options[1]}: not allowed with {options[0]}")
    if schema is not None:
        check_known(schema, FORMATS, DataError, f"there is no file format '{schema}'")
        document = importlib.import_module(FORMATS[schema]).json_schema()
        return CommandOutput(json_text(document), document, f"{schema}.schema")
    if bits:
        from ppafo.golden_bits import found_bits

        is_equal = dict(found_bits())
        others = [name for name in is_equal if not is_equal[name]]
        compiler = compilers_to_try()[0].name
        lines = [f"bits: {len(is_equal) - len(others)} of {len(is_equal)} runs have the recorded bits ({compiler})"]
        lines += [f"  {name}: different bits; please report scenario, computer and compiler" for name in others]
        code = EXIT_CHECK_FAILED if others else EXIT_GOOD
        return CommandOutput("\n".join(lines), {"compiler": compiler, "same_bits": is_equal}, "bits", code)
    folder = cache.cache_folder()
    cleared = cache.clear(folder) if clear and folder is not None else 0
    why_not = "" if clear else cache.refusal(folder)
    if warm:
        if why_not:
            raise SimulationError(f"--warm: compiled models cannot be stored: {why_not}")
        from ppafo.simulation.loading import list_scenarios, load_scenario
        from ppafo.simulation.simulate import compile_models

        compile_models(load_scenario(name) for name in list_scenarios())
    return _models(folder, why_not, {"freed": cleared} if clear else {}, programs)


def _models(folder: Path | None, why_not: str, freed: dict[str, int], one_by_one: bool) -> CommandOutput:
    """Return compilers and compiled models of a cache folder; ``why_not`` is the reason not to use it, or ""."""
    from ppafo.engine.cache import LONGEST_UNUSED, MAXIMUM_BYTES, PROGRAM, entries
    from ppafo.engine.loading import compilers_to_try

    kept = [] if folder is None else entries(folder)
    programs = [entry for entry in kept if entry.path.name.startswith(PROGRAM)]
    now = time.time()
    size = sum(program.size for program in programs)
    document: dict[str, Any] = {
        "compilers": [compiler.name for compiler in compilers_to_try()],
        "folder": None if folder is None else str(folder),
        "not_used": why_not or None,
        "size": size,
        "made_from_programs": sum(entry.size for entry in kept) - size,
        "kept_unused_days": LONGEST_UNUSED / _DAY,
        "most_bytes": MAXIMUM_BYTES,
        "programs": [
            {"name": program.path.name, "size": program.size, "unused_days": max(0.0, (now - program.used) / _DAY)}
            for program in programs
        ],
        **freed,
    }
    lines = [f"compilers: {', '.join(document['compilers'])}", f"folder: {document['folder'] or 'none'}"]
    if document["not_used"]:
        lines.append(f"not used: {document['not_used']}")
    if "freed" in document:
        lines.append(f"removed: {_megabytes(document['freed'])}")
    lines.append(f"programs: {len(document['programs'])}, {_megabytes(document['size'])}")
    if document["made_from_programs"]:
        lines.append(f"texts of programs and their forms for pages: {_megabytes(document['made_from_programs'])}")
    for item in document["programs"] if one_by_one else ():
        days = item["unused_days"]
        # One day or several by the number as it is shown, which is rounded.
        ago = "today" if days < 1.0 else f"{days:.0f} day{'' if int(days + 0.5) == 1 else 's'} ago"
        lines.append(f"  {item['name']}  {_megabytes(item['size']):>8}  last used {ago}")
    limits = f"{document['kept_unused_days']:.0f} days unused, or above {_megabytes(document['most_bytes'])} in all"
    return CommandOutput("\n".join([*lines, f"removed automatically: after {limits}"]), document, "doctor")


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.1f} MB"
