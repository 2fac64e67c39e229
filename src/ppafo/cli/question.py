"""The one runner of questions: arguments in, solved with progress on the side, answered as text, JSON and folder."""

import argparse
import inspect
import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from ppafo.cli import output
from ppafo.documents.toml_text import TomlKind
from ppafo.progress import ProgressLine
from ppafo.questions.question import Question, load_name


def add_arguments(parser: argparse.ArgumentParser, question: Question) -> None:
    """Add the arguments of a question and of every command."""
    for argument in question.arguments:
        argument.add_to(parser)
    if question.library:
        parser.add_argument("--list", action="store_true", help="list the files that come with the package")
    if question.fills_folder:
        output.add_json_argument(parser)
    else:
        output.add_output_arguments(parser, "one in out/ named after what ran" if question.default_folder else "")


def run(parsed: argparse.Namespace, question: Question) -> int:
    """Solve, print and write; 1 where the answer has not passed."""
    if question.library:
        library = load_name(question.library)
        if parsed.list:
            from ppafo.answers.writing import align_columns

            listed: list[dict[str, Any]] = (
                load_name(question.listing)() if question.listing else _words_of_files(library)
            )
            rows = [
                [f"{value:,} {key}" if isinstance(value, int) else value for key, value in item.items()]
                for item in listed
            ]
            rows = rows if question.listing else [[row[0], row[-1]] for row in rows]
            plural = f"{library.noun[:-1]}ies" if library.noun.endswith("y") else f"{library.noun}s"
            output.print_result("\n".join(align_columns(rows, len(rows[0]))), {plural: listed}, parsed.json)
            return output.EXIT_GOOD
        # Refuse a command without its file, which only ``--list`` does without.
        for argument in question.arguments:
            stands_in = any(getattr(parsed, name) is not None for name in question.instead_of_file)
            if argument.nargs == "?" and getattr(parsed, argument.parameter) is None and not stands_in:
                names, options = ", ".join(library.names()), ", ".join(f"--{name}" for name in question.instead_of_file)
                raise library.error(
                    f"no {library.noun} was given: name one ({names}) or give a .toml file"
                    f"{f', or state what is wanted by {options}' if options else ''}"
                )
    solve = question.solver()
    values = {argument.parameter: getattr(parsed, argument.parameter) for argument in question.arguments}
    if question.fills_folder:
        output.load_drawing()
    else:
        if parsed.out is None and question.default_folder:
            parsed.out = load_name(question.default_folder)(values)
        output.check_output(parsed)
    with progress_line() as progress:
        if "progress" in inspect.signature(solve).parameters:
            values["progress"] = progress
        solved = solve(**values).answer()
    if question.fills_folder:
        return output.deliver_answer(solved, parsed, filled=solved.data["folder"])
    return output.deliver_answer(solved, parsed)


@contextmanager
def progress_line() -> Iterator[ProgressLine]:
    """Show progress on the side for the length of a ``with`` block; what is logged begins on a line of its own."""
    line = ProgressLine(sys.stderr)
    logger = logging.getLogger("ppafo")

    def end_line(_record: logging.LogRecord) -> bool:
        line.close()
        return True

    logger.addFilter(end_line)
    try:
        yield line
    finally:
        logger.removeFilter(end_line)
        line.close()


def _words_of_files(library: TomlKind) -> list[dict[str, Any]]:
    """Return the name of each file, and its description or else its title."""
    files = {name: library.parse(library.read(name), name) for name in library.names()}
    return [
        {"name": name} | {key: str(file[key]) for key in ("title", "description") if key in file}
        for name, file in files.items()
    ]
