"""Print how the shipped wearers who react walk for a minute from the start speeds of their files.

The first table has a row for each wearer, and for a healthy one with five strengths of the left tibialis. Each cell is
of the walk with the device off, then of that with it; a dash is a mean that there is none of. Its last column is the
largest change of the mean speed and of the mean time of a stride where the step is half as long. The second table says
with which strengths of the left tibialis, 2 to 80 % by 2 %, who is otherwise healthy falls within the minute. Some six
minutes of one processor:

    python scripts/shipped_wearers.py
"""

import argparse
from collections.abc import Iterator, Sequence
from itertools import groupby

import numpy as np

from ppafo.simulation.ensemble import run_ensemble
from ppafo.walking import load_walk
from ppafo.walking.walk import with_device_off
from ppafo.wearer.loading import list_wearers
from ppafo.wearer.settings import LONGEST_STEP

MEANS = {
    "walking_speed": ("speed (m/s)", 1.0, ".2f"),
    "stride_time": ("time of a stride (s)", 1.0, ".3f"),
    "lowest_toes": ("lowest toes (mm)", 1e3, ".1f"),
    "muscle_work": ("muscle work of a stride (J)", 1.0, ".1f"),
    "gas": ("gas of a stride (g)", 1e3, ".3f"),
}
"""Metrics that are shown, what they are called, factor from SI, and form."""

WEAKENED, STRENGTHS = "healthy-128", (0.05, 0.1, 0.2, 0.3, 0.5)
"""Whose left tibialis is weakened in the first table, and what is left of it."""
PERCENT = tuple(range(2, 82, 2))
"""Strengths of the second table [%]."""

Walks = dict[str, list[float]]


def walked(wearer: str, strengths: Sequence[float], is_off: bool, step: float = LONGEST_STEP) -> Walks:
    """Return the metrics of walks of a minute with shares of the left tibialis, by steps [s]."""
    scenario = load_walk("reacting", [f"wearer.name={wearer}", "run.duration=60 s", f"run.step={step} s"])
    columns = {"wearer.tibialis_strength": np.array(strengths)}
    found = run_ensemble(
        with_device_off(scenario) if is_off else scenario, columns, ["stays_up", "walked_time", *MEANS]
    )
    return {name: values.tolist() for name, values in found.metrics.items()}


def rows(wearer: str, strengths: Sequence[float]) -> Iterator[list[str]]:
    """Yield the cells of a wearer for each share of the left tibialis."""
    whole, half = (
        [walked(wearer, strengths, is_off, step) for is_off in (True, False)]
        for step in (LONGEST_STEP, LONGEST_STEP / 2)
    )
    for number in range(len(strengths)):
        yield [
            ", ".join(_end(own["stays_up"][number], own["walked_time"][number]) for own in whole),
            *(
                ", ".join(_shown(factor * own[metric][number], form) for own in whole)
                for metric, (_, factor, form) in MEANS.items()
            ),
            ", ".join(_shown(_change(*pair, number), ".1f") for pair in zip(whole, half, strict=True)),
        ]


def _change(whole: Walks, half: Walks, number: int) -> float:
    """Largest change of the means of a walk [%], NaN where one of both ends in a fall."""
    if min(whole["stays_up"][number], half["stays_up"][number]) < 0.5:
        return np.nan
    return 100.0 * max(abs(half[name][number] / whole[name][number] - 1.0) for name in ("walking_speed", "stride_time"))


def _end(stays: float, time: float) -> str:
    return "to the end" if stays > 0.5 else f"falls at {time:.1f} s"


def _shown(value: float, form: str) -> str:
    return f"{value:{form}}" if np.isfinite(value) else "-"


def falls(wearer: str, is_off: bool) -> str:
    """Return the strengths [%] with which a wearer falls, neighbours as a range."""
    stays = walked(wearer, [share / 100.0 for share in PERCENT], is_off)["stays_up"]
    ranges = [
        [share for share, _ in group]
        for fell, group in groupby(zip(PERCENT, stays, strict=True), key=lambda pair: pair[1] < 0.5)
        if fell
    ]
    return ", ".join(f"{own[0]} to {own[-1]}" if len(own) > 1 else f"{own[0]}" for own in ranges) or "none"


def head(*titles: str) -> None:
    """Print the head of a table."""
    print(f"| {' | '.join(titles)} |\n{'|---' * len(titles)}|")


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("wearers", nargs="*", default=list_wearers())
    named = parser.parse_args().wearers
    head("wearer", "walks", *(title for title, _, _ in MEANS.values()), "half the step (%)")
    for wearer in named:
        for cells in rows(wearer, [1.0]):
            print(f"| `{wearer}` | {' | '.join(cells)} |", flush=True)
    if WEAKENED in named:
        for strength, cells in zip(STRENGTHS, rows(WEAKENED, STRENGTHS), strict=True):
            print(f"| tibialis at {strength:.0%} | {' | '.join(cells)} |")
    print()
    head("tibialis with which who is otherwise healthy falls (%)", "device off", "with the device")
    for wearer in named:
        if wearer.startswith(("geyer", "healthy")):
            print(f"| `{wearer}` | {falls(wearer, True)} | {falls(wearer, False)} |", flush=True)


if __name__ == "__main__":
    main()
