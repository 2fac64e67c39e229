"""``ppafo hil SCENARIO --port PORT``: a scenario's plant in real time against a controller at a wire."""

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ppafo.cli import output
from ppafo.cli.arguments import Count, Folder, Overrides, Patience, Port, Scenario, Word, counting_number
from ppafo.cli.output import EXIT_CHECK_FAILED, EXIT_INTERRUPTED, Said
from ppafo.errors import ScenarioError

if TYPE_CHECKING:
    from ppafo.exports.hil.run import HardwareRun
    from ppafo.simulation.scenario import Scenario as LoadedScenario

_PER_THOUSAND = 1.0e3
_SAME = 1.0e-9


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

    Exit code 1 where it was vented or diverged, 130 where Ctrl-C stopped it.

    scenario: name of a scenario, or a .toml file
    port: where the controller is: udp:HOST:PORT or serial:DEVICE (extra 'hil')
    rate: samples per second, 50 to 2000; default 1000
    baud: bits per second of a serial line; default 921600
    lock_step: wait for each answer instead of for the clock, at most a second: the same run every time
    patience: how long the controller is called; default '10 s'
    out: result folder; default out/NAME-hil of the scenario
    """
    from ppafo.exports.hil.loop import stop_by_interrupt
    from ppafo.loading import load_scenario
    from ppafo.simulation.scenario import worn_kind
    from ppafo.storage import check_result_folder

    chosen = load_scenario(scenario, overrides)
    if worn_kind(chosen) is not None:
        raise ScenarioError(
            f"'{chosen.name}' is a walk, and the wire carries no forces under the foot: give a scenario"
        )
    folder = out if out is not None else Path("out") / f"{chosen.name}-hil"
    with output.blame_out_option():
        check_result_folder(folder)
    with stop_by_interrupt() as is_stopped:
        found = _run(chosen, port, rate, baud, lock_step, patience, is_stopped)
        from ppafo.answers.drawing import load_drawing

        load_drawing()
        from ppafo.answers.recording_figure import figure_files

        found.save(folder, figure_files(found.plot_signals()))
    from ppafo.answers.display_units import metrics_lines

    result = found.result
    lines = metrics_lines(result.metrics, result.scenario.device.supply.atmospheric_pressure)
    ended = "stopped" if found.exchange.is_stopped else "vented" if found.exchange.vented else result.status.kind
    text = "\n".join(
        [
            f"{result.scenario.name} at {port}: {ended}",
            "",
            found.text(),
            "",
            *lines,
            "",
            f"written: {folder} (recording.nc, recording.csv, log.csv, link.json, run.json, figures)",
        ]
    )
    from ppafo.simulation.scenario import plain

    document = {
        "scenario": found.result.scenario.name,
        "port": port,
        "status": plain(found.result.status),
        "link": found.document(),
        "metrics": {name: plain(metric) for name, metric in found.result.metrics.items()},
        "folder": str(folder),
    }
    if found.exchange.is_stopped:
        aside = f"stopped at {found.exchange.vented_at:.6g} s and vented; {folder} is whole"
        return Said(text, document, exit_code=EXIT_INTERRUPTED, aside=aside)
    if found.is_good:
        return Said(text, document)
    said = found.exchange.vented or found.result.status.message
    return Said(text, document, exit_code=EXIT_CHECK_FAILED, aside=f"{chosen.name}: {said}")


def _run(
    scenario: "LoadedScenario",
    port_name: str,
    rate: int,
    baud: int,
    lock_step: bool,
    patience: float,
    is_stopped: Callable[[], bool],
) -> "HardwareRun":
    from ppafo.exports.hil.loop import LockStep, RealTime
    from ppafo.exports.hil.run import check_baud, plant_of, run_plant
    from ppafo.exports.hil.wire import open_port

    port = open_port(port_name, baud)
    try:
        if port.is_stream:
            check_baud(baud, rate)
        plant = plant_of(scenario, rate)
        if plant.period > scenario.control.period * (1.0 + _SAME):
            print(f"ppafo: {_slower(plant.period, scenario.control.period, rate)}", file=sys.stderr, flush=True)
        output.tell(f"calling the controller at {port_name}")
        return run_plant(
            plant,
            port,
            lambda period: LockStep() if lock_step else RealTime(period),
            patience,
            is_stopped,
        )
    finally:
        port.close()


def _slower(apart: float, period: float, rate: int) -> str:
    return (
        f"--rate {rate}: a sample every {apart * _PER_THOUSAND:.4g} ms, for a controller of the scenario that decides "
        f"every {period * _PER_THOUSAND:.4g} ms; it has the wrong gains unless it was exported for this rate: give "
        f"--set controller.rate={rate}Hz here and to 'ppafo export controller'"
    )
