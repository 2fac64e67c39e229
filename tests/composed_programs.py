"""Programs that the catalogues can compose: every entry, with every feature of the engine, drawn at random."""

import random
from collections.abc import Iterator, Sequence
from typing import Any

from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.engine.entries import INLINE
from ppafo.engine.loop_text import write_lanes
from ppafo.engine.program import Program
from ppafo.engine.replay import RECORDED_ANGLE
from ppafo.engine.source_text import SourceCollector
from ppafo.engine.step import lines, walk
from ppafo.metrics import METRICS
from ppafo.metrics.metric import MetricKind
from ppafo.model.catalog import EFFECTS, VALVES
from ppafo.model.controlled import TORQUE
from ppafo.model.valves import vent_valve
from ppafo.model.valves.kind import ValveModel
from ppafo.signals.meter import MeterKind


def valve_models(walks: bool) -> list[ValveModel]:
    """Every model that the valves of the catalogue choose; a proportional one in a walk has a vent valve."""
    found: dict[int, ValveModel] = {}
    for kind in VALVES.values():
        choose = vent_valve.choose if walks and kind.name == "proportional" else kind.choose
        names = [item.name for item in kind.quantities]
        nothing = dict.fromkeys(names, 0.0)
        settings = [kind.settings(**given) for given in (nothing, *(nothing | {name: 0.01} for name in names))]
        for model in map(choose, settings):
            found |= {id(model): model}
    return list(found.values())


def is_of_any(kind: MetricKind) -> bool:
    """Whether a metric is read from a recording of any vane, not of a walk or of a foot on the shank of a gait."""
    return kind.compute is not None and not kind.needs


def meters() -> tuple[MeterKind, ...]:
    """Every meter of the metrics of recordings; those of walks have samples of their own."""
    return tuple({meter.name: meter for kind in METRICS.values() if is_of_any(kind) for meter in kind.meters}.values())


def lane_source(program: Program) -> str:
    """Source text of the module whose ``advance`` runs one block of a program."""
    return write_lanes(program, SourceCollector(INLINE))


def drawn_programs(count: int, seed: int = 1) -> Iterator[Program]:
    """``count`` programs, every third a walk, in which the entries of each catalogue take turns; the rest is drawn."""
    draw = random.Random(seed)
    valves, walking_valves = valve_models(walks=False), valve_models(walks=True)
    laws, walking_laws, profiles = (
        [None, *(law for law in CONTROLLERS.values() if law.plan is None)],
        list(WALKING_CONTROLLERS.values()),
        list(PROFILES.values()),
    )
    angles = [None, RECORDED_ANGLE, *profiles]
    for number in range(count):
        walks = number % 3 == 2
        angle = None if walks else angles[number % len(angles)]
        metered = not walks and draw.random() < 0.3
        law = _turn(walking_laws, number) if walks else _turn(laws, number)
        yield Program(
            valve=_turn(walking_valves if walks else valves, number),
            reference=PROFILES["constant"] if walks else _turn(profiles, number),
            controller=law,
            angle=angle,
            ideal_sensors=draw.random() < 0.5,
            late_commands=draw.random() < 0.3,
            late_signals=not walks and draw.random() < 0.3,
            effects=tuple(
                item for item in EFFECTS.values() if not (walks and item.section == "sensors") and draw.random() < 0.3
            ),
            is_thermal=draw.random() < 0.4,
            leg=walk if walks else None,
            feed=lines if draw.random() < 0.4 else None,
            # A free vane always goes through its steps in parts, a leg never as its error asks.
            is_adaptive=not walks and (angle is None or draw.random() < 0.5),
            samples_inside=draw.random() < 0.2,
            meters=meters() if metered else (),
            traced=("angle", "mass_1") if metered else (),
            controlled=TORQUE if law is None else _turn(law.controls, number),
        )


def _turn(items: Sequence[Any], number: int) -> Any:
    return items[number % len(items)]
