"""How far a run is from its equations: what changes where it runs again with a sixteenth of the allowed error.

The error of the time stepping falls with the allowed one, so nearly all of it is in that change.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from ppafo.engine.run import Run

SHORTER = 4
"""How many times shorter the steps of a finer run are; its allowed error is smaller by the square."""
MARGIN = 1.5
"""Estimated error over the change: it is then above the error in 99 % of drawn runs (docs/evidence.md)."""
LARGEST_OF_ANGLE, LARGEST_OF_PRESSURE = 2.0e-4, 1.0e-3
"""Errors over the ranges of angle and pressures that a run keeps to unless it is sensitive."""


@dataclass(frozen=True, slots=True)
class ErrorEstimate:
    """Estimated error of a run from its time stepping: largest over time of the angle [rad] and of a pressure [Pa].

    ``metrics`` has the error of each metric in its SI unit, inf where the finer run has no such number.
    """

    angle: float
    pressure: float
    metrics: Mapping[str, float]

    @property
    def sentence(self) -> str:
        """The errors of angle and pressures in the units that people are shown."""
        from ppafo.report.display_units import metric_change

        shown = (metric_change(self.angle, "rad"), metric_change(self.pressure, "Pa"))
        angle, pressure = (f"{value:.1e} {unit}" for value, unit in shown)
        return f"Estimated error of the steps: at most {angle} and {pressure}."


def unchanged(run: Run) -> Run:
    """Return a run as it is planned."""
    return run


def finer(run: Run) -> Run:
    """Return a run, or an ensemble, with a sixteenth of its allowed error and in steps a quarter as long."""
    return replace(
        run,
        tolerance=run.tolerance / SHORTER**2,
        step=run.step / SHORTER,
        step_count=SHORTER * run.step_count,
        steps_per_sample=SHORTER * run.steps_per_sample,
        record_every=SHORTER * run.record_every,
    )
