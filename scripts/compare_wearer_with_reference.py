"""Compares wearers who react with the independent simulator of the tests: the first step, and ten strides.

    python scripts/compare_wearer_with_reference.py healthy-128 geyer-herr
    python scripts/compare_wearer_with_reference.py geyer-herr --steps 0.00625 0.003125

Prints two tables for each: how far the package is from the reference in the first 0.1 s, until the right foot strikes
and until the left foot strikes, at some steps, with the reference's own difference where its step is half as long
again; then strikes, lengths and means of ten strides, and when paths part. The device is vented, and its gas cannot
turn the ankle.
"""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from tests.reference.wearer_comparison import (
    SETTLED,
    STEPS,
    STRIDES,
    Columns,
    Floats,
    Strides,
    by_package,
    by_reference,
    gap,
    parted,
    strides_of,
)

FINE, COARSE = 100, 67
"""Steps of the reference in a millisecond, and what it is compared with."""
UNTIL = (0.1, 0.3, 0.9)
"""Times [s]: the first leg stands; the right foot has struck; so has the left one."""


def cells_of(series: list[Floats], number: int) -> str:
    """Cells of a row: one number of each series, a dash where a wearer fell before."""
    return " | ".join(f"{values[number]:.3f}" if number < values.size else "-" for values in series)


def compare(name: str, steps: Sequence[float]) -> None:
    """Print both tables of a wearer, with the package at these steps [ms]."""
    judged = by_reference(name, FINE)
    others: dict[str, Columns] = {f"package, {step:g} ms": by_package(name, step) for step in steps}
    others["reference, 15 us"] = by_reference(name, COARSE)
    print(f"\n{name}: largest difference from the reference\n")
    print("| | until (s) | hip (mm) | a joint (deg) | load (body weights) | activation |")
    print("|---|---|---|---|---|---|")
    for until in UNTIL:
        for title, seen in others.items():
            cells = " | ".join(f"{value:.2g}" for value in gap(seen, judged, until))
            print(f"| {title} | {until:g} | {cells} |")
    every: dict[str, Strides] = {title: strides_of(seen) for title, seen in others.items()}
    every = {"reference, 10 us": strides_of(judged), **every}
    parting = {title: (parted(seen, judged, 1.0), parted(seen, judged, 5.0)) for title, seen in others.items()}
    print(f"\n{name}: {STRIDES} strides of the left leg\n")
    print(f"| | {' | '.join(every)} |")
    print(f"|---|{'---|' * len(every)}")
    shown = (0, 2, 5, STRIDES - 1)
    for number in (*shown[:-1], STRIDES):
        print(f"| strike {number + 1} (s) | {cells_of([item.strikes for item in every.values()], number)} |")
    for number in shown:
        print(f"| length of stride {number + 1} (m) | {cells_of([item.lengths for item in every.values()], number)} |")
    for words, field in (
        ("length (m)", "length"),
        ("time (s)", "time"),
        ("speed (m/s)", "speed"),
        ("stance", "stance"),
    ):
        cells = " | ".join(f"{getattr(item, field):.4f}" for item in every.values())
        print(f"| mean from stride {SETTLED + 1} on, {words} | {cells} |")
    for place, limit in enumerate((1, 5)):
        cells = " | ".join("-" if not np.isfinite(at[place]) else f"{at[place]:.2f}" for at in parting.values())
        print(f"| a joint is {limit} deg from the reference's at (s) | - | {cells} |")


def main() -> int:
    """Compare the wearers that are named."""
    parser = argparse.ArgumentParser(description="Compare wearers who react with an independent simulator")
    parser.add_argument("names", nargs="*", default=["healthy-128", "geyer-herr"], help="wearers of the package")
    parser.add_argument("--steps", nargs="+", type=float, default=STEPS, help="steps of the package (ms)")
    arguments = parser.parse_args()
    for name in arguments.names:
        compare(name, arguments.steps)
    return 0


if __name__ == "__main__":
    sys.exit(main())
