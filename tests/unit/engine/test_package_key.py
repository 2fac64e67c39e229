"""Keys of texts that need not be composed again: what follows from the files of the package has one."""

import subprocess
import sys
from typing import Any

import pytest

from ppafo.control.controllers import pid
from ppafo.engine.package_key import package_key
from ppafo.golden_bits import plain_batch
from ppafo.model.binding import made_of
from ppafo.model.controlled import OF_TORQUE, turned_round

FOLDERS = ("control", "model", "signals")
"""Without the engine, of which the tests replace a function to count what is compiled."""


@pytest.mark.parametrize("name", ["swing-foot", "proportional", "proportional-regulators", "solenoid"])
def test_every_scenario_of_the_package_has_a_key(name: str) -> None:
    # A law that is bound to walking stands under no name of its own; nor does a shank that a gait leads.
    assert package_key(plain_batch(name).program, FOLDERS) is not None


def test_the_key_of_a_law_tells_what_its_parts_are() -> None:
    other: Any = pid.pid_update
    parts = (OF_TORQUE, OF_TORQUE._replace(steered=turned_round), OF_TORQUE._replace(value=other))
    keys = [package_key(made_of(pid.pid_update, "timed", each), FOLDERS) for each in parts]
    assert None not in keys
    assert len({key.words for key in keys if key is not None}) == 3


def test_a_law_with_a_part_from_elsewhere_has_no_key() -> None:
    def elsewhere(value: float) -> float:
        return value

    made = made_of(pid.pid_update, "timed", OF_TORQUE._replace(steered=elsewhere))
    assert package_key(made, FOLDERS) is None


def test_a_process_that_has_written_one_text_finds_the_next_under_the_key_of_a_process_that_has_written_none() -> None:
    lines = (
        "import importlib",
        "from ppafo.engine.lanes import write_source",
        "from ppafo.engine.package_key import package_key",
        "from ppafo.golden_bits import plain_batch",
        "program = plain_batch('proportional').program",
        "words = package_key(program).words",
        "write_source(program)",
        "[importlib.import_module(f'ppafo.{name}') for name in ('engine.cache', 'translation.native_source')]",
        "print(package_key(program).words == words)",
    )
    run = subprocess.run([sys.executable, "-c", "\n".join(lines)], check=True, capture_output=True, text=True)
    assert run.stdout == "True\n"
