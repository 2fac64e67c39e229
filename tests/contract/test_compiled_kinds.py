"""Every entry of every catalogue does the same compiled as it does in Python: all of them in one small module."""

import itertools
import math
import random
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.engine.cache.programs import load_generated
from ppafo.engine.entries import HEADER, INLINE
from ppafo.engine.rows import leaf_paths, numbers, rebuilt
from ppafo.engine.scheme.actuators import VANE_FUNCTIONS
from ppafo.engine.source_text import SourceCollector
from ppafo.metrics import METRICS
from ppafo.model.binding import made_of
from ppafo.model.catalog import EFFECTS, VALVES
from ppafo.model.effects.kind import PlantSnapshot
from ppafo.model.sensors import (
    Fault,
    GaitMeasurement,
    GaitSeen,
    GaitSensors,
    Measurement,
    SensorParameters,
    measure,
    measure_gait,
)
from ppafo.parameters.loading import load_device
from ppafo.parameters.plant import plant_parameters
from ppafo.signals.meter import EnergySample, FootSample, GasSample, MeterKind, ReferenceSummary, Sample, StrideSample
from tests.compilers_here import first_compiler

ROUNDING = 1.0e-12
"""Relative difference that the last bits of sines and exponentials may make."""


@dataclass(frozen=True, slots=True)
class Entry:
    """A function of a catalogue and the arguments that it is tried with."""

    name: str
    function: Callable[..., Any]
    arguments: list[tuple[Any, ...]]


def settings(kind: Any, draw: random.Random) -> list[float]:
    """Defaults of the quantities, or a number from 0.1 to 1 where there is none."""
    return [draw.uniform(0.1, 1.0) if item.default is None else item.default for item in kind.quantities]


def numbers_of(law: Any, draw: random.Random) -> list[float]:
    """What a law computes with: its settings, or what its plan makes of them."""
    found = settings(law, draw)
    if law.plan is None:
        return found
    named = dict(zip((item.name for item in law.quantities), found, strict=True))
    named["converter_range"] = 1.0e6  # that of the device: beyond it a reading is a broken wire
    return list(law.plan(named, 2.0e-3, 1.451e-5, (-5.0, 5.0))[0].values())


def controllers(draw: random.Random) -> Iterator[Entry]:
    """Laws of the torque task and of walking, each through a hundred samples of its own state."""
    for kind in [*CONTROLLERS.values(), *WALKING_CONTROLLERS.values()]:
        walks = kind.name in WALKING_CONTROLLERS
        parameters, state, tried = rebuilt(kind.parameters, map(float, numbers_of(kind, draw))), kind.initial, []
        for sample in range(100):
            pressures = [draw.uniform(1.0e5, 4.5e5) for _ in range(2)]
            seen: Any = Measurement(draw.uniform(0.9, 1.8), *pressures, draw.uniform(-8.0, 8.0))
            if walks:
                heel, toe = (400.0 * (sample // 10 % phases == 0) for phases in (2, 3))
                seen = GaitMeasurement(*seen, heel + draw.uniform(0.0, 9.0), toe + draw.uniform(0.0, 9.0))
            tried.append((parameters, state, draw.uniform(-5.0, 5.0), seen, 2.0e-3))
            _, state = kind.update(*tried[-1])
        yield Entry(kind.name, kind.update, tried)


def profiles(draw: random.Random) -> Iterator[Entry]:
    """Functions of time."""
    for kind in PROFILES.values():
        points = {f"time_{number:02}": 0.07 * number for number in range(1, 40)} | {"period": 1.7}
        drawn = zip(kind.quantities, settings(kind, draw), strict=True)
        numbers = [points.get(item.name, value or draw.uniform(0.1, 2.0)) for item, value in drawn]
        parameters = rebuilt(kind.parameters, map(float, numbers))
        yield Entry(kind.name, kind.value, [(parameters, 0.031 * step) for step in range(60)])


def valves(draw: random.Random) -> Iterator[Entry]:
    """Every model that a valve chooses, for the engine and for the reference solver."""
    for kind in VALVES.values():
        plain = {item.name: item.default or 0.0 for item in kind.quantities}
        busy = {item.name: min(item.maximum, max(item.minimum, 0.01)) for item in kind.quantities}
        busy |= {"spool_frequency": 80.0} if "spool_frequency" in busy else {}
        both = kind.settings(**plain), kind.settings(**busy)
        models = {id(kind.choose(given)): (kind.choose(given), given) for given in both}
        for number, (model, given) in enumerate(models.values()):
            valve, state = model.prepare(given), model.initial()
            stepped, instants, events, shifts = [], [], [], []
            for step in range(60):
                command, time = draw.choice([-1.0, 0.0, 1.0, draw.uniform(-1.0, 1.0)]), 1.0e-3 * step
                state = model.settle(valve, state, command, time)
                stepped.append((valve, state, command, time, 1.0e-3))
                instants.append((valve, state, command))
                events.append((valve, state, command, time))
                before, (_, state) = state, model.advance(*stepped[-1])
                shifts.append((before, state))
            name = f"{kind.name}_{number}"
            yield Entry(f"{name}_advance", model.advance, stepped)
            yield Entry(f"{name}_instant", model.instant, instants)
            yield Entry(f"{name}_rates", model.rates, instants)
            yield Entry(f"{name}_next_event", model.next_event, events)
            yield Entry(f"{name}_settle", model.settle, events)
            if model.shift is not None:
                yield Entry(f"{name}_shift", model.shift, shifts)


def sensors(draw: random.Random) -> Iterator[Entry]:
    """Sensors of the torque task, and those of a walk with noise, lost samples and faults."""
    noisy = SensorParameters(0.01, 500.0, 0.002, 300.0, 12345.0)
    fault = Fault(0.02, 1.0, 0.0)
    gait = GaitSensors(
        *(50.0, 2.0, 1.0, 0.2, 0.3, 0.3, 0.2, 0.2),
        *(fault, Fault(0.01, 0.0, 0.0, 1.0, 0.8, 5.0, 90.0, 0.3, 0.7, 0.2, 0.02), *(Fault(9.0, 0.0, 1.0),) * 2),
        Fault(0.03, 0.0, 2e5),
    )
    seen = made_of(measure, "measure", VANE_FUNCTIONS)
    seen_in_gait = made_of(measure_gait, "measure_gait", VANE_FUNCTIONS)
    shown, plant = GaitSeen(*(0.0,) * 8), plant_parameters(load_device("ppafo2011"))
    readings, walking = [], []
    for sample in range(50):
        now = draw.uniform(0.9, 1.8), draw.uniform(1e5, 4e5), draw.uniform(1e5, 4e5)
        readings.append((noisy, *now, plant, sample))
        walking.append(
            (noisy, gait, shown, *now, draw.uniform(0, 400), draw.uniform(0, 400), plant, 1e-3 * sample, sample)
        )
        _, shown = seen_in_gait(*walking[-1])
    yield Entry("measure", seen, readings)
    yield Entry("measure_gait", seen_in_gait, walking)


def effects(draw: random.Random) -> Iterator[Entry]:
    """States of effects, and laws that call no place of another."""

    def numbers(row: Any) -> Any:
        return rebuilt(row, map(float, [draw.uniform(0.5, 2.0) for _ in leaf_paths(row, "")]))

    for effect in EFFECTS.values():
        if effect.state is None:
            continue
        row, state = effect.parameters, effect.state.row
        moments = [
            (numbers(row), numbers(state), numbers(PlantSnapshot), numbers(PlantSnapshot), 1e-3) for _ in range(50)
        ]
        if effect.state.start is not None:
            yield Entry(f"{effect.name}_start", effect.state.start, [(given[0], given[2]) for given in moments])
        yield Entry(f"{effect.name}_advance", effect.state.advance, moments)
        yield Entry(f"{effect.name}_slopes", effect.state.slopes, [given[:3] for given in moments])


def meters(draw: random.Random) -> Iterator[Entry]:
    """What is worked out sample by sample for the metrics."""
    course = ReferenceSummary(2.0, 2.0, 1.0e-6, 20.0, 60.0)
    samples = []
    for number in range(60):
        drawn = [draw.uniform(-2.0, 2.0) for _ in range(7)]
        temperatures = [draw.uniform(250.0, 350.0) for _ in range(2)]
        stride = StrideSample(
            supplied_mass=1.0e-4 * number,
            strides=float(number // 8),
            positive_push_off_work=0.1 * number,
            net_push_off_work=0.1 * number - 0.2 * (number // 8),
            clearances=-0.01 * (number // 8),
            toe_landings=float(number // 20),
            phase=float(number % 4),
            level=1.0 if 40 < number < 44 else 0.0,
            time=0.01 * number,
        )
        foot = FootSample(drawn[0] + 0.1, 0.9 * drawn[0], 0.01 * drawn[5])
        gas = GasSample(*(1.0e-6 * number * place for place in range(1, 6)))
        energy = EnergySample(*(0.3 * number * place for place in range(1, 6)))
        samples.append(Sample(float(number), *drawn, min(0.1 * number, 2.0), *temperatures, gas, energy, foot, stride))
    kinds: dict[str, MeterKind] = {meter.name: meter for kind in METRICS.values() for meter in kind.meters}
    for name, kind in kinds.items():
        state = kind.start(course, samples[0])
        tried = []
        for sample in samples[1:]:
            tried.append((state, course, sample))
            state = kind.update(*tried[-1])
        yield Entry(f"{name}_start", kind.start, [(course, sample) for sample in samples])
        yield Entry(f"{name}_update", kind.update, tried)


def entries() -> list[Entry]:
    """All that there is, drawn anew in the same way each time; a new entry of one part moves no draw of another."""
    parts = (controllers, profiles, valves, sensors, effects, meters)
    return [entry for part in parts for entry in part(random.Random(f"20261 {part.__name__}"))]


ENTRIES = {f"{number}_{entry.name}": entry for number, entry in enumerate(entries())}


def written(value: Any, cells: Iterator[int], collector: SourceCollector) -> str:
    """Text that makes an argument from the numbers in ``x``."""
    if isinstance(value, tuple):
        inner = ", ".join(written(item, cells, collector) for item in value)
        if type(value) is tuple:
            return f"({inner},)" if value else "()"
        return f"{collector.add(type(value))}({inner})"
    return f"int(x[{next(cells)}])" if isinstance(value, int) else f"x[{next(cells)}]"


def places(value: Any, path: str) -> list[str]:
    """Where the numbers of a result are, by index."""
    if not isinstance(value, tuple):
        return [path]
    return [place for number, item in enumerate(value) for place in places(item, f"{path}[{number}]")]


@pytest.fixture(scope="module")
def compiled() -> Any:
    """One module whose ``run(x, y, which)`` calls the entry of that number."""
    collector = SourceCollector(INLINE)
    lines = []
    for number, entry in enumerate(ENTRIES.values()):
        given = ", ".join(
            written(value, cells, collector) for cells in [itertools.count()] for value in entry.arguments[0]
        )
        result = f"result_{number}"
        paths = places(entry.function(*entry.arguments[0]), result)
        lines += [f"    if which == {number}:", f"        {result} = {collector.add(entry.function)}({given})"]
        lines += [f"        y[{place}] = {path}" for place, path in enumerate(paths)]
    loop = '@entry("void(float64[::1], float64[::1], int64)")\ndef run(x, y, which):'
    return load_generated("\n".join([HEADER, collector.text(), loop, *lines]) + "\n", first_compiler())


@pytest.mark.parametrize("name", ENTRIES)
def test_an_entry_gives_the_same_compiled_and_interpreted(compiled: Any, name: str) -> None:
    entry = ENTRIES[name]
    results = set()
    for arguments in entry.arguments:
        expected = numbers(result if isinstance(result := entry.function(*arguments), tuple) else (result,))
        found = np.full(len(expected), math.nan)
        compiled.run(np.array(numbers(arguments)), found, list(ENTRIES).index(name))
        assert found == pytest.approx(expected, rel=ROUNDING, abs=1.0e-15)
        results.add(tuple(expected))
    assert (
        len(results) > 1
        or entry.name in ("off", "constant", "spool_play_slopes")
        or entry.name.endswith(("_rates", "_next_event", "_start"))
    )
