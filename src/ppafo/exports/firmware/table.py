"""Every integer controller on every target: what it takes, and how many of its decisions differ."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from ppafo.exports.firmware.catalog import target_of
from ppafo.exports.firmware.lock_step import Comparison, compare_drawn
from ppafo.exports.firmware.simulator import missing_tools
from ppafo.exports.firmware.target import Target
from ppafo.simulation.loading import load_scenario

FIXED = "controller.arithmetic=fixed"


class TriedLaw(NamedTuple):
    """A controller in words, and the scenario with the settings that it is tried with."""

    said: str
    scenario: str
    overrides: tuple[str, ...]


TRIED = (
    TriedLaw("`pid`", "torque-task-proportional", (FIXED,)),
    TriedLaw("`pid`, with filter and anti-windup", "torque-task-anti-windup", (FIXED,)),
    TriedLaw("`on_off`", "torque-task-solenoid", (FIXED,)),
    TriedLaw("`on_off_dead_zone`", "torque-task-proportional", ("controller.kind=on_off_dead_zone", FIXED)),
)
"""What the table has, for each target."""


class Row(NamedTuple):
    """A controller on a target: what was found, None where a tool is ``missing``."""

    law: str
    target: Target
    found: Comparison | None
    missing: tuple[str, ...]


def rows(targets: Sequence[str], samples: int) -> Iterator[Row]:
    """The rows of the table, each after so many drawn samples on the simulator and in Python."""
    for name in targets:
        target = target_of(name)
        missing = missing_tools(target)
        for law in TRIED:
            scenario = load_scenario(law.scenario, law.overrides)
            found = None if missing else compare_drawn(scenario, samples, target=name)
            yield Row(law=law.said, target=target, found=found, missing=missing)
