"""``ppafo hil SCENARIO --port PORT``: a scenario's plant in real time against a controller at a wire."""

import argparse
import math
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ppafo.cli import output
from ppafo.errors import ScenarioError, UnitError, refused_as
from ppafo.exports.hil.wire import DEFAULT_BAUD, FORMS, HIGHEST_RATE, LOWEST_RATE, RATE

if TYPE_CHECKING:
    from ppafo.exports.hil.run import HardwareRun
    from ppafo.simulation.scenario import Scenario

EXIT_INTERRUPTED = 130
LONGEST_PATIENCE = 3600.0
_DEFAULT_PATIENCE = "10 s"
_PER_THOUSAND = 1.0e3
_SAME = 1.0e-9
PORT_HELP = f"{FORMS} (extra 'hil')"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    parser.add_argument("scenario", metavar="SCENARIO", help="name of a scenario, or a .toml file")
    parser.add_argument("--port", metavar="PORT", required=True, help=f"where the controller is: {PORT_HELP}")
    parser.add_argument(
        "--rate",
        metavar="HZ",
        type=int,
        default=RATE,
        help=f"samples per second, {LOWEST_RATE} to {HIGHEST_RATE} (default: {RATE})",
    )
    add_baud_argument(parser)
    parser.add_argument(
        "--lock-step",
        action="store_true",
        help="wait for each answer instead of for the clock, at most a second: the same run every time",
    )
    parser.add_argument(
        "--patience",
        metavar="TIME",
        default=_DEFAULT_PATIENCE,
        help=f"how long the controller is called (default: '{_DEFAULT_PATIENCE}')",
    )
    output.add_override_argument(parser)
    output.add_json_argument(parser)
    parser.add_argument("--out", metavar="DIR", type=Path, help="result folder; default out/NAME-hil of the scenario")


def add_baud_argument(parser: argparse.ArgumentParser) -> None:
    """Add the speed of a serial line."""
    parser.add_argument(
        "--baud",
        metavar="N",
        type=int,
        default=DEFAULT_BAUD,
        help=f"bits per second of a serial line (default: {DEFAULT_BAUD})",
    )


def seconds_of(option: str, text: str, longest: float = math.inf) -> float:
    """Return the time that an option gives, such as ``10 s``, in seconds. UnitError where it is none."""
    from ppafo.units import parse_quantity

    with refused_as(UnitError, f"{option} {text}", UnitError):
        seconds = parse_quantity(text, "s")
    if not 0.0 < seconds <= longest:
        limit = "" if math.isinf(longest) else f", at most {longest:g} s"
        raise UnitError(f"{option} {text}: must be above 0 s{limit}")
    return seconds


def run(parsed: argparse.Namespace) -> int:
    """Run the plant to its end; 1 where it was vented or diverged, 130 where Ctrl-C stopped it."""
    parsed.patience = seconds_of("--patience", parsed.patience, LONGEST_PATIENCE)
    from ppafo.exports.hil.loop import stop_by_interrupt
    from ppafo.loading import load_scenario
    from ppafo.simulation.scenario import worn_kind
    from ppafo.storage import check_result_folder

    scenario = load_scenario(parsed.scenario, parsed.overrides)
    if worn_kind(scenario) is not None:
        raise ScenarioError(
            f"'{scenario.name}' is a walk, and the wire carries no forces under the foot: give a scenario"
        )
    folder = parsed.out if parsed.out is not None else Path("out") / f"{scenario.name}-hil"
    with output.blame_out_option():
        check_result_folder(folder)
    with stop_by_interrupt() as is_stopped:
        found = _run(parsed, scenario, is_stopped)
        output.load_drawing()
        from ppafo.answers.recording_figure import figure_files

        found.save(folder, figure_files(found.plot_signals()))
    from ppafo.answers.display_units import metrics_lines

    result = found.result
    lines = metrics_lines(result.metrics, result.scenario.device.supply.atmospheric_pressure)
    ended = "stopped" if found.exchange.is_stopped else "vented" if found.exchange.vented else result.status.kind
    text = "\n".join(
        [
            f"{result.scenario.name} at {parsed.port}: {ended}",
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
        "port": parsed.port,
        "status": plain(found.result.status),
        "link": found.document(),
        "metrics": {name: plain(metric) for name, metric in found.result.metrics.items()},
        "folder": str(folder),
    }
    output.print_result(text, document, parsed.json)
    if found.exchange.is_stopped:
        print(f"ppafo: stopped at {found.exchange.vented_at:.6g} s and vented; {folder} is whole", file=sys.stderr)
        return EXIT_INTERRUPTED
    if not found.is_good:
        said = found.exchange.vented or found.result.status.message
        print(f"ppafo: {scenario.name}: {said}", file=sys.stderr)
    return output.EXIT_GOOD if found.is_good else output.EXIT_CHECK_FAILED


def _run(parsed: argparse.Namespace, scenario: "Scenario", is_stopped: Any) -> "HardwareRun":
    from ppafo.exports.hil.loop import LockStep, RealTime
    from ppafo.exports.hil.run import check_baud, plant_of, run_plant
    from ppafo.exports.hil.wire import open_port

    port = open_port(parsed.port, parsed.baud)
    try:
        if port.is_stream:
            check_baud(parsed.baud, parsed.rate)
        plant = plant_of(scenario, parsed.rate)
        if plant.period > scenario.control.period * (1.0 + _SAME):
            print(f"ppafo: {_slower(plant.period, scenario.control.period, parsed.rate)}", file=sys.stderr, flush=True)
        output.tell(f"calling the controller at {parsed.port}")
        return run_plant(
            plant,
            port,
            lambda period: LockStep() if parsed.lock_step else RealTime(period),
            parsed.patience,
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
