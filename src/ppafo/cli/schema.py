"""``ppafo schema NAME``: the JSON Schema of a file format, for editors and other programs."""

import argparse
import importlib

from ppafo.cli import output
from ppafo.errors import DataError, nearest_name

FORMATS: dict[str, str] = {
    "parameters": "ppafo.parameters.loading",
    "scenario": "ppafo.loading",
    "study": "ppafo.studies.declaration",
    "tuning": "ppafo.questions.tune.problem",
    "parts": "ppafo.parameters.parts.catalogue",
    "design": "ppafo.questions.design.loading",
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


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("format", metavar="NAME", help=f"one of: {', '.join(FORMATS)}")
    output.add_output_arguments(parser)


def run(parsed: argparse.Namespace) -> int:
    """Print the schema, which is JSON with or without ``--json``."""
    if parsed.format in JOINED:
        raise DataError(f"the format '{parsed.format}' is now part of '{JOINED[parsed.format]}'; print that one")
    if parsed.format not in FORMATS:
        hint = nearest_name(parsed.format, FORMATS)
        raise DataError(f"there is no file format '{parsed.format}'{hint}; available: {', '.join(FORMATS)}")
    output.check_output(parsed)
    document = importlib.import_module(FORMATS[parsed.format]).json_schema()
    parsed.json = True
    output.deliver(f"{parsed.format}.schema", "", document, parsed)
    return output.EXIT_GOOD
