"""Keys of texts that need not be composed again: what follows from the files of the package has one."""

import subprocess
import sys
from typing import Any

import pytest
from ppafo.control.walking.timing import TimingParts, threshold_time

from ppafo.control.controllers import pid, switching
from ppafo.control.walking import assistance
from ppafo.engine.package_key import package_key
from ppafo.golden_bits import plain_batch
from ppafo.model.binding import made_of

FOLDERS = ("control", "model", "signals")
"""Without the engine, of which the tests replace a function to count what is compiled."""


@pytest.mark.parametrize("name", ["swing-foot", "proportional", "proportional-regulators", "solenoid"])
def test_every_scenario_of_the_package_has_a_key(name: str) -> None:
    # A law that is bound to walking stands under no name of its own; nor does a shank that a gait leads.
    assert package_key(plain_batch(name).program, FOLDERS) is not None


def test_the_key_of_a_law_tells_what_its_parts_are() -> None:
    frame = assistance.timed_phase
    follows: Any = (pid.pid_update, switching.sliding_update)
    laws = [made_of(frame, "timed", TimingParts(part, threshold_time)) for part in follows]
    first: Any = threshold_time
    other = made_of(frame, "timed", TimingParts(first, follows[0]))
    keys = [package_key(law, FOLDERS) for law in (*laws, other)]
    assert None not in keys
    assert len({key.words for key in keys if key is not None}) == 3


def test_a_law_with_a_part_from_elsewhere_has_no_key() -> None:
    def elsewhere(value: float) -> float:
        return value

    made = made_of(assistance.timed_phase, "timed", TimingParts(elsewhere, threshold_time))  # type: ignore[arg-type]
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
        "[importlib.import_module(f'ppafo.{name}') for name in ('engine.cache.making', 'translation.native_source')]",
        "print(package_key(program).words == words)",
    )
    run = subprocess.run([sys.executable, "-c", "\n".join(lines)], check=True, capture_output=True, text=True)
    assert run.stdout == "True\n"
