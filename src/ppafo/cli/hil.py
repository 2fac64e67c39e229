"""``ppafo hil SCENARIO --port PORT``: a scenario's plant in real time against a controller at a wire."""

import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from ppafo.cli import output
from ppafo.cli.output import EXIT_CHECK_FAILED, EXIT_INTERRUPTED, Said
from ppafo.errors import ScenarioError

if TYPE_CHECKING:
    from ppafo.exports.hil.run import HardwareRun
    from ppafo.simulation.scenario import Scenario

_PER_THOUSAND = 1.0e3
_SAME = 1.0e-9


@dataclass(frozen=True, slots=True)
class Wire:
    """Where the controller is, and how it is spoken to: samples per second, bits per second, patience [s]."""

    port: str
    rate: int
    baud: int
    lock_step: bool
    patience: float


def run_hardware(name: str, wire: Wire, overrides: Sequence[str], out: Path | None) -> Said:
    """Run the plant to its end; exit code 1 where it was vented or diverged, 130 where Ctrl-C stopped it."""
    from ppafo.exports.hil.loop import stop_by_interrupt
    from ppafo.loading import load_scenario
    from ppafo.simulation.scenario import worn_kind
    from ppafo.storage import check_result_folder

    scenario = load_scenario(name, overrides)
    if worn_kind(scenario) is not None:
        raise ScenarioError(
            f"'{scenario.name}' is a walk, and the wire carries no forces under the foot: give a scenario"
        )
    folder = out if out is not None else Path("out") / f"{scenario.name}-hil"
    with output.blame_out_option():
        check_result_folder(folder)
    with stop_by_interrupt() as is_stopped:
        found = _run(wire, scenario, is_stopped)
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
            f"{result.scenario.name} at {wire.port}: {ended}",
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
        "port": wire.port,
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
    return Said(text, document, exit_code=EXIT_CHECK_FAILED, aside=f"{scenario.name}: {said}")


def _run(wire: Wire, scenario: "Scenario", is_stopped: Callable[[], bool]) -> "HardwareRun":
    from ppafo.exports.hil.loop import LockStep, RealTime
    from ppafo.exports.hil.run import check_baud, plant_of, run_plant
    from ppafo.exports.hil.wire import open_port

    port = open_port(wire.port, wire.baud)
    try:
        if port.is_stream:
            check_baud(wire.baud, wire.rate)
        plant = plant_of(scenario, wire.rate)
        if plant.period > scenario.control.period * (1.0 + _SAME):
            print(f"ppafo: {_slower(plant.period, scenario.control.period, wire.rate)}", file=sys.stderr, flush=True)
        output.tell(f"calling the controller at {wire.port}")
        return run_plant(
            plant,
            port,
            lambda period: LockStep() if wire.lock_step else RealTime(period),
            wire.patience,
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
