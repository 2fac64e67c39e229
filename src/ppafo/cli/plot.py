"""``ppafo plot DIR``: draws a saved result again, without running it again."""

import argparse
from pathlib import Path

from ppafo.cli.output import EXIT_GOOD, add_json_argument, check_new_file, print_result
from ppafo.errors import DataError


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("folder", metavar="DIR", type=Path, help="a result folder")
    add_json_argument(parser)
    parser.add_argument(
        "--out", metavar="FILE", type=Path, help="a .png, .svg or .pdf file; default figure.png and figure.svg in DIR"
    )


def run(parsed: argparse.Namespace) -> int:
    """Draw the figure and write it."""
    from ppafo.reporting.figures import FIGURE_FORMATS, figure_files, stored_figure
    from ppafo.reporting.style import rendered
    from ppafo.storage import read_result
    from ppafo.storage.files import write_file

    if parsed.out is not None and parsed.out.suffix.removeprefix(".") not in FIGURE_FORMATS:
        allowed = ", ".join(f".{name}" for name in FIGURE_FORMATS)
        raise DataError(f"--out {parsed.out}: the name must end in one of {allowed}")
    if parsed.out is not None:
        check_new_file(parsed.out)
    figure = stored_figure(read_result(parsed.folder))
    if parsed.out is None:
        contents = {parsed.folder / name: content for name, content in figure_files(figure).items()}
    else:
        (content,) = rendered(figure, [parsed.out.suffix.removeprefix(".")]).values()
        contents = {parsed.out: content}
    written = [str(write_file(path, content)) for path, content in contents.items()]
    print_result(f"written: {', '.join(written)}", {"files": written}, parsed.json)
    return EXIT_GOOD
