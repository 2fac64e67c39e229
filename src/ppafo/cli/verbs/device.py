"""Your device: files to start from, runs, the page that simulates, parameter sets and parts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ppafo.cli.arguments import File, Overrides, Scenario, Word

if TYPE_CHECKING:
    from ppafo.cli.output import Said
    from ppafo.questions.parts.solve import Parts


def workbench(
    scenarios: Sequence[Scenario] = (), *, overrides: Overrides = (), out: File = Path("out/workbench.html")
) -> Said:
    """Write scenarios as one page that simulates them while sliders are dragged.

    scenarios: names of scenarios and walks, or .toml files; default: the torque task, step response and a walk
    out: the page to write; default out/workbench.html
    """
    from ppafo.cli.output import Said, check_new_file
    from ppafo.live.page import is_page
    from ppafo.live.workbench import DEFAULT, workbench
    from ppafo.storage.files import write_file

    if not is_page(out):
        check_new_file(out)
    names = list(scenarios) or list(DEFAULT)
    page = workbench(names, overrides)
    write_file(out, page)
    document = {"file": str(out), "bytes": len(page), "scenarios": names}
    return Said(f"written: {out} ({len(page) / 1e3:.0f} kB, {', '.join(names)})", document)


def sets_list() -> Said:
    """List the parameter sets that come with the package."""
    from ppafo.cli.output import listing
    from ppafo.parameters import list_sets, load_parameter_set

    sets = [load_parameter_set(name) for name in list_sets()]
    rows = [{"name": item.name, "title": item.title, "valves": dict(item.valve_kinds)} for item in sets]
    return listing("set", rows, ("name", "title"))


def sets_parts(
    part: Annotated[str, Word("PART")] | None = None, *, catalogue: Annotated[str | Path, Word("FILE")] = "parts"
) -> Parts:
    """List real parts with the origin of every figure.

    part: name of a part, for all its figures and their sources
    catalogue: a .toml file; default: the catalogue of the package
    """
    from ppafo.questions.parts.solve import parts

    return parts(part, catalogue)
