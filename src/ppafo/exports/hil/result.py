"""Result of a hardware-in-the-loop run: recording, log and statistics of the link."""

import csv
import io
import statistics
from collections.abc import Sequence
from dataclasses import dataclass
from operator import methodcaller
from typing import TYPE_CHECKING, Any, final

import numpy as np

from ppafo.documents.json_text import json_text
from ppafo.exports.hil import wire
from ppafo.exports.hil.loop import LinkTraffic, LogRow
from ppafo.exports.hil.plant import CompiledPlant
from ppafo.report.kind import Kind
from ppafo.report.panels import Mark, Panel, draw_panels
from ppafo.report.recording_figure import recording_figure
from ppafo.report.style import ACTUAL, VERMILION, render_figure
from ppafo.simulation.simulate import Result
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.units.shown import shown_in

if TYPE_CHECKING:
    from matplotlib.figure import Figure


LOG_COLUMNS = (
    *("sequence [-]", "due [s]", "sent_late [s]", "answered_after [s]"),
    *("command [-]", "controller_time [s]", "vented [-]"),
)
_PER_THOUSAND = 1.0e3
_BINS = 60
_SHORTEST_SHOWN, _LONGEST_SHOWN = 1.0e-2, 1.0e1
"""Limits of the time axis [ms]; longer times extend the axis."""


@dataclass(frozen=True, slots=True)
class HostComputer:
    """Computer of the plant: system, cores, Python, and load before and after the run.

    The load is the mean number of running processes over 1 min; None if the system does not provide it.
    """

    system: str
    cores: int
    python: str
    load_before: float | None
    load_after: float | None


@final
@dataclass(frozen=True, slots=True)
class HardwareRun:
    """Hardware-in-the-loop run: the plant, its result, the traffic on the link, and the host computer."""

    plant: CompiledPlant
    result: Result
    traffic: LinkTraffic
    machine: HostComputer

    @property
    def delays(self) -> list[float]:
        """Delays [s] of the sent samples; the samples after a stop are not sent."""
        return [row.delay for row in self.traffic.rows if row.delay is not None]

    @property
    def response_times(self) -> list[float]:
        """Response times [s] of the answered samples."""
        return [row.response_time for row in self.traffic.rows if row.response_time is not None]

    @property
    def is_good(self) -> bool:
        """True if the run is complete and the plant was not vented."""
        return self.result.status.is_completed and not self.traffic.vent_reason

    def document(self) -> dict[str, Any]:
        """Content of ``link.json``, in SI units."""
        traffic, late, after = self.traffic, self.delays, self.response_times
        return {
            "rate": round(1.0 / self.plant.period),
            "samples": len(late),
            "answered": len(after),
            "missed": len(late) - len(after),
            "longest_silence": longest_silence(traffic.rows) * self.plant.period,
            "sent_late": spread(late),
            "answered_after": spread(after),
            "stood_still": list(traffic.pauses),
            "taken": traffic.accepted,
            "refused": dict(traffic.refused),
            "ignored": dict(traffic.ignored),
            "strangers": traffic.strangers,
            "is_real_time": traffic.is_real_time,
            "vented": traffic.vent_reason or None,
            "vented_at": traffic.vented_at,
            "is_stopped": traffic.is_stopped,
            "failure": traffic.failure or None,
            "plant": self.plant.compiled_by,
            "machine": {name: getattr(self.machine, name) for name in HostComputer.__slots__},
        }

    def text(self) -> str:
        """Summary of the run as text."""
        traffic, machine, late, after = self.traffic, self.machine, self.delays, self.response_times
        others = [*traffic.ignored.items(), ("from another sender", traffic.strangers)]
        silence = longest_silence(traffic.rows) * self.plant.period
        loads = "".join(
            f", load {load:.2f} {when}"
            for load, when in ((machine.load_before, "before"), (machine.load_after, "after"))
            if load is not None
        )
        pauses = traffic.pauses
        pause_text = f"paused {len(pauses)} times, {sum(pauses):.3g} s in total" if pauses else "never paused"
        times = []
        for label, values in (("answers", after), ("sent late", late)):
            numbers = spread(values)
            described = "none"
            if numbers is not None:
                median, most, largest = (f"{value * _PER_THOUSAND:.3g} ms" for value in numbers.values())
                described = f"median {median}, 99 % within {most}, at most {largest}"
            times.append(f"{label:<10} {described}")
        times.append(f"time       {pause_text}")
        times = times if traffic.is_real_time else ["time       in lock step with the answers"]
        lines = [
            f"samples    {len(late)} sent, {len(after)} answered, {len(late) - len(after)} missed; "
            f"longest silence {silence * _PER_THOUSAND:.3g} ms",
            *times,
            f"dropped    {wire.described_refusals(traffic.refused, others)}",
            f"machine    {machine.cores} cores{loads}; {machine.system}, Python {machine.python}",
            f"plant      {self.plant.compiled_by}",
        ]
        if traffic.vent_reason:
            lines.append(f"VENTED     at {traffic.vented_at:.6g} s: {traffic.vent_reason}")
        return "\n".join([*lines, *([f"port       {traffic.failure}"] if traffic.failure else [])])

    def files(self) -> dict[str, bytes]:
        """Additional files of the result by name."""
        # The log as a table; an empty cell is something that was not there.
        buffer = io.StringIO()
        writer = csv.writer(buffer, lineterminator="\n")
        writer.writerow(LOG_COLUMNS)
        for row in self.traffic.rows:
            stamp = "" if row.controller_time is None else repr(row.controller_time / wire.MICROSECONDS)
            times = ("" if value is None else repr(value) for value in (row.delay, row.response_time))
            writer.writerow([row.sequence, repr(row.due), *times, repr(row.command), stamp, int(row.is_vented)])
        files = {"log.csv": buffer.getvalue().encode(), "link.json": f"{json_text(self.document())}\n".encode()}
        if self.traffic.is_real_time:
            figure = render_figure(self.plot(), ("png", "svg"))
            files |= {f"link.{form}": content for form, content in figure.items()}
        vented_at = self.traffic.vented_at
        if vented_at is not None and len(before := self.result.recording.time[self.result.recording.time < vented_at]):
            # A fit wants the part in which the controller acted.
            files["until-vented.csv"] = marked_csv_bytes(self.result.recording.between(0.0, float(before[-1])))
        return files

    def plot_signals(self) -> "Figure":
        """Figure of the signals of the run, with the reason of venting below."""
        traffic, status = self.traffic, self.result.status
        remark = "" if status.is_completed else status.message
        if status.is_completed and traffic.vented_at is not None:
            remark = f"vented (command 2) from {traffic.vented_at:.6g} s on: {traffic.vent_reason}"
        with shown_in(self.plant.scenario.device.shown):
            return recording_figure(self.result.recording, f"{self.plant.scenario.name}, hardware in the loop", remark)

    def plot(self) -> "Figure":
        """Histograms of sending delays and response times."""
        period, load = self.plant.period * _PER_THOUSAND, self.machine.load_after
        delays, response_times = self.delays, self.response_times
        beside = "" if load is None else f"; load {load:.2f} on {self.machine.cores} cores"
        missed = f"{len(delays) - len(response_times)} of {len(delays)} samples missed"
        panels = [
            _histogram(delays, period, "Sample delay after its due time"),
            _histogram(response_times, period, "Answer delay after its sample"),
        ]
        note = f"Dashed: one sample period, {period:g} ms. {missed}{beside}"
        return draw_panels(panels, 2, (3.4, 2.4), f"{self.plant.scenario.name}: timing of the link", note, "measured")


def spread(values: Sequence[float]) -> dict[str, float] | None:
    """Return median, 99th percentile and maximum of times [s]; None for no times."""
    if not values:
        return None
    return {
        "median": statistics.median(values),
        "percentile_99": float(np.percentile(values, 99.0)),
        "largest": max(values),
    }


def longest_silence(rows: Sequence[LogRow]) -> int:
    """Return the largest number of consecutive samples that were sent and not answered."""
    longest = current = 0
    for row in rows:
        current = current + 1 if row.response_time is None and row.delay is not None else 0
        longest = max(longest, current)
    return longest


def _histogram(values: Sequence[float], period: float, title: str) -> Panel:
    """Return a histogram of times [s] over a logarithmic axis in ms; times below 0.01 ms are in the first bin.

    ``period`` is the time between two samples [ms].
    """
    shown = np.maximum(np.asarray(values) * _PER_THOUSAND, _SHORTEST_SHOWN)
    edges = np.geomspace(_SHORTEST_SHOWN, max(_LONGEST_SHOWN, 1.01 * shown.max(initial=0.0)), _BINS)
    counts, _ = np.histogram(shown, edges)
    marks = [
        Mark("bars", edges, counts, colour=ACTUAL.colour, style={"linestyle": "-"}),
        Mark("at", period, colour=VERMILION, style={"linewidth": 1.0, "linestyle": "--"}),
    ]
    limits = methodcaller("set", xscale="log", yscale="log", xlim=(edges[0], edges[-1]), ylim=(0.5, None))
    return Panel(Kind("Time", "ms"), Kind("Samples"), marks, title, legend="", then=limits)
