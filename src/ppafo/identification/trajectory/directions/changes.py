"""What a little of an effect changes: runs of a program in which effects act, beside one in which they are not felt."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from ppafo.identification.trajectory.directions.heat import HEAT, WALLS
from ppafo.identification.trajectory.directions.kind import Direction
from ppafo.identification.trajectory.problem import TIME_OFFSET, with_numbers
from ppafo.identification.trajectory.residuals import (
    Floats,
    PreparedExperiment,
    Residuals,
    numbers_in,
    prepare_samples,
    signals_at,
)
from ppafo.parameters.plant import effects_of
from ppafo.simulation.numbers import number_at
from ppafo.simulation.scenario import FreeMotion, Scenario, Thermal


def can_have(scenario: Scenario, direction: Direction) -> bool:
    """Return whether an effect can be tried: a free vane, a scenario that it suits, and it is not on already."""
    is_on = any(effect.name == direction.name for effect in effects_of(scenario.device))
    return isinstance(scenario.motion, FreeMotion) and direction.suits(scenario) and not is_on


def as_it_is(scenario: Scenario) -> Scenario | None:
    """Return the scenario itself."""
    return scenario


def with_heat(scenario: Scenario) -> Scenario | None:
    """Return the scenario with gas whose temperature follows from its energy, None where it has it already."""
    return None if scenario.thermal is not None else replace(scenario, thermal=Thermal(1.0, WALLS))


def fitted_experiment(prepared: PreparedExperiment, residuals: Residuals, point: Floats) -> PreparedExperiment:
    """Return an experiment with the numbers of fitted coordinates in its scenario."""
    numbers = numbers_in(prepared.label, residuals.ranges, point)
    offset = numbers.pop(TIME_OFFSET, prepared.time_offset)
    return replace(prepared, scenario=with_numbers(prepared.scenario, numbers), time_offset=offset)


def stacked(prepared: PreparedExperiment, signals: Mapping[str, Floats]) -> Floats:
    """Return the channels over their noise, one below the other (samples, runs)."""
    return np.concatenate([signals[channel.name] / channel.noise for channel in prepared.channels])


def changes_by_size(
    prepared: Sequence[PreparedExperiment], effects: Sequence[Direction]
) -> Iterator[tuple[Direction, list[tuple[float, Floats]]]]:
    """Yield each effect, and heat, with the sizes at which all runs succeed and the changes (samples,) there."""
    for directions, prepare in ((effects, as_it_is), ((HEAT,), with_heat)):
        sizes = [(direction, size) for direction in directions for size in direction.sizes]
        changes = np.concatenate([changes_with(one, sizes, prepare) for one in prepared]).T
        for direction in directions:
            yield (
                direction,
                [
                    (size, change)
                    for (one, size), change in zip(sizes, changes, strict=True)
                    if one is direction and np.isfinite(change).all()
                ],
            )


def changes_with(
    prepared: PreparedExperiment,
    sizes: Sequence[tuple[Direction, float]],
    prepare: Callable[[Scenario], Scenario | None],
) -> Floats:
    """Return the changes of the channels over their noise (samples, sizes), 0 where an effect cannot be."""
    count = sum(len(channel.values) for channel in prepared.channels)
    scenario = prepare(prepared.scenario)
    used = [place for place, (one, _) in enumerate(sizes) if one is HEAT or can_have(prepared.scenario, one)]
    found = np.zeros((count, len(sizes)))
    if scenario is None or not used:
        return found
    made = with_unfelt(prepared, scenario, [sizes[place][0] for place in used])
    columns: dict[str, Floats] = {}
    for run, place in enumerate(used):
        direction, size = sizes[place]
        for path, number in direction.settings(size, prepared.scenario).items():
            columns.setdefault(path, np.full(len(used) + 1, number_at(made.scenario, path)))[run] = number
    values = stacked(prepared, signals_at(made, columns, len(used) + 1))
    found[:, used] = values[:, :-1] - values[:, -1:]
    return found


def with_unfelt(
    prepared: PreparedExperiment, scenario: Scenario, directions: Sequence[Direction]
) -> PreparedExperiment:
    """Return an experiment on a program in which effects act that change nothing yet."""
    neutral = {path: number for one in directions for path, number in one.neutral.items()}
    made = prepare_samples(prepared.label, with_numbers(scenario, neutral), prepared.samples, {}, prepared.recorded)
    return replace(made, time_offset=prepared.time_offset, of_sensors=prepared.of_sensors)
