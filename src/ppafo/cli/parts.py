"""``ppafo parts``: the catalogue of parts, each figure with where it comes from, and what is not known."""

import argparse

from ppafo.cli.output import EXIT_GOOD, add_output_arguments, check_output, deliver


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("part", metavar="PART", nargs="?", help="name of one part, to see all that is known of it")
    parser.add_argument("--catalogue", metavar="FILE", default="parts", help="a .toml file; the package's unless given")
    add_output_arguments(parser)


def run(parsed: argparse.Namespace) -> int:
    """List the parts, or show one."""
    from ppafo.errors import ParameterError, nearest_name
    from ppafo.parameters.parts import load_catalogue
    from ppafo.reporting.parts_table import part_lines, parts_document, parts_lines

    check_output(parsed)
    catalogue = load_catalogue(parsed.catalogue)
    if parsed.part is None:
        deliver("parts", "\n".join(parts_lines(catalogue)), parts_document(catalogue, catalogue.parts), parsed)
        return EXIT_GOOD
    chosen = [part for part in catalogue.parts if part.name == parsed.part]
    if not chosen:
        names = [part.name for part in catalogue.parts]
        raise ParameterError(
            f"{catalogue.file}: there is no part '{parsed.part}'{nearest_name(parsed.part, names)}; "
            f"there are {', '.join(names)}"
        )
    deliver(parsed.part, "\n".join(part_lines(chosen[0])), parts_document(catalogue, chosen), parsed)
    return EXIT_GOOD
