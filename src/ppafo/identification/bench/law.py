"""Bench law: a table of a problem file that makes a result of recordings; readings, priors, fit, verdicts, panels."""

import math
from abc import ABC, abstractmethod
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ppafo.errors import IdentificationError
from ppafo.identification.estimate import Identified
from ppafo.identification.fit import Fit, FitNumber, ResidualBlock, estimate_of, fit, tolerance, wrong_shape
from ppafo.identification.new_set import stated_half_width
from ppafo.identification.noise import SAMPLES_PER_COEFFICIENT
from ppafo.identification.source import Sources, kind_of, remarks_on_readings
from ppafo.identification.tolerances import DEFAULTS, Columns, Confidence, Tolerances
from ppafo.model.declaration import Number
from ppafo.parameters.parameter_set import ParameterSet, chosen_valve, number_in_si, with_followers
from ppafo.parameters.records import keyed
from ppafo.report.panels import Panel, draw_panels
from ppafo.signals import RecordingKind
from ppafo.signals.faults import resolution_of, rounding_of
from ppafo.signals.recording import Floats
from ppafo.simulation.recorded.usual_errors import deviation_of_limit
from ppafo.wording import said_missing

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Names = NDArray[np.str_]
"""Group of each reading, by name."""
Values = Mapping[str, float]
"""Values of the fit variables by name [SI]; a missing name means 0."""
_MEMORY = 2
"""Highest order of the noise autoregression: enough for sensor lag, drift or hum, too low to absorb model error."""
_TELLING = 1.0e-3
"""Least residuals whose shape is tested [ranges of the readings]; smaller ones are lost in the errors of a bench."""


@dataclass(frozen=True, slots=True)
class BenchResult(Identified):
    """Result of a bench procedure, with its panels.

    ``scatter``: standard deviation of the readings from the model, divided by the largest reading [-]; nan where the
    procedure does not state it.
    """

    panels: tuple[Panel, ...] = ()
    scatter: float = math.nan

    def for_this_model_only(self, conflict: str) -> "BenchResult":
        """Return the result with a conflict, as a sentence, in which no value counts as identified."""
        estimates = tuple(
            replace(item, verdict="holds for this model only") if item.is_identified else item
            for item in self.estimates
        )
        return replace(self, estimates=estimates, conflict=conflict)


@dataclass(frozen=True, slots=True)
class BenchContext:
    """Context of a bench law or fit: set, valve (None: the chosen one), ``label`` in messages, bench tolerances."""

    parameter_set: ParameterSet
    valve: str | None
    label: str
    tolerances: Tolerances = DEFAULTS

    def number(self, path: str) -> float | None:
        """Return the value of a parameter [SI]; None if the set lacks it."""
        return number_in_si(self.parameter_set, path)

    def numbers(self, *paths: str) -> list[float]:
        """Return the values of parameters [SI]. Raises IdentificationError with every one that the set lacks."""
        values = {path: number_in_si(with_followers(self.parameter_set), path) for path in paths}
        if missing := [path for path, value in values.items() if value is None]:
            raise IdentificationError(f"{self.label}: {said_missing(missing)} in {self.parameter_set.file}")
        return [value for value in values.values() if value is not None]

    def deviation(self, path: str, value: float) -> float:
        """Return the standard deviation [SI] of a parameter of given ``value``: from bench, set, or defaults."""
        entry = with_followers(self.parameter_set).numbers.get(path)
        half_width = 0.0 if entry is None else stated_half_width(entry, self.parameter_set.declarations()[path])
        return self.tolerances.deviation_of(path, value, half_width)

    def valve_path(self, name: str | None) -> str:
        """Return the path of a valve in the set, such as ``valves.main``; None means the chosen valve."""
        return f"valves.{chosen_valve(self.parameter_set, name or self.valve)}"


@dataclass(frozen=True, kw_only=True)
class BenchLaw(ABC):
    """Table of a bench law: the keys that every law has, and what is declared of it.

    ``needed``: channels of every recording. ``steady``: its kinds that need no times. ``own_errors``: errors of sensors
    that may differ between its recordings.
    """

    needed: ClassVar[tuple[str, ...]]
    steady: ClassVar[tuple[str, ...]] = ()
    own_errors: ClassVar[tuple[str, ...]] = ()
    kind: str
    recordings: tuple[str, ...] = keyed("files, relative to this one")
    columns: Columns = None
    confidence: Confidence = 0.95

    @abstractmethod
    def run(self, sources: Sources, context: BenchContext) -> BenchResult:
        """Identify what the law has from recordings.

        Raises IdentificationError, with file and sample, for recordings that do not determine it.
        """


@dataclass(frozen=True, kw_only=True)
class TimedLaw(BenchLaw):
    """Keys of a law over time."""

    start: float | None = keyed(Number("s", "first time to use, such as '2 s'"), None)
    end: float | None = keyed(Number("s", "last time to use, such as '8 s'"), None)


def result_of(
    sources: Sources,
    fitted: Fit,
    summary: str,
    panels: tuple[Panel, ...],
    reason: str = "",
    remarks: tuple[str, ...] = (),
    scatter: float = math.nan,
) -> BenchResult:
    """Return the result of a procedure: an estimate for each number with a text, and remarks on the recordings.

    ``reason`` says more of a conflict, if readings contradict the others; ``scatter`` is the field of the result.
    """
    origin = [source.trace for source in sources]
    conflict = "" if fitted.conflict is None else fitted.conflict.words
    conflict = f"{conflict}; {reason}" if conflict and reason else conflict
    rows = [row for row, number in enumerate(fitted.numbers) if number.text]
    return BenchResult(
        procedure=sources[0].user,
        summary=summary,
        estimates=tuple(estimate_of(fitted, row, origin, conflict) for row in rows),
        panels=panels,
        kind=kind_of(source.recording.kind for source in sources),
        conflict=conflict,
        remarks=(*remarks, *remarks_on_readings(sources)),
        scatter=scatter,
    )


def bench_figure(panels: Sequence[Panel], kind: RecordingKind) -> "Figure":
    """Draw the two panels of a procedure side by side, lettered A and B."""
    pairs = zip("AB", panels, strict=True)
    lettered = [replace(panel, title=f"$\\bf{{{letter}}}$   {panel.title}") for letter, panel in pairs]
    # Two panels of these inches stand side by side in a journal column.
    return draw_panels(lettered, 2, (3.1, 2.7), kind=kind)


def figure_3(torque: BenchResult, decay: BenchResult) -> "Figure":
    """Draw figure 3 of the paper, static torque and damping, from results of static torque and free decay.

    The title of each panel states if its recordings are synthetic or simulated.
    """
    panels = []
    for result, panel in ((torque, torque.panels[0]), (decay, decay.panels[1])):
        # Of a page that shows two kinds of recordings, the mark of the figure would not say which panel is which.
        words = "" if result.kind == "measured" else f", {result.kind}"
        panels.append(replace(panel, title=f"{panel.title}{words}", legend="above"))
    return bench_figure(panels, kind_of((torque.kind, decay.kind)))


def within(limit: float, *names: str, family: str = "") -> tuple[FitNumber, ...]:
    """Return errors of the bench within +-``limit`` [SI], as variables with a prior; nothing if exact."""
    return tuple(number for name in names for number in tolerance(name, deviation_of_limit(limit), family=family))


def sought(
    number: FitNumber | str,
    start: float,
    low: float = -math.inf,
    high: float = math.inf,
    scale: float = 0.0,
    **more: Any,
) -> FitNumber:
    """Return an unknown without a prior [SI]; the default scale is that of its start.

    ``more`` are its further fields, such as unit and text of a number that is reported.
    """
    number = FitNumber(number) if isinstance(number, str) else number
    return replace(number, start=start, low=low, high=high, scale=scale or abs(start) or 1.0, **more)


def recordings_of(sources: Sources) -> Names:
    """Return for each reading of all recordings the label of its recording, with the file name."""
    labels = [f"recording {number} ({source.name})" for number, source in enumerate(sources, start=1)]
    return np.repeat(labels, [len(source.recording) for source in sources])


def halved_readings(
    sources: Sources, parts: Iterable[tuple[int, Mapping[str, Floats]]], names: tuple[str, str]
) -> tuple[Floats, list[Names]]:
    """Return the samples over time of all sources with their groups, of which the last is the ``names`` of its half.

    ``parts`` are, for each source, the first sample of the second half, and the samples by channel.
    """
    series = []
    labels = []
    for number, (source, (half, channels)) in enumerate(zip(sources, parts, strict=True), start=1):
        for sensor, values in channels.items():
            series.append(values)
            halves = np.repeat(names, (half, values.size - half)).tolist()
            labels += [(f"recording {number} ({source.name})", sensor, name) for name in halves]
    return np.concatenate(series), [*np.transpose(labels)]


def solve(
    law: Callable[[Values], Floats],
    measured: Floats,
    groups: Iterable[ArrayLike],
    numbers: Sequence[FitNumber],
    confidence: float,
) -> tuple[Fit, Floats]:
    """Fit a law to readings. Returns the fit, and the fitted values in the unit of the readings.

    ``groups`` are, for each reading, its recording or repetition, its sensor (one noise each), and further groups. The
    separate estimates of each of them are tested against the common ones. Residuals of sensors whose readings are too
    few for correlated noise are tested for runs in order of the law.
    """
    names = [number.name for number in numbers]
    # A block of the fit is a slice, so that readings of one label must lie side by side: labels in the order of their
    # first reading, so that the first block is the first recording.
    samples_of = defaultdict[tuple[str, ...], list[int]](list)
    sensors = defaultdict[str, list[int]](list)
    for sample, label in enumerate(zip(*(each.tolist() for each in np.broadcast_arrays(*groups)), strict=True)):
        samples_of[label].append(sample)
        sensors[label[1]].append(sample)
    # A meter shows six digits at most: residuals below say nothing.
    least = 1.0e-6 * np.ptp(measured)
    order = list[int]()
    blocks = []
    for (recording, sensor, *further), samples in samples_of.items():
        rows = slice(len(order), len(order) + len(samples))
        order += samples
        floor = np.maximum(least, rounding_of(measured[samples], resolution_of(measured[sensors[sensor]])))
        blocks.append(ResidualBlock(recording, sensor, rows, floor, groups=tuple(further)))

    def at(point: Floats) -> Values:
        return defaultdict(float, zip(names, point.tolist(), strict=True))

    def residuals(points: Floats) -> Floats:
        return np.stack([(measured - law(at(point)))[order] for point in points.T], axis=1)

    memory = min(_MEMORY, min(map(len, samples_of.values())) // SAMPLES_PER_COEFFICIENT)
    fitted = fit(residuals, numbers, blocks, confidence, memory=memory)
    model = law(at(fitted.values))
    for sensor, noise in fitted.sensors.items():
        if noise.order or not noise.deviation > _TELLING * np.ptp(measured[sensors[sensor]]):
            continue
        by_law = [sorted(samples, key=model.item) for label, samples in samples_of.items() if label[1] == sensor]
        series = [(measured - model)[samples] / noise.deviation for samples in by_law]
        fitted = replace(fitted, conflict=fitted.conflict or wrong_shape(sensor, series))
    return fitted, model
