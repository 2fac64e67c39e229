"""``ppafo walk``: a wearer walks with the device, without it, and as the healthy gait would have it."""

import argparse
import re
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from ppafo.cli.output import (
    EXIT_CHECK_FAILED,
    EXIT_GOOD,
    add_json_argument,
    add_override_argument,
    named_option,
    print_result,
    tell,
)
from ppafo.cli.quick_imports import load_compiler, load_drawing
from ppafo.errors import ScenarioError

if TYPE_CHECKING:
    from ppafo.studies.endurance import Endurance
    from ppafo.walking import Comparison, Configuration
    from ppafo.walking.population import Population

DEFAULT_CONFIGURATION = "solenoid"
_NUMBER = re.compile(r"[+-]?((\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|nan|inf)", re.ASCII)
_LONG = 12.0
"""Minutes above which progress is told."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument(
        "--config",
        metavar="NAME",
        default=DEFAULT_CONFIGURATION,
        help=f"name of a walk configuration, or a .toml file; default {DEFAULT_CONFIGURATION}",
    )
    parser.add_argument("--gait", metavar="GAIT", help="name of a gait, or a gait file; that of the configuration else")
    parser.add_argument("--minutes", metavar="N", default="1", help="how long to walk; default 1")
    parser.add_argument("--wearers", metavar="N", help="walk with so many different wearers instead of one")
    parser.add_argument("--seed", metavar="N", default="1", help="seed of the wearers; default 1")
    add_override_argument(parser)
    parser.add_argument("--list", action="store_true", help="list the walk configurations that come with the package")
    add_json_argument(parser)
    parser.add_argument("--out", metavar="DIR", type=Path, help="folder; default out/walk-NAME of the configuration")


def run(parsed: argparse.Namespace) -> int:
    """Walk and say what came of it; 1 where a walk diverged."""
    if parsed.list:
        return _list(parsed)
    from ppafo.walking.loading import load_walk

    minutes = minutes_of(parsed.minutes)
    configuration = load_walk(parsed.config, parsed.overrides, parsed.gait)
    if parsed.wearers is not None:
        return _many(configuration, minutes, parsed)
    return _one(configuration, minutes, parsed)


def _one(configuration: "Configuration", minutes: float, parsed: argparse.Namespace) -> int:
    load_compiler()
    from ppafo.storage.owned_folder import check_owned_folder, write_owned_folder
    from ppafo.walking.comparison import compare_walks
    from ppafo.walking.walk import checked_seconds

    load_drawing()
    from ppafo.reporting.walk_files import WALK_FOLDER, walk_document, walk_files
    from ppafo.studies.endurance.of_walk import endurance_of_walk

    folder = parsed.out if parsed.out is not None else Path("out") / f"walk-{configuration.name}"
    checked_seconds(configuration, minutes)
    with named_option():
        check_owned_folder(folder, WALK_FOLDER)
    comparison = compare_walks(configuration, minutes, _progress)
    if minutes > _LONG:
        tell("drawing and writing")
    life = endurance_of_walk(comparison.with_device)
    files = walk_files(comparison, life)
    write_owned_folder(folder, files, WALK_FOLDER)
    document = walk_document(comparison, life) | {"folder": str(folder), "files": sorted(files)}
    print_result("\n".join(_lines(comparison, life, folder, sorted(files))), document, parsed.json)
    return _exit_code(comparison)


def _progress(done: float, total: float) -> None:
    if total > _LONG:
        tell(f"walked {done:.0f} of {total:.0f} min")


def _lines(comparison: "Comparison", life: "Endurance | None", folder: Path, files: list[str]) -> list[str]:
    from ppafo.reporting.walk_table import bottle_sentence, safety_sentence, walk_table

    result = comparison.with_device
    strides = f"{result.metrics['strides'].value:.0f} strides" if "strides" in result.metrics else "no strides"
    head = f"{result.configuration.name}: {result.status.kind}, {strides} of {result.configuration.gait.name}"
    safety = safety_sentence(comparison)
    bottle = bottle_sentence(life)
    remarks = [line for remark in (bottle, safety) if remark for line in ("", remark)]
    return [head, "", *walk_table(comparison), *remarks, "", f"written: {folder} ({', '.join(files)})"]


def _exit_code(comparison: "Comparison") -> int:
    if comparison.is_completed:
        return EXIT_GOOD
    for result in (comparison.with_device, comparison.without_device):
        if not result.status.is_completed:
            print(f"ppafo: {result.configuration.name}: {result.status.message}", file=sys.stderr)
    return EXIT_CHECK_FAILED


def _many(configuration: "Configuration", minutes: float, parsed: argparse.Namespace) -> int:
    load_compiler()
    from ppafo.storage.owned_folder import check_owned_folder, write_owned_folder
    from ppafo.walking.population import walk_population

    load_drawing()
    from ppafo.reporting.population_files import POPULATION_FOLDER, population_document, population_files

    count = _whole("--wearers", parsed.wearers)
    seed = _whole("--seed", parsed.seed)
    folder = parsed.out if parsed.out is not None else Path("out") / f"wearers-{configuration.name}"
    with named_option():
        check_owned_folder(folder, POPULATION_FOLDER)
    population = walk_population(configuration, minutes, count, seed, _walked)
    files = population_files(population)
    write_owned_folder(folder, files, POPULATION_FOLDER)
    document = population_document(population) | {"folder": str(folder), "files": sorted(files)}
    print_result("\n".join(_population_lines(population, folder, sorted(files))), document, parsed.json)
    if not population.diverged:
        return EXIT_GOOD
    print(f"ppafo: {configuration.name}: {population.message}", file=sys.stderr)
    return EXIT_CHECK_FAILED


def _walked(done: float, total: float) -> None:
    if done < total:
        tell(f"{done:.0f} of {total:.0f} wearers have walked")


def _population_lines(population: "Population", folder: Path, files: list[str]) -> list[str]:
    from ppafo.reporting.population_table import population_table

    return [*population_table(population), "", f"written: {folder} ({', '.join(files)})"]


def _list(parsed: argparse.Namespace) -> int:
    from ppafo.walking.loading import list_walks, load_walk

    summaries = {name: load_walk(name).description for name in list_walks()}
    width = max(len(name) for name in summaries)
    text = "\n".join(f"{name:<{width}}  {summary}" for name, summary in summaries.items())
    document = {"walks": [{"name": name, "description": summary} for name, summary in summaries.items()]}
    print_result(text, document, parsed.json)
    return EXIT_GOOD


def minutes_of(text: str) -> float:
    """Return minutes from a number or a time with its unit; ScenarioError for anything else."""
    from ppafo.errors import UnitError
    from ppafo.units import parse_quantity

    try:
        minutes = float(text) if _NUMBER.fullmatch(text) else parse_quantity(text, "s") / 60.0
    except UnitError as error:
        raise ScenarioError(f"--minutes {text!r}: a number of minutes, or a time such as '90 s'; {error}") from error
    return minutes


def _whole(option: str, text: str) -> int:
    if not (text.isascii() and text.isdigit() and len(text) < 10):
        raise ScenarioError(f"{option} {text!r} is not a whole number, such as 1000")
    return int(text)
