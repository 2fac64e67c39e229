"""Command functions: typed and documented, with implementations imported only when called."""

from __future__ import annotations

import shlex
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

from ppafo.arguments import (
    Angle,
    BodyMass,
    Count,
    File,
    Folder,
    Frequency,
    Gait,
    Length,
    Name,
    Overrides,
    Scenario,
    SetName,
    Speed,
    Time,
    Whole,
    Word,
)
from ppafo.cli.output import CommandOutput, blame_out_option, check_new_file, export, listing

if TYPE_CHECKING:
    from ppafo.gait.finding import GaitFound
    from ppafo.report.finding import Finding

Interface = Annotated[
    Literal["loop", "plant", "controller"],
    Word(
        "{loop,plant,controller}",
        help="the closed loop, the plant alone under command and motion, or the law alone; default loop",
    ),
]


def gait_list() -> CommandOutput:
    """List the gaits that come with the package.

    >>> print(gait_list().text)
    falisse2019-subject1  Healthy adult, 62 kg, overground at 1.33 m/s
    """
    from ppafo.gait import list_gaits, load_gait

    return listing("gait", [{"name": name, "title": load_gait(name).title} for name in list_gaits()])


def gait_show(gait: Gait, *, speed: Speed | None = None) -> Finding[GaitFound]:
    """Show and draw a gait.

    speed: walking speed to scale to, such as '1.2 m/s'

    >>> print(gait_show("falisse2019-subject1").said[0])
    falisse2019-subject1: Healthy adult, 62 kg, overground at 1.33 m/s (measured)
    """
    from ppafo.gait import at_speed, load_gait
    from ppafo.gait.finding import gait_finding

    return gait_finding(load_gait(gait) if speed is None else at_speed(load_gait(gait), speed))


def gait_import(
    files: Sequence[File],
    *,
    body_mass: BodyMass | None = None,
    side: Literal["right", "left"] = "right",
    map_: File | None = None,
    speed: Speed | None = None,
    stature: Length | None = None,
    low_pass: Frequency | None = None,
    minimum_strides: Count | None = None,
    stride_time: Time | None = None,
    form: Annotated[str, Word("FORM")] = "",
    start: Time | None = None,
    end: Time | None = None,
    fill_gaps: Time = 0.0,
    ankle_neutral: Angle | None = None,
    name: Name = "imported-gait",
    title: str = "",
) -> Finding[GaitFound]:
    """Make a gait from recorded files (.mot, .sto, .csv, .txt, .tsv, .emt, .c3d, .trc, .mat).

    files: files of one walk, on one clock
    body_mass: mass of the wearer, such as '62 kg'; default: what a C3D file states
    side: which foot; default right
    map_: gait map (.toml): which columns, units and signs
    speed: walking speed, such as '1.2 m/s'; needed to scale the gait later
    stature: stature of the wearer, such as '1.75 m'; gives the thigh length that OpenSim files lack
    low_pass: cutoff of a low-pass filter, such as '6 Hz'; default: none
    minimum_strides: minimum number of whole strides; default 2, overground 1
    stride_time: duration of a mean stride over percent, such as '1.1 s'
    form: form of the files, such as opensim; default: what they look like
    start: leave out what is before, such as '1.2 s'
    end: leave out what is after, such as '3.4 s'
    fill_gaps: fill gaps up to this length, such as '0.1 s'; default: none
    ankle_neutral: reading of the ankle with the foot square to the shank, such as '3 deg'
    name: name of the gait and of its file
    title: one line: who walks, and how

    >>> from pathlib import Path
    >>> written = gait_record("falisse2019-subject1", out=Path("strides.csv"))
    >>> print(gait_import([Path("strides.csv")], body_mass=62.0).said[0])
    imported-gait: Mean of 9 strides, right foot (synthetic)
    """
    from ppafo.gait.finding import gait_finding
    from ppafo.gait.recorded import ImportSettings, import_gait
    from ppafo.gait.recorded.mapping import load_map

    settings = ImportSettings(
        body_mass=body_mass,
        side=side,
        columns=None if map_ is None else load_map(map_),
        walking_speed=speed,
        low_pass=low_pass,
        least_strides=minimum_strides,
        stride_time=stride_time,
        name=name,
        title=title,
        stature=stature,
        start=start,
        end=end,
        form=form,
        longest_gap=fill_gaps,
        ankle_neutral=ankle_neutral,
    )
    imported = import_gait(files, settings)
    return gait_finding(imported.gait, imported)


def gait_record(gait: Gait, *, strides: Count = 10, out: File) -> CommandOutput:
    """Write some strides of a gait as a synthetic recording.

    strides: number of strides; default 10
    out: the .csv file to write

    >>> from pathlib import Path
    >>> print(gait_record("falisse2019-subject1", strides=2, out=Path("strides.csv")).text)
    written: strides.csv (417 samples, synthetic)
    """
    from ppafo.errors import DataError
    from ppafo.gait import load_gait, walk_recording
    from ppafo.storage import write_csv

    if out.suffix.lower() != ".csv":
        raise DataError(f"--out {out}: the name must end in .csv")
    check_new_file(out)
    recording = walk_recording(load_gait(gait), strides)
    write_csv(out, recording)
    document = {"file": str(out), "samples": len(recording), "channels": list(recording.names)}
    return CommandOutput(f"written: {out} ({len(recording)} samples, synthetic)", document)


def export_c(
    scenario: Scenario, *, interface: Interface = "loop", overrides: Overrides = (), out: Folder
) -> CommandOutput:
    """Write a scenario or a walk as a library in C: header, source, example, make files.

    out: the folder to write

    >>> print(export_c("step-response", out=Path("library")).text)
    written: library (CMakeLists.txt, LICENSE, Makefile, README.md, check.c, main.c, step_response.c, step_response.h,
    expected.csv); next: make -C library check
    """
    from ppafo.exports.c_library import c_library
    from ppafo.exports.c_library.law import law_library
    from ppafo.exports.c_library.plant import plant_library
    from ppafo.loading import load_scenario

    library_of = {"loop": c_library, "plant": plant_library, "controller": law_library}[interface]
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
    from ppafo.exports.fmu.interface import closed_loop, law_alone, plant_alone
    from ppafo.exports.fmu.platforms import host_platform
    from ppafo.exports.fmu.unit import functional_unit
    from ppafo.loading import load_scenario
    from ppafo.storage.files import write_file

    interface_of = {"loop": closed_loop, "plant": plant_alone, "controller": law_alone}[interface]
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
        check_new_file(out)
        write_file(out, next(iter(unit().values())))
        following = next_step(out)
        said = CommandOutput(f"written: {out}; next: {following}", {"file": str(out), "next": following})
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
    if not_run or not compared:
        left = f"libraries for {', '.join(not_run)}" if not_run else "sources alone"
        lines.append(f"not compared with Python, since they cannot run on this computer: {left}")
    document = {**said.document, "compared": compared, "not_run": not_run}
    return replace(said, text="\n".join(lines), document=document)


def sets_list() -> CommandOutput:
    """List the parameter sets that come with the package.

    >>> print(sets_list().text)
    cylinder-lever     Cylinder with a lever: a measured cylinder on an assumed joint
    ppafo2011          Portable powered ankle-foot orthosis, completed
    ppafo2011-printed  Portable powered ankle-foot orthosis, exactly as reported
    """
    from ppafo.parameters import list_sets, load_parameter_set

    sets = [load_parameter_set(name) for name in list_sets()]
    rows = [{"name": item.name, "title": item.title, "valves": dict(item.valve_kinds)} for item in sets]
    return listing("set", rows, ("name", "title"))


def sets_show(name: SetName, *, overrides: Overrides = ()) -> Finding[dict[str, Any]]:
    """Show every value of a parameter set with its source.

    >>> sets_show("ppafo2011").said[0]
    'ppafo2011: Portable powered ankle-foot orthosis, completed'
    """
    from ppafo.analyses.sets.audit import shown_values
    from ppafo.parameters import apply_overrides, load_parameter_set

    return shown_values(apply_overrides(load_parameter_set(name), overrides))


def sets_audit(
    names: Sequence[SetName], *, parent: SetName | None = None, all_: bool = False, overrides: Overrides = ()
) -> Finding[dict[str, Any]]:
    """Check a parameter set for contradictions.

    Changes and findings of one set, or a table of several; exit code 1 where a finding is an error.

    names: name of a set, or a .toml file; several are shown side by side
    parent: show what changed against this set, in place of the one that the file names
    all_: print what concerns no changed value too, of a set with a parent or --set

    >>> audited = sets_audit(["ppafo2011-printed"])
    >>> print(str(audited).splitlines()[0])
    error: reported.velocity_over_acceleration is inverted: its unit belongs to the reciprocal
    [velocity-over-acceleration-upside-down]
    >>> audited.passed
    False
    """
    from ppafo.analyses.sets.audit import audited

    return audited(names, parent, all_, tuple(overrides))


def rig_simulate(
    experiment: Annotated[str, Word("EXPERIMENT")],
    *,
    preset: Annotated[str, Word("PRESET")] = "paper-bench",
    seed: Whole = 1,
    device: Annotated[str, Word("SET")] = "ppafo2011",
    valve: Name | None = None,
    overrides: Overrides = (),
    out: Folder = Path("out/rig"),
) -> CommandOutput:
    """Run an experiment on the simulated test bench, and write the recording of a laboratory, marked as synthetic.

    experiment: name of an experiment
    preset: preset or .toml file; default paper-bench
    seed: random seed of noise and offsets; default 1
    device: parameter set or .toml file; default ppafo2011
    valve: valve of the parameter set; default: its default valve
    out: folder of the recording and of rig.json with the true values; default out/rig

    >>> print(rig_simulate("valve-map", out=Path("rig")).text)
    valve-map: synthetic: made by the simulated test bench of ppafo in place of a measurement
    201 samples of command, mass_flow, upstream_pressure, downstream_pressure
    written: rig (valve-map.csv, rig.json)
    """
    from ppafo.rig.experiments import NOTICE, check_rig_folder, record, write_rig_recording

    # A folder that cannot be used is refused before anything runs.
    with blame_out_option():
        check_rig_folder(out, experiment)
    rig_recording = record(experiment, preset, seed, device, overrides, valve)
    files = write_rig_recording(out, rig_recording)
    recording = rig_recording.recording
    samples = f"{len(recording)} samples of {', '.join(recording.names)}"
    lines = [f"{experiment}: {NOTICE}", rig_recording.truth.get("replaced", ""), samples]
    if {"angle", "command"} <= set(recording.names):
        words = ["ppafo", "validate", device, str(out / files[0]), *(() if valve is None else ("--valve", valve))]
        lines.append(f"to compare: {shlex.join([*words, '--motion', rig_recording.motion])}")
    text = "\n".join((*filter(None, lines), f"written: {out} ({', '.join(files)})"))
    return CommandOutput(text, {"folder": str(out), "files": list(files), **rig_recording.truth})


def list_rig() -> CommandOutput:
    """List experiments and presets of the simulated bench with descriptions."""
    from ppafo.rig.experiments import EXPERIMENTS
    from ppafo.rig.preset import list_presets, load_preset

    listed = {
        "experiments": {name: each.summary for name, each in EXPERIMENTS.items()},
        "presets": {name: load_preset(name).title for name in list_presets()},
    }
    lines = ["all recordings are synthetic"]
    for title, items in listed.items():
        lines += [f"{title}:", *(f"  {name:<16}  {summary}" for name, summary in items.items())]
    rows = {title: [{"name": name, "summary": said} for name, said in items.items()] for title, items in listed.items()}
    return CommandOutput("\n".join(lines), rows)
