"""Print who of the shipped healthy wearers walks on over slopes and steps and after pushes, with the device and off.

Each cell counts the walks of 20 s without a fall, of eight in which slope, step or push begins at another place within
a stride: with the device off, and with it. Some four minutes of one processor:

    python scripts/uneven_ground.py
"""

import argparse

import numpy as np

from ppafo.simulation.ensemble import run_ensemble
from ppafo.walking import load_walk
from ppafo.walking.walk import with_device_off
from ppafo.wearer.loading import list_wearers

WEARERS = tuple(name for name in list_wearers() if name.startswith(("geyer", "healthy")))
PLACES = np.linspace(6.0, 7.2, 8)
"""Where it begins [m]: after three strides or more, spread over most of one."""

CONDITIONS = {
    "wearer.slope": ("slope", (-0.08, -0.06, -0.04, -0.02, 0.02, 0.04, 0.06, 0.08), "%", 100.0),
    "wearer.step_height": ("step", (-0.04, -0.03, -0.02, 0.02, 0.03, 0.04), "cm", 100.0),
    "wearer.push": ("push of 0.1 s", (-200.0, -100.0, -50.0, 50.0, 100.0, 200.0), "N", 1.0),
}
"""Setting, what it is called, values in SI, unit that is shown and its factor."""


def staying(wearer: str, is_off: bool, path: str, values: tuple[float, ...]) -> list[int]:
    """Return of how many places a wearer walks on, for each value."""
    scenario = load_walk("reacting", [f"wearer.name={wearer}", "run.duration=20 s"])
    place = "wearer.push_from" if path == "wearer.push" else "wearer.ground_from"
    columns = {path: np.repeat(values, PLACES.size), place: np.tile(PLACES, len(values))}
    found = run_ensemble(with_device_off(scenario) if is_off else scenario, columns, ["stays_up"])
    counts = found.metrics["stays_up"].reshape(len(values), PLACES.size).sum(axis=1)
    return [int(count) for count in counts.tolist()]


def main() -> None:
    """Print one table for each kind of condition."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("wearers", nargs="*", default=WEARERS)
    wearers = parser.parse_args().wearers
    for path, (title, values, unit, factor) in CONDITIONS.items():
        print(f"| {title} | " + " | ".join(f"{factor * value:+g} {unit}" for value in values) + " |")
        print("|---" * (len(values) + 1) + "|")
        for wearer in wearers:
            off, worn = (staying(wearer, is_off, path, values) for is_off in (True, False))
            cells = (f"{bare}, {own}" for bare, own in zip(off, worn, strict=True))
            print(f"| `{wearer}` | " + " | ".join(cells) + " |", flush=True)
        print()


if __name__ == "__main__":
    main()
