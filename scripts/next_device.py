"""Counts how often the intervals of several devices hold: of their mean, of their spread, and of the next device.

    python scripts/next_device.py --draws 1000 --seed 5

Populations are drawn: devices that spread by a multiple of the typical error of an estimate, errors that differ by up
to e on either side from device to device, and one further device. Printed for each number of devices: the percentage
of the 95 % intervals that hold, how often no difference is said to show, and how often a device of the very same kind
is said to be apart.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from ppafo.identification.devices import devices_apart, spread_of_devices

COUNTS, SPREADS = (3, 5, 10), (0.0, 0.5, 1.0, 3.0, 30.0)


def main() -> None:
    """Print the table, a row when it is done."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=5)
    words = parser.parse_args()
    print("| devices | spread over error | mean | spread | next device | no difference shows | falsely apart |")
    print("|---|---|---|---|---|---|---|")
    for count in COUNTS:
        for spread in SPREADS:
            random = np.random.default_rng([words.seed, count, int(10.0 * spread)])
            held = np.zeros(5)
            for _ in range(words.draws):
                errors = np.exp(random.uniform(-1.0, 1.0, count))
                drawn = random.normal(0.0, 1.0, (3, count + 1))
                values = spread * drawn[0, :count] + errors * drawn[1, :count]
                found = spread_of_devices(values.tolist(), errors.tolist())
                intervals = (found.mean_interval, found.spread_interval, found.next_device)
                truths = (0.0, spread, spread * drawn[2, 0])
                held[:3] += [low <= truth <= high for (low, high), truth in zip(intervals, truths, strict=True)]
                held[3:] += [found.is_common, bool(devices_apart(values.tolist(), errors.tolist()))]
            cells = " | ".join(f"{share:.1f} %" for share in 100.0 * held / words.draws)
            print(f"| {count} | {spread:g} | {cells} |", flush=True)


if __name__ == "__main__":
    main()
