"""``ppafo doctor``: compilers, compiled models and bits of this computer, schemas of files."""

import importlib

from ppafo.cli.arguments import Name
from ppafo.cli.output import EXIT_CHECK_FAILED, EXIT_GOOD, Said
from ppafo.documents.json_text import json_text
from ppafo.errors import DataError, SimulationError, nearest_name

FORMATS: dict[str, str] = {
    "parameters": "ppafo.parameters.loading",
    "scenario": "ppafo.loading",
    "study": "ppafo.studies.declaration",
    "tuning": "ppafo.analyses.tune.problem",
    "parts": "ppafo.parameters.parts.catalogue",
    "design": "ppafo.analyses.design.loading",
    "walk": "ppafo.walking.declaration",
    "course": "ppafo.walking.course",
    "identification": "ppafo.identification.problem",
    "columns": "ppafo.storage.foreign",
    "rig": "ppafo.rig.preset",
    "gait": "ppafo.gait.document",
    "gait-map": "ppafo.gait.recorded.mapping",
    "bottle": "ppafo.parameters.bottles.bottle",
    "publication": "ppafo.parameters.publications.publication",
}
"""Each file format and the module whose ``json_schema()`` describes it. To add one: one line here."""

JOINED: dict[str, str] = {"size": "design"}
"""Formats that are now part of another one."""


def _schema_of(name: str) -> Said:
    """Return the schema of a file format, which is JSON in any case."""
    if name in JOINED:
        raise DataError(f"the format '{name}' is now part of '{JOINED[name]}'; print that one")
    if name not in FORMATS:
        hint = nearest_name(name, FORMATS)
        raise DataError(f"there is no file format '{name}'{hint}; available: {', '.join(FORMATS)}")
    document = importlib.import_module(FORMATS[name]).json_schema()
    return Said(json_text(document), document, f"{name}.schema")


def doctor(
    *,
    warm: bool = False,
    clear: bool = False,
    bits: bool = False,
    schema: Name | None = None,
) -> Said:
    """Show compilers and compiled models of this computer, check its bits; print the schema of a file.

    Exit code 1 where a run has other bits than on every other computer.

    warm: compile the models of the scenarios of the package
    clear: remove all compiled models, and try each compiler again
    bits: run each scenario and walk of the package for a moment, and compare every bit with those it has elsewhere
    schema: print the JSON Schema of a file format instead, such as scenario
    """
    from ppafo.engine import cache
    from ppafo.engine.kept_models import models_document, models_text

    asked = {"--warm": warm, "--clear": clear, "--bits": bits, "--schema": schema}
    given = [option for option, value in asked.items() if value]
    if len(given) > 1:
        raise DataError(f"{given[1]}: not allowed with {given[0]}")
    if schema is not None:
        return _schema_of(schema)
    if bits:
        return _bits()
    folder = cache.cache_folder()
    cleared = cache.clear_kept(folder) + cache.clear(folder) if clear and folder is not None else 0
    why_not = "" if clear else cache.refusal(folder)
    if warm:
        if why_not:
            raise SimulationError(f"--warm: compiled models cannot be kept: {why_not}")
        from ppafo.simulation.loading import list_scenarios, load_scenario
        from ppafo.simulation.simulate import compile_models

        compile_models(load_scenario(name) for name in list_scenarios())
    document = models_document(folder, why_not) | ({"freed": cleared} if clear else {})
    return Said(models_text(document), document, "doctor")


def _bits() -> Said:
    """Return which runs have their golden bits here."""
    from ppafo.engine.loading import compilers_to_try
    from ppafo.golden_bits import found_bits

    found = dict(found_bits())
    others = [name for name, is_equal in found.items() if not is_equal]
    by = compilers_to_try()[0].name
    text = f"bits: {len(found) - len(others)} of {len(found)} runs have the bits that they have elsewhere ({by})"
    lines = [
        text,
        *(f"  {name}: other bits; give its scenario, this computer and compiler in a report" for name in others),
    ]
    return Said(
        "\n".join(lines), {"compiler": by, "same_bits": found}, "bits", EXIT_CHECK_FAILED if others else EXIT_GOOD
    )
