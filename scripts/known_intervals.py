"""Writes the intervals that a live page shows into ``page/intervals.json``: ``python scripts/known_intervals.py``.

They are those in which the study ``torque-task-uncertainty`` draws numbers of which the set does not say how well they
are known.
"""

import json
from importlib.resources import files
from pathlib import Path

import numpy as np

from ppafo.studies.loading import load_study

STUDY = "torque-task-uncertainty"
ENDS = (0.025, 0.975)


def known_intervals() -> dict[str, list[float]]:
    """Return both ends in SI, by the path of the number."""
    ends = np.array(ENDS)
    return {item.path: item.distribution.values(ends).tolist() for item in load_study(STUDY).drawn}


def main() -> int:
    """Write the file."""
    text = ",\n".join(f"{json.dumps(path)}: {json.dumps(ends)}" for path, ends in known_intervals().items())
    Path(str(files("ppafo.page").joinpath("intervals.json"))).write_text(f"{{\n{text}\n}}\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
