"""Result of a bench procedure: estimates with verdicts, a table and two panels, in SI units.

Figure 3 of the paper combines the static torque and the free decay.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from ppafo.identification.estimate import UNKNOWN, Estimate, Verdict, relative_half_width
from ppafo.identification.fit import Fit
from ppafo.identification.source import RecordingSource, kind_of, remarks_on_readings
from ppafo.identification.wording import conflict_in_words, widened_by
from ppafo.report.panels import Panel, draw_panels
from ppafo.signals import RecordingKind

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, slots=True)
class BenchResult:
    """Result of a bench procedure.

    ``kind``: origin of the recordings, which figures state unless measured. ``conflict``: sentence on readings whose
    separate estimates differ from the common estimates, empty if all agree. ``scatter``: standard deviation of the
    readings from the model, divided by the largest reading [-]; nan where the procedure does not state it.
    """

    procedure: str
    summary: str
    estimates: tuple[Estimate, ...]
    panels: tuple[Panel, ...]
    kind: RecordingKind
    conflict: str = ""
    remarks: tuple[str, ...] = ()
    scatter: float = math.nan

    def __getitem__(self, path: str) -> Estimate:
        """Return the estimate at a path. Raises KeyError if the procedure did not estimate it."""
        for estimate in self.estimates:
            if estimate.path == path:
                return estimate
        raise KeyError(path)


@dataclass(frozen=True, slots=True)
class ReportedNumber:
    """Estimated quantity to report: path (its name in the fit), SI unit, and description as a sentence.

    ``size`` is a typical magnitude [unit] of a quantity that may be zero: an estimate of zero is then a valid result
    and not the bound of the search.
    """

    path: str
    unit: str
    text: str
    size: float | None = None


_AT_BOUND = 1.0e-6
"""Relative distance from a bound [-] up to which an estimate counts as at its bound."""
_NONE = 0.1
"""Upper end of an interval that begins at zero [typical magnitudes], below which the part is none."""


def result_of(
    procedure: str,
    sources: tuple[RecordingSource, ...],
    fitted: Fit,
    reported: Sequence[ReportedNumber],
    summary: str,
    panels: tuple[Panel, ...],
    remedy: str,
    remarks: tuple[str, ...] = (),
    scatter: float = math.nan,
) -> BenchResult:
    """Return the result of a procedure: an estimate for each reported quantity, and remarks on the recordings.

    ``remedy`` is the advice if some readings contradict the others; ``scatter`` is the field of the result.
    """
    origin = tuple(source.trace for source in sources)
    return BenchResult(
        procedure=procedure,
        summary=summary,
        estimates=tuple(_estimate(fitted, number, origin) for number in reported),
        panels=panels,
        kind=kind_of(source.recording.kind for source in sources),
        conflict=conflict_in_words(fitted, remedy),
        remarks=(*remarks, *remarks_on_readings(sources)),
        scatter=scatter,
    )


def _estimate(fitted: Fit, reported: ReportedNumber, origin: tuple[str, ...]) -> Estimate:
    """Return one estimate of a fit with verdict and sentence; ``origin`` are references of the recordings used."""
    index = [*fitted.by_name].index(reported.path)
    value, low, high = (float(column[index]) for column in (fitted.values, fitted.low, fitted.high))
    number = fitted.numbers[index]
    width = relative_half_width(value, low, high, reported.size)
    bound = next((end for end in (number.low, number.high) if abs(value - end) <= _AT_BOUND * number.scale), None)
    # Not 1e-17 where 0 is meant.
    value = value if bound is None else bound
    # A part whose interval begins at its bound of zero cannot be distinguished from no part.
    is_part = reported.size is not None and number.low == 0.0 >= low
    if is_part and high < _NONE * (reported.size or 0.0):
        value = bound = 0.0
    verdict: Verdict = "identified"
    sentence = f"{reported.text}; {widened_by(fitted, reported.path)}."
    if bound == 0.0 and reported.size is not None and width < UNKNOWN:
        sentence = f"{reported.text}: none; {widened_by(fitted, reported.path)}."
        verdict = "identified" if fitted.conflict is None else "holds for this model only"
    elif bound is not None:
        verdict = "at its bound"
        sentence = f"{sentence} The readings favour a value at or beyond {value:.4g}; the interval ends there."
    elif width >= UNKNOWN or is_part:
        verdict, sentence = "not identifiable", f"{sentence} The interval includes zero or twice the value."
    elif fitted.conflict is not None:
        verdict = "holds for this model only"
    path, unit, size = reported.path, reported.unit, reported.size
    return Estimate(path, value, unit, low, high, verdict, sentence, origin, fitted.confidence, size)


_SIZE = (3.1, 2.7)
"""Width and height of a panel [in] for two panels side by side in a journal column."""


def bench_figure(panels: Sequence[Panel], kind: RecordingKind) -> "Figure":
    """Draw the two panels of a procedure side by side, lettered A and B."""
    pairs = zip("AB", panels, strict=True)
    lettered = [replace(panel, title=f"$\\bf{{{letter}}}$   {panel.title}") for letter, panel in pairs]
    return draw_panels(lettered, 2, _SIZE, kind=kind)


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
