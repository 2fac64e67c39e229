"""Tools: a scenario or a walk for other programs and boards, and what this computer has."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Literal

from ppafo.cli.arguments import (
    Count,
    File,
    Folder,
    Gait,
    Mass,
    Minutes,
    Name,
    Overrides,
    Patience,
    Port,
    Scenario,
    Word,
    counting_number,
    times,
)

if TYPE_CHECKING:
    from ppafo.cli.output import Said

Interface = Annotated[
    Literal["loop", "plant"],
    Word(
        "{loop,plant}",
        help="the closed loop, or the plant alone under a command and the motion of its ankle; default loop",
    ),
]
Strikes = Annotated["tuple[float, ...]", Word("T1,T2,...", times)]


def export_c(scenario: Scenario, *, interface: Interface = "loop", overrides: Overrides = (), out: Folder) -> Said:
    """Write a scenario or a walk as a library in C: header, source, example, make files.

    out: the folder to write
    """
    from ppafo.cli.output import export
    from ppafo.exports.c_library import c_library
    from ppafo.exports.c_library.plant import plant_library
    from ppafo.loading import load_scenario

    library = {"loop": c_library, "plant": plant_library}[interface]
    following = f"make -C {shlex.quote(str(out))} check"
    return export(out, "export c", lambda: library(load_scenario(scenario, overrides)), lambda _: following)


def export_controller(scenario: Scenario, *, overrides: Overrides = (), out: Folder) -> Said:
    """Write a scenario's integer controller in C behind the protocol of 'ppafo hil'.

    scenario: name of a scenario, or a .toml file
    out: the folder to write
    """
    from ppafo.cli.output import export
    from ppafo.exports.hil.run import example_controller
    from ppafo.simulation.loading import load_scenario

    return export(
        out,
        "export controller",
        lambda: example_controller(load_scenario(scenario, overrides)),
        lambda _: f"make -C {shlex.quote(str(out))}",
    )


def export_firmware(
    scenarios: Sequence[Scenario] = (),
    *,
    target: Name | None = None,
    try_: bool = False,
    samples: Count | None = None,
    table: bool = False,
    overrides: Overrides = (),
    out: Folder | None = None,
) -> Said:
    """Write the controller of a scenario as firmware for a small processor, or run it on the simulator of that one.

    scenarios: name of a scenario, or a .toml file; with --try several
    target: the processor: msp430f2013 (default), cortex-m0 or cortex-m4; with --table all of them
    try_: run the scenario with its controller on the simulator of the processor, and compare every decision
    samples: with --try: compare N drawn samples with the integer controller instead, with edges, jumps and sensor
        faults
    table: with --try: compare every integer controller on every target instead (with 1000 samples each)
    out: the folder to write; with --try text, JSON and figure
    """
    from ppafo.cli.firmware import firmware_of, try_firmware

    if try_ or table or samples is not None:
        return try_firmware(scenarios, target, samples, table, overrides, out)
    return firmware_of(scenarios, target, overrides, out)


def export_fmu(
    scenario: Scenario,
    *,
    fmi: Literal["2", "3"] = "2",
    interface: Interface = "loop",
    platforms: Annotated[str, Word("LIST")] | None = None,
    overrides: Overrides = (),
    out: Folder,
) -> Said:
    """Write a scenario or a walk as a functional mock-up unit (FMU).

    fmi: version of FMI; default 2
    platforms: what it is to run on, separated by commas: linux64, win64, ...; default: this computer
    out: the folder to write
    """
    from ppafo.cli.output import export
    from ppafo.exports.fmu import closed_loop, functional_unit, host_platform, plant_alone
    from ppafo.loading import load_scenario

    made = {"loop": closed_loop, "plant": plant_alone}[interface]
    chosen = [host_platform()] if platforms is None else platforms.split(",")
    wanted = list(dict.fromkeys(one.strip() for one in chosen if one is not None))
    return export(
        out,
        "export fmu",
        lambda: functional_unit(made(load_scenario(scenario, overrides)), int(fmi), wanted),
        lambda files: f"fmpy simulate {shlex.quote(str(out / files[0]))} --show-plot",
    )


def export_opensim(
    walk: Annotated[str, Word("WALK")],
    *,
    gait: Gait | None = None,
    minutes: Minutes | None = None,
    side: Literal["right", "left"] = "right",
    strikes: Strikes | None = None,
    body_mass: Mass | None = None,
    overrides: Overrides = (),
    out: Folder,
) -> Said:
    """Write a walk, a recording or a result in the names and signs of OpenSim (.sto).

    walk: name of a walk, or a .toml file; or a recording (.csv, .nc) or result folder
    gait: of a walk: name of a gait, or a gait file
    minutes: of a walk: time to walk; default: all of a course, else 0.2
    side: which foot; default right
    strikes: of a walk: heel strikes of your motion [s], to put the mean stride of the torque on
        (--strikes=-0.4,0.8 where time begins below 0); default: the walk as it is, from 0 s on
    body_mass: of a recording: for moments and forces per mass, such as '62 kg'
    out: the folder to write
    """
    from ppafo.cli.opensim import opensim_tables

    return opensim_tables(walk, gait, minutes, side, strikes, body_mass, overrides, out)


def export_figure(folder: Folder, *, out: File | None = None) -> Said:
    """Redraw the figures of a result folder.

    folder: a result folder written by ppafo
    out: a .png, .svg or .pdf file; default figure.png and figure.svg in DIR
    """
    from ppafo.cli.figure import draw_again

    return draw_again(folder, out)


def hil(
    scenario: Scenario,
    *,
    port: Port,
    rate: Annotated[int, Word("HZ", counting_number)] = 1000,
    baud: Count = 921600,
    lock_step: bool = False,
    patience: Patience = 10.0,
    overrides: Overrides = (),
    out: Folder | None = None,
) -> Said:
    """Run a scenario's plant in real time against a controller at a serial port or over UDP.

    scenario: name of a scenario, or a .toml file
    port: where the controller is: udp:HOST:PORT or serial:DEVICE (extra 'hil')
    rate: samples per second, 50 to 2000; default 1000
    baud: bits per second of a serial line; default 921600
    lock_step: wait for each answer instead of for the clock, at most a second: the same run every time
    patience: how long the controller is called; default '10 s'
    out: result folder; default out/NAME-hil of the scenario
    """
    from ppafo.cli.hil import Wire, run_hardware

    return run_hardware(scenario, Wire(port, rate, baud, lock_step, patience), overrides, out)


def doctor(*, warm: bool = False, clear: bool = False, schema: Name | None = None) -> Said:
    """Show compilers and compiled models of this computer; print the JSON Schema of a file format.

    warm: compile the models of the scenarios of the package
    clear: remove all compiled models, and try each compiler again
    schema: print the JSON Schema of a file format instead, such as scenario
    """
    from ppafo.cli.doctor import examine, schema_of

    return examine(warm, clear) if schema is None else schema_of(schema)
