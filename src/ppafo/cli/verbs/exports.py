"""Export commands for a scenario or walk: C library, and functional mock-up unit."""

from __future__ import annotations

import shlex
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from ppafo.arguments import Folder, Overrides, Scenario, Word

if TYPE_CHECKING:
    from ppafo.cli.output import CommandOutput

Interface = Annotated[
    Literal["loop", "plant"],
    Word(
        "{loop,plant}",
        help="the closed loop, or the plant alone under a command and the motion of its ankle; default loop",
    ),
]


def export_c(
    scenario: Scenario, *, interface: Interface = "loop", overrides: Overrides = (), out: Folder
) -> CommandOutput:
    """Write a scenario or a walk as a library in C: header, source, example, make files.

    out: the folder to write

    >>> print(export_c("step-response", out=Path("library")).text)
    written: library (CMakeLists.txt, LICENSE, Makefile, README.md, check.c, main.c, step_response.c, step_response.h,
    expected.csv); next: make -C library check
    """
    from ppafo.cli.output import export
    from ppafo.exports.c_library import c_library
    from ppafo.exports.c_library.plant import plant_library
    from ppafo.loading import load_scenario

    library_of = {"loop": c_library, "plant": plant_library}[interface]
    next_step = f"make -C {shlex.quote(str(out))} check"
    return export(out, "export c", lambda: library_of(load_scenario(scenario, overrides)), lambda _files: next_step)


def export_fmu(
    scenario: Scenario,
    *,
    fmi: Literal["2", "3"] = "2",
    interface: Interface = "loop",
    platforms: Annotated[str, Word("LIST")] | None = None,
    overrides: Overrides = (),
    out: Folder,
) -> CommandOutput:
    """Write a scenario or a walk as a functional mock-up unit (FMU).

    fmi: version of FMI; default 2
    platforms: what it is to run on, separated by commas: linux64, win64, ...; default: this computer
    out: the folder to write, or the unit itself: a name that ends in .fmu

    >>> print(export_fmu("step-response", out=Path("step.fmu")).text.splitlines()[0])
    written: step.fmu; next: fmpy simulate step.fmu --output-file step.csv
    """
    from ppafo.cli.output import export, export_file
    from ppafo.exports.fmu.interface import closed_loop, plant_alone
    from ppafo.exports.fmu.platforms import host_platform
    from ppafo.exports.fmu.unit import functional_unit
    from ppafo.loading import load_scenario

    interface_of = {"loop": closed_loop, "plant": plant_alone}[interface]
    names = [host_platform()] if platforms is None else platforms.split(",")
    # None is a computer that no platform of FMI stands for: its unit has sources alone.
    chosen = list(dict.fromkeys(name.strip() for name in names if name is not None))

    def unit() -> Mapping[str, bytes]:
        return functional_unit(interface_of(load_scenario(scenario, overrides)), int(fmi), chosen)

    def next_step(file: Path) -> str:
        # Without --show-plot, which needs packages that FMPy does not install.
        table = file.with_suffix(".csv").name
        return f"fmpy simulate {shlex.quote(str(file))} --output-file {shlex.quote(table)}"

    # A folder may be named like a unit too; it then gets the unit among its files.
    if out.suffix == ".fmu" and not out.is_dir():
        said = export_file(out, lambda: next(iter(unit().values())), next_step(out))
    else:
        said = export(out, "export fmu", unit, lambda files: next_step(out / files[0]))
    compared = [name for name in chosen if name == host_platform()]
    not_run = [name for name in chosen if name not in compared]
    lines = [said.text]
    if compared:
        lines.append(
            f"{', '.join(compared)}: outputs compared with Python, to the bit; 'pip install fmpy' gives the command "
            "fmpy, whose 'info' lists the variables"
        )
    if not_run:
        lines.append(
            f"not compared with Python, since they cannot run on this computer: libraries for {', '.join(not_run)}"
        )
    elif not compared:
        lines.append("not compared with Python, since an FMU of sources only cannot run")
    document = {**said.document, "compared": compared, "not_run": not_run}
    return replace(said, text="\n".join(lines), document=document)
