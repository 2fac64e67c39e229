"""``ppafo hil SCENARIO --port PORT``: real-time plant of a scenario with an external controller on a link."""

import sys
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ppafo.arguments import Count, Folder, Overrides, Patience, Port, Scenario, Word, whole_number
from ppafo.cli import output
from ppafo.cli.output import EXIT_CHECK_FAILED, EXIT_INTERRUPTED, CommandOutput
from ppafo.units.shown import in_units

if TYPE_CHECKING:
    from ppafo.exports.hil.result import HardwareRun


_SAME_PERIOD = 1.0e-9
"""Relative rounding difference of two equal sample periods [-]."""


def hil(
    scenario: Scenario,
    *,
    port: Port,
    rate: Annotated[int, Word("HZ", partial(whole_number, lowest=1))] = 1000,
    baud: Count = 921600,
    lock_step: bool = False,
    patience: Patience = 10.0,
    overrides: Overrides = (),
    out: Folder | None = None,
) -> CommandOutput:
    """Run a scenario's plant in real time against a controller at a serial port or over UDP.

    Exit code 1 where it was vented or diverged, 130 where Ctrl-C stopped it.

    scenario: name of a scenario, or a .toml file
    port: where the controller is: udp:HOST:PORT or serial:DEVICE (extra 'hil')
    rate: samples per second, 50 to 2000; default 1000
    baud: bits per second of a serial line; default 921600
    lock_step: wait for each answer instead of for the clock, at most a second: the same run every time
    patience: how long the controller is called; default '10 s'
    out: result folder; default out/NAME-hil of the scenario

    >>> hil("torque-task-solenoid", port="udp:127.0.0.1:49318", patience=0.2)  # no controller is there
    Traceback (most recent call last):
    ...
    ppafo.errors.ScenarioError: no controller answered within 0.2 s; received: nothing
    """
    from ppafo.exports.hil.pacing import LockStep, RealTime
    from ppafo.exports.hil.plant import check_baud, plant_of
    from ppafo.exports.hil.ports import open_port
    from ppafo.exports.hil.run import run_plant
    from ppafo.interrupts import stop_by_interrupt
    from ppafo.loading import load_scenario
    from ppafo.storage import check_result_folder

    chosen = load_scenario(scenario, overrides)
    # Before the first sample: a folder that is refused must not cost a run with a bench.
    folder = out if out is not None else Path("out") / f"{chosen.name}-hil"
    with output.blame_out_option():
        check_result_folder(folder)
    with stop_by_interrupt() as is_stopped:
        with closing(open_port(port, baud)) as line:
            # A datagram has no line whose rate could be too low.
            if line.is_stream:
                check_baud(baud, rate)
            plant, decided = plant_of(chosen, rate), chosen.controller.period
            if plant.period > decided * (1.0 + _SAME_PERIOD):
                remark = (
                    f"--rate {rate}: the sample period of {plant.period * 1.0e3:.4g} ms exceeds the controller period "
                    f"of {decided * 1.0e3:.4g} ms in the scenario, so the gains are wrong unless the controller was "
                    f"exported for this rate: give --set controller.rate={rate}Hz here and to 'ppafo export controller'"
                )
                print(f"ppafo: {remark}", file=sys.stderr, flush=True)
            output.tell(f"calling the controller at {port}")
            # In lock step the pace waits for each answer, whatever the sample period is.
            ran = run_plant(plant, line, (lambda _: LockStep()) if lock_step else RealTime, patience, is_stopped)
        from ppafo.report.drawing import load_drawing

        load_drawing()
        from ppafo.report.recording_figure import figure_files

        ran.result.save(folder, {**ran.files(), **figure_files(ran.plot_signals())})
    return _said(ran, port, folder)


@in_units(lambda ran, *_: ran.result.scenario.device.shown)
def _said(ran: "HardwareRun", port: str, folder: Path) -> CommandOutput:
    """Return the output of a finished run with written files."""
    from ppafo.documents.json_text import plain
    from ppafo.report.display_units import metrics_lines

    result, traffic = ran.result, ran.traffic
    ended = "stopped" if traffic.is_stopped else "vented" if traffic.vent_reason else result.status.kind
    lines = [
        f"{result.scenario.name} at {port}: {ended}",
        "",
        ran.text(),
        "",
        *metrics_lines(result.metrics),
        "",
        f"written: {folder} (recording.nc, recording.csv, log.csv, link.json, run.json, figures)",
    ]
    text = "\n".join(lines)
    document = {
        "scenario": result.scenario.name,
        "port": port,
        "status": plain(result.status),
        "link": ran.document(),
        "metrics": {name: plain(metric) for name, metric in result.metrics.items()},
        "folder": str(folder),
    }
    if traffic.is_stopped:
        aside = f"stopped at {traffic.vented_at:.6g} s and vented; {folder} is complete"
        return CommandOutput(text, document, exit_code=EXIT_INTERRUPTED, aside=aside)
    if ran.is_good:
        return CommandOutput(text, document)
    aside = f"{result.scenario.name}: {traffic.vent_reason or result.status.message}"
    return CommandOutput(text, document, exit_code=EXIT_CHECK_FAILED, aside=aside)
