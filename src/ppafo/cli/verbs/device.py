"""Your device: files to start from, runs, the page that simulates, parameter sets and parts."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ppafo.cli.arguments import File, Folder, Name, Overrides, Scenario, Word

if TYPE_CHECKING:
    from ppafo.cli.output import Said
    from ppafo.questions.parts.solve import Parts

Set = Annotated[str, Word("SET", help="name of a parameter set, or a .toml file")]


def new(
    kind: Annotated[str, Word("KIND")],
    name: Name | None = None,
    *,
    source: Annotated[str, Word("SOURCE", option="--from")] | None = None,
    out: File | None = None,
) -> Said:
    """Write an input file to start from: a template, or a copy of a shipped one; or the files of an example.

    kind: scenario, set, study, walk, course, gait-map, bottle, parts, or example: the files of a how-to page
    name: name of the file and of what it describes; of an example, its name; without it, the examples are listed
    source: copy this one: a shipped name, or a .toml file
    out: the .toml file to write, default NAME.toml; of an example, the new folder, default NAME
    """
    from ppafo.cli.new import begin

    return begin(kind, name, source, out)


def simulate(scenario: Scenario, *, check: bool = False, overrides: Overrides = (), out: Folder | None = None) -> Said:
    """Run a scenario and write its recording, metrics and figure.

    check: run again with finer steps and from a start moved by 1e-7, and report which metrics can be repeated
    out: result folder with the report; default out/NAME of the scenario
    """
    from ppafo.cli.simulate import simulate_scenario

    return simulate_scenario(scenario, check, overrides, out)


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


def sets_show(name: Set, *, overrides: Overrides = ()) -> Said:
    """Show every value of a parameter set with its source."""
    from ppafo.cli.sets import show_set

    return show_set(name, overrides)


def sets_audit(
    names: Sequence[Set], *, parent: Set | None = None, all_: bool = False, overrides: Overrides = ()
) -> Said:
    """Check a parameter set for contradictions.

    names: name of a set, or a .toml file; several are shown side by side
    parent: show what changed against this set, in place of the one that the file names
    all_: print what concerns no changed value too, of a set with a parent or --set
    """
    from ppafo.cli.audit import audit_sets

    return audit_sets(names, parent, all_, overrides)


def sets_parts(
    part: Annotated[str, Word("PART")] | None = None, *, catalogue: Annotated[str | Path, Word("FILE")] = "parts"
) -> Parts:
    """List real parts with the origin of every figure.

    part: name of a part, for all its figures and their sources
    catalogue: a .toml file; default: the catalogue of the package
    """
    from ppafo.questions.parts.solve import parts

    return parts(part, catalogue)
