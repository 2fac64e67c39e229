"""Writes what the page that simulates looks up: ``python scripts/page_tables.py``.

``page/opening.json`` has what each setting of a shipped scenario changes where a page opens with it,
``page/minutes.json`` how long the paper's bottle lasts, by the mean flow that is taken from it.
"""

import json
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.analyses.endurance.gas_demand import demand_of_numbers
from ppafo.analyses.endurance.solve import follow_bottle
from ppafo.constants import UNIVERSAL_GAS_CONSTANT
from ppafo.page.workbench import openings_of
from ppafo.parameters.bottles.bottle import PAPER_BOTTLE, load_bottle
from ppafo.simulation.loading import list_scenarios
from ppafo.walking import list_walks
from ppafo.walking.bottle.coupling import Schedule

FLOWS = np.geomspace(2e-6, 5e-3, 24)
"""Mean flows [kg/s] of the table."""
_LONGEST = 3e6
NAME = "the paper's 9 oz bottle of CO₂"


def minutes_of_bottle() -> dict[str, Any]:
    """Return name, flows [kg/s] and minutes: what ``ppafo bottle`` says of a steady gas use without rest."""
    bottle, schedule = load_bottle(PAPER_BOTTLE), Schedule(walk=_LONGEST, rest=0.0, longest=_LONGEST)
    draws = [demand_of_numbers(flow, 1.0, None) for flow in FLOWS.tolist()]
    lasting = [follow_bottle(bottle, draw, schedule).discharge.walking_time for draw in draws]
    return {
        "name": NAME,
        "molarMass": float(f"{UNIVERSAL_GAS_CONSTANT / bottle.fluid.table.gas_constant:.4g}"),
        "flows": [float(f"{flow:.4g}") for flow in FLOWS],
        "minutes": [float(f"{seconds / 60.0:.4g}") for seconds in lasting],
    }


def main() -> int:
    """Write both files."""
    names = [*list_scenarios(), *list_walks()]
    lines = [f"{json.dumps(name)}: {json.dumps(found)}" for name, found in openings_of(names).items()]
    for name, text in (
        ("opening", "{\n" + ",\n".join(lines) + "\n}"),
        ("minutes", json.dumps(minutes_of_bottle(), ensure_ascii=False)),
    ):
        Path(str(files("ppafo.page").joinpath(f"{name}.json"))).write_text(f"{text}\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
