"""Every entry of every catalogue keeps the contract of its kind."""

import itertools
import math
import random
import re
from dataclasses import replace
from typing import Any, NamedTuple

import pytest

from ppafo import load_device
from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.control.kind import ControllerKind, ProfileKind
from ppafo.control.walking.catalog import WALKING_CONTROLLERS
from ppafo.engine.rows import leaf_paths, numbers, rebuilt
from ppafo.model.catalog import VALVES
from ppafo.model.plant import Openings
from ppafo.model.sensors import Measurement
from ppafo.model.valves.kind import ValveKind, ValveModel, valve_problem
from ppafo.parameters.natural_laws import valve_departure
from ppafo.parameters.plant import plant_parameters

CATALOGS = [*CONTROLLERS.items(), *WALKING_CONTROLLERS.items(), *PROFILES.items(), *VALVES.items()]


def defaults(kind: ControllerKind | ProfileKind | ValveKind) -> dict[str, float]:
    """A setting for every quantity."""
    return {
        item.name: min(1.0, 0.9 * item.maximum) if item.default is None else item.default for item in kind.quantities
    }


def valve_models() -> list[tuple[str, ValveModel, Any]]:
    """Every model that the valves choose, with settings that lead to it."""
    found = []
    for name, kind in VALVES.items():
        settings = defaults(kind)
        busy = {item.name: min(item.maximum, max(item.minimum, 0.01)) for item in kind.quantities}
        busy |= {"spool_frequency": 80.0} if "spool_frequency" in busy else {}
        for label, given in (("plain", kind.settings(**settings)), ("busy", kind.settings(**busy))):
            found.append((f"{name}-{label}", kind.choose(given), given))
    return found


@pytest.mark.parametrize(("name", "kind"), CATALOGS)
def test_catalogue_entries_are_found_by_their_own_name_and_say_what_they_are(name: str, kind: ValveKind) -> None:
    assert kind.name == name
    assert kind.summary.endswith(".")
    for quantity in kind.quantities:
        assert quantity.summary
        assert quantity.default is None or quantity.minimum <= quantity.default <= quantity.maximum


def field_names(row: type) -> list[str]:
    """Names of all numbers in a NamedTuple class, those of nested ones in their place; a table's begin as it does."""
    return [path.partition(".")[2] for path in leaf_paths(row, "")]


def names_field(name: str, field: str) -> bool:
    """True where a quantity has the name of its field: ``knot_3`` of ``knots[3]``, ``time_02`` of a knot's time."""
    place = re.fullmatch(r"(?:.*\.)?(\w+)s\[(\d+)\](?:\.(\w+))?", field)
    if place is None:
        return name.endswith(field.rpartition(".")[2])
    table, number, inner = place.groups()
    return name == f"{table}_{number}" if inner is None else name == f"{inner}_{int(number) + 2:02}"


def numbers_by_name(kind: ControllerKind | ProfileKind) -> dict[str, float]:
    """What a kind computes with: a setting for every quantity, or what its plan makes of these."""
    plan = getattr(kind, "plan", None)
    given = defaults(kind)
    return given if plan is None else plan(given, 1e-3, 1.451e-5, (-5.0, 5.0))[0]


@pytest.mark.parametrize("kind", [*CONTROLLERS.values(), *PROFILES.values()], ids=lambda kind: kind.name)
def test_the_numbers_of_a_kind_are_the_fields_of_its_parameters_in_order(kind: ControllerKind | ProfileKind) -> None:
    for name, field in zip(numbers_by_name(kind), field_names(kind.parameters), strict=True):
        assert names_field(name, field)


@pytest.mark.parametrize("kind", WALKING_CONTROLLERS.values(), ids=lambda kind: kind.name)
def test_quantities_of_walking_controllers_end_in_the_name_of_their_field(kind: ControllerKind) -> None:
    names = [item.name for item in kind.quantities]
    assert len(set(names)) == len(names)
    for name, field in zip(names, field_names(kind.parameters), strict=True):
        assert names_field(name, field)


@pytest.mark.parametrize("kind", CONTROLLERS.values(), ids=lambda kind: kind.name)
@pytest.mark.parametrize("torque", [-50.0, -1.0, 0.0, 1.0, 50.0])
def test_controllers_return_commands_from_minus_one_to_one_and_a_state_of_the_same_kind(
    kind: ControllerKind, torque: float
) -> None:
    parameters = rebuilt(kind.parameters, map(float, list(numbers_by_name(kind).values())))
    state = kind.initial
    for _ in range(5):
        command, state = kind.update(parameters, state, 2.0, Measurement(1.3, 2e5, 1e5, torque), 1e-3)
        assert -1.0 <= command <= 1.0
        assert type(state) is type(kind.initial)
        assert all(math.isfinite(number) for number in numbers(state))


@pytest.mark.parametrize("kind", PROFILES.values(), ids=lambda kind: kind.name)
def test_profiles_return_value_rate_and_second_derivative_that_belong_together(kind: ProfileKind) -> None:
    parameters = rebuilt(kind.parameters, map(float, list(defaults(kind).values())))
    width = 1e-5
    for time in (0.13, 0.41, 0.77, 1.31):
        _, rate, second = kind.value(parameters, time)
        before, after = kind.value(parameters, time - width), kind.value(parameters, time + width)
        assert rate == pytest.approx((after[0] - before[0]) / (2 * width), abs=1e-6)
        assert second == pytest.approx((after[1] - before[1]) / (2 * width), abs=1e-4)


@pytest.mark.parametrize("kind", PROFILES.values(), ids=lambda kind: kind.name)
def test_profiles_stay_within_the_bounds_that_they_state_and_reach_them(kind: ProfileKind) -> None:
    parameters = rebuilt(kind.parameters, map(float, list((defaults(kind) | {"level": -0.7}).values())))
    lowest, highest = kind.bounds(parameters)
    values = [kind.value(parameters, 0.001 * step)[0] for step in range(5000)]
    assert min(values) == pytest.approx(lowest, abs=1e-4)
    assert max(values) == pytest.approx(highest, abs=1e-4)
    assert lowest - 1e-9 <= min(values)
    assert max(values) <= highest + 1e-9


@pytest.mark.parametrize(("name", "model", "settings"), valve_models())
def test_valve_models_show_the_reference_solver_openings_between_0_and_1(
    name: str, model: ValveModel, settings: Any
) -> None:
    valve = model.prepare(settings)
    if model.instant is None:
        assert model.regulates
        return
    for command in (-1.0, -0.3, 0.0, 0.4, 1.0):
        state = model.settle(valve, model.state(), command, 0.0)
        openings = model.instant(valve, state, command)
        assert isinstance(openings, Openings), name
        assert all(0.0 <= share <= 1.0 for share in openings)
    plant = plant_parameters(load_device("ppafo2011"))
    assert valve_departure(model, settings, plant).size < 1e-9
    half = replace(model, instant=lambda *given: Openings(*(0.5 * share for share in model.instant(*given))))
    assert valve_departure(half, settings, plant).size > 0.1


@pytest.mark.parametrize(("name", "model", "settings"), valve_models())
def test_valve_states_survive_the_way_through_rows(name: str, model: ValveModel, settings: Any) -> None:
    state = model.settle(model.prepare(settings), model.state(), 0.6, 0.0)
    assert rebuilt(model.state, map(float, numbers(state))) == state, name
    bare = replace(model, state=NamedTuple("Bare", [("opening", float)]))
    assert "defaults of its state: give those of Bare: opening" in valve_problem(bare)
    unsaid = replace(model, connect=lambda _plant, shown: (shown, shown))
    assert "annotate its second parameter with the class of the output" in valve_problem(unsaid)
    assert valve_problem(model) == ""


@pytest.mark.parametrize("kind", VALVES.values(), ids=lambda kind: kind.name)
def test_a_valve_chooses_its_model_by_which_settings_are_zero_and_by_nothing_else(kind: ValveKind) -> None:
    draw = random.Random(kind.name)
    for _ in range(200):
        zeros = {item.name for item in kind.quantities if item.minimum == 0.0 and draw.random() < 0.5}
        drawn = [
            kind.settings(
                *(0.0 if item.name in zeros else draw.uniform(1e-6, item.maximum) for item in kind.quantities)
            )
            for _ in range(2)
        ]
        first, second = (kind.choose(settings) for settings in drawn)
        assert first is second
        assert [first.command_delay(settings) > 0.0 for settings in drawn] == [second.command_delay(drawn[1]) > 0.0] * 2


@pytest.mark.parametrize("kind", PROFILES.values(), ids=lambda kind: kind.name)
def test_a_profile_that_says_so_is_monotone(kind: ProfileKind) -> None:
    draw = random.Random(kind.name)
    turned = False
    for _ in range(100):
        drawn = [draw.uniform(max(item.minimum, -3.0), min(item.maximum, 3.0)) for item in kind.quantities]
        values = [kind.value(rebuilt(kind.parameters, map(float, drawn)), 0.05 * step)[0] for step in range(140)]
        changes = [later - earlier for earlier, later in itertools.pairwise(values)]
        turned = turned or (min(changes) < -1e-12 and max(changes) > 1e-12)
    assert turned != kind.is_monotone
