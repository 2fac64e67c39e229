"""A neuromuscular gait model in an exported library: body and start are numbers of the source, its gains settings."""

from collections.abc import Iterator
from dataclasses import replace

from ppafo.constants import STANDARD_GRAVITY
from ppafo.exports.c_library.files import c_identifier
from ppafo.exports.c_library.preparation import Writing, Written
from ppafo.exports.c_library.walk_preparation import ExportedWalk
from ppafo.model.sensors import NOTHING_SEEN
from ppafo.simulation.scenario import Scenario
from ppafo.walking.motion import WalkMotion, walk_of
from ppafo.walking.preparation import device_share, vented_state, without_leg
from ppafo.wearer.settings import ReactingWearer, start_of_body, wearer_of_walk


def _body(configuration: Scenario, writing: Writing) -> Iterator[str]:
    """Lines that make the body of a neuromuscular gait model, its share of the device and the plant without a leg."""
    add, wearer = writing.add, wearer_of_walk(walk_of(configuration))
    yield f"share = {add(device_share)}(bare, {STANDARD_GRAVITY!r})"
    yield f"plant = {add(without_leg)}(bare)"
    yield f"wearer = {writing.constant(_as_settings(wearer).row(), 'wearer')}"


def _as_settings(wearer: ReactingWearer) -> ReactingWearer:
    """The wearer whose numbers are those that the settings of a library have."""
    return replace(wearer, settings={name: Written(c_identifier(f"wearer.{name}")) for name in wearer.settings})


def _start(configuration: Scenario, writing: Writing) -> Iterator[str]:
    """Lines that make the states at the start of a neuromuscular gait model."""
    add, start = writing.add, start_of_body(_as_settings(wearer_of_walk(walk_of(configuration))))
    rows = {"walk": start.walk, "walker": start.walker, "reflexes": start.reflexes, "nerves": start.nerves}
    for name, row in rows.items():
        yield f"{name} = {writing.constant(row, name)}"
    yield f"gait_seen = {writing.constant(NOTHING_SEEN, 'gait_seen')}"
    yield f"state = {add(vented_state)}(plant, {start.ankle!r}, 0.0)"


def _words(motion: WalkMotion) -> tuple[tuple[str, ...], str]:
    name = wearer_of_walk(motion).name
    return (
        f"the wearer, `{name}`: its body and muscles are numbers in the source, its gains settings",
    ), "the body alone"


REACTING_WALK = ExportedWalk(_body, _start, _words)
"""The walk of a neuromuscular gait model."""
