"""Results do not depend on what a host program has set in its process: decimals, errors of NumPy, locale, warnings."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROGRAM = """
import sys
sys.path.insert(0, sys.argv[1])
if sys.argv[2] == "hostile":
    from tests.hostile_host import turn_hostile
    turn_hostile()
import ppafo
import ppafo.units
run = ppafo.simulate("torque-task-proportional", {"supply.pressure": "61.3 psi_g", "run.duration": "200 ms"})
print(run, run.metrics, sorted(ppafo.evaluate(run.recording).items()))
print(ppafo.audit("ppafo2011-printed"))
print(ppafo.units.parse_quantity("23.4 mm^3/min", "m^3/s"), ppafo.units.from_si(0.1, "in^2", "m^2"))
print(ppafo.bottle(gas_per_stride="0.3 g"))
run.plot()
"""


def printed(host: str) -> str:
    words = [sys.executable, "-c", PROGRAM, str(ROOT), host]
    surroundings = {**os.environ, "MPLBACKEND": "agg"}
    return subprocess.run(words, check=True, stdout=subprocess.PIPE, text=True, env=surroundings).stdout


@pytest.mark.long
def test_a_program_prints_the_same_in_a_hostile_host() -> None:
    assert printed("hostile") == printed("friendly")
