"""Does a trajectory fit tell the truth about its own uncertainty? Planted values, many synthetic recordings."""

from benchmarks.intervals.coverage import Coverage, coverage, coverage_text
from benchmarks.intervals.planted import (
    EIGHT_PARAMETERS,
    NOISE,
    Planted,
    eight_parameters,
    noisy_recordings,
    planted_problem,
    two_step_responses,
)

__all__ = [
    "EIGHT_PARAMETERS",
    "NOISE",
    "Coverage",
    "Planted",
    "coverage",
    "coverage_text",
    "eight_parameters",
    "noisy_recordings",
    "planted_problem",
    "two_step_responses",
]
