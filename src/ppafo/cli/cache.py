"""``ppafo cache``: the compiled models on this computer: where they are, how much they take, compile, remove."""

import argparse
import time
from pathlib import Path
from typing import Any

from ppafo.cli import output
from ppafo.errors import SimulationError

_DAY = 86400.0


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    orders = parser.add_mutually_exclusive_group()
    orders.add_argument("--warm", action="store_true", help="compile the models of the scenarios of the package")
    orders.add_argument("--clear", action="store_true", help="remove all compiled models, and try each compiler again")
    output.add_output_arguments(parser)


def run(parsed: argparse.Namespace) -> int:
    """Compile or remove programs as requested, and list what is there."""
    from ppafo.engine.cache import cache_folder, clear, clear_kept, refusal

    output.check_output(parsed)
    folder = cache_folder()
    cleared = clear_kept(folder) + clear(folder) if parsed.clear and folder is not None else 0
    why_not = "" if parsed.clear else refusal(folder)
    if parsed.warm:
        if why_not:
            raise SimulationError(f"--warm: compiled models cannot be kept: {why_not}")
        from ppafo.simulation.loading import list_scenarios, load_scenario
        from ppafo.simulation.simulate import compile_models

        compile_models(load_scenario(name) for name in list_scenarios())
    document = _document(folder, why_not) | ({"freed": cleared} if parsed.clear else {})
    lines = [f"folder: {document['folder'] or 'none'}"]
    if document["not_used"]:
        lines.append(f"not used: {document['not_used']}")
    if "freed" in document:
        lines.append(f"removed: {_megabytes(document['freed'])}")
    lines.append(f"programs: {len(document['programs'])}, {_megabytes(document['size'])}")
    if document["made_from_programs"]:
        lines.append(f"texts of programs and their forms for pages: {_megabytes(document['made_from_programs'])}")
    lines += [
        f"  {item['name']}  {_megabytes(item['size']):>8}  last used {_days(item['unused_days'])}"
        for item in document["programs"]
    ]
    lines += [f"left out for a day: {name}: {why}" for name, why in document["left_out"].items()]
    limits = f"{document['kept_unused_days']:.0f} days unused, or above {_megabytes(document['most_bytes'])} in all"
    output.deliver("cache", "\n".join([*lines, f"removed by themselves: after {limits}"]), document, parsed)
    return output.EXIT_GOOD


def _document(folder: Path | None, why_not: str) -> dict[str, Any]:
    from ppafo.engine.cache import LONGEST_UNUSED, MAXIMUM_BYTES, kept_sizes, list_left_out, list_programs

    programs = [] if folder is None else list_programs(folder)
    now = time.time()
    return {
        "folder": None if folder is None else str(folder),
        "not_used": why_not or None,
        "size": sum(program.size for program in programs),
        "made_from_programs": 0 if folder is None else sum(kept_sizes(folder)),
        "left_out": {} if folder is None else list_left_out(folder),
        "kept_unused_days": LONGEST_UNUSED / _DAY,
        "most_bytes": MAXIMUM_BYTES,
        "programs": [
            {"name": program.place.name, "size": program.size, "unused_days": max(0.0, (now - program.used) / _DAY)}
            for program in programs
        ],
    }


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.1f} MB"


def _days(days: float) -> str:
    return "today" if days < 1.0 else f"{days:.0f} day{'' if int(days + 0.5) == 1 else 's'} ago"
