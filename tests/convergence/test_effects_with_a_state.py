"""An effect whose state acts back on the gas keeps the order of the step; its error bounds steps, and it can fail."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Annotated, NamedTuple

import pytest

from ppafo.model.catalog import EFFECTS
from ppafo.model.declaration import Number
from ppafo.model.effects.kind import Effect, PlantSnapshot, State
from ppafo.model.ports import at_valve, opening_time
from ppafo.model.valves.proportional import spool_position
from ppafo.running import simulate
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from tests.page_code import with_the_effect_of_the_page
from tests.reference.reference_solver import compare_with_reference, solve_reference

ICE = ("effects.ice.blockage_per_gas=3e4 1/kg", "effects.ice.melting_time=30 ms")
VENTING = (
    *("controller.kind=constant", "controller.command=-0.5", "controller.rate=125 Hz", "initial.pressure_1=40 psi_g"),
    *("actuator.displacement_per_radian=51 cm^3/rad", "actuator.dead_volume_1=2 cm^3", "actuator.dead_volume_2=2 cm^3"),
    *("motion.angle=130 deg", "run.duration=0.2 s", "run.output_interval=4 ms"),
)


@pytest.fixture
def _ice(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    yield from with_the_effect_of_the_page(tmp_path, monkeypatch)


@pytest.mark.usefixtures("_ice")
def test_a_state_that_acts_on_the_gas_leaves_the_step_its_second_order() -> None:
    reference = None
    errors = []
    for step in ("2 ms", "0.25 ms"):
        run = plan_run(load_scenario("torque-task-proportional", (*VENTING, *ICE, f"run.step={step}")))
        whole = replace(run, needs_parts=False)
        reference = reference or solve_reference(whole)
        errors.append(compare_with_reference(whole, reference).pressure_1_rms)
    assert errors[0] / errors[1] > 0.8 * 8**2


@pytest.mark.usefixtures("_ice")
def test_the_error_of_a_state_shortens_steps() -> None:
    run = plan_run(
        load_scenario("step-response", ("effects.ice.blockage_per_gas=1e6 1/kg", "effects.ice.melting_time=3 ms"))
    )
    *others, ice = run.program.effects
    assert ice.state is not None
    reference = solve_reference(run)
    errors = []
    for tolerances in ((), (1e-6,)):
        effect = replace(ice, state=replace(ice.state, tolerances=tolerances))
        own = replace(run, program=replace(run.program, effects=(*others, effect)))
        errors.append(compare_with_reference(own, reference).worst_pressure)
    assert errors[1] < 0.5 * errors[0]


class Runaway(NamedTuple):
    """A rate [1/s]."""

    rate: Annotated[float, Number("1/s", "rate", 0.0, 0.0, 1e6)]


class Amount(NamedTuple):
    """What grows [-]."""

    amount: float


def started(_runaway: Runaway, _now: PlantSnapshot) -> Amount:
    """One."""
    return Amount(1.0)


def advanced(
    runaway: Runaway, runaway_state: Amount, _before: PlantSnapshot, _after: PlantSnapshot, step: float
) -> Amount:
    """More than any float in a few steps."""
    grown = runaway_state.amount * (1.0 + step * runaway.rate)
    return Amount(grown * grown * grown)


def grows(runaway: Runaway, runaway_state: Amount, _now: PlantSnapshot) -> Amount:
    """Its rate [1/s]."""
    return Amount(runaway.rate * runaway_state.amount)


@pytest.fixture
def _runaway() -> Iterator[None]:
    EFFECTS["runaway"] = Effect(
        name="runaway",
        summary="A state that leaves what is possible.",
        settings=Runaway,
        parameters=Runaway,
        prepare=None,
        switch=("rate",),
        laws={},
        state=State(row=Amount, start=started, advance=advanced, slopes=grows),
    )
    yield
    del EFFECTS["runaway"]


@pytest.mark.usefixtures("_runaway")
def test_a_state_that_leaves_what_is_possible_ends_the_run_with_a_status() -> None:
    result = simulate(load_scenario("step-response", ["effects.runaway.rate=1e5 1/s"]))
    assert not result.status.is_completed
    assert "diverged" in str(result.status)


class Play(NamedTuple):
    """Backlash [-] between command and spool."""

    width: Annotated[float, Number("", "backlash", 0.0, 0.0, 0.5)]


class Spool(NamedTuple):
    """Command behind the backlash [-]."""

    command: float = 0.0


def behind_play(command: float, play: Play, play_state: Spool) -> float:
    """Command [-] that the spool follows."""
    return spool_position(play_state.command, at_valve(command), play.width)


def drawn_along(_play: Play, _play_state: Spool, command: float) -> Spool:
    """The spool after a new command, which ``at_valve`` has already put behind the backlash."""
    return Spool(command)


def moved(_play: Play, _play_state: Spool, _before: PlantSnapshot, after: PlantSnapshot, _step: float) -> Spool:
    """The spool after a step."""
    return Spool(after.command)


def rests(_play: Play, _play_state: Spool, _now: PlantSnapshot) -> Spool:
    """No rate: the spool moves at a new command only."""
    return Spool(0.0)


class Wear(NamedTuple):
    """Slowing of the coil per gas supplied [1/kg]."""

    slowing: Annotated[float, Number("1/kg", "slowing", 0.0, 0.0, 1e6)]


class Worn(NamedTuple):
    """Slowing so far [-]."""

    slower: float = 0.0


def later(time: float, is_coil_a: float, wear: Wear, wear_state: Worn) -> float:
    """Opening time [s] of a coil."""
    return opening_time(time, is_coil_a) * (1.0 + wear_state.slower)


def worn(wear: Wear, wear_state: Worn, _before: PlantSnapshot, after: PlantSnapshot, step: float) -> Worn:
    """The slowing after a step."""
    return Worn(wear_state.slower + step * wear.slowing * after.supplied_flow)


def wears(wear: Wear, _wear_state: Worn, now: PlantSnapshot) -> Worn:
    """Its rate [1/s]."""
    return Worn(wear.slowing * now.supplied_flow)


@pytest.mark.parametrize(
    ("effect", "name", "texts"),
    [
        (
            Effect(
                "play",
                "Backlash.",
                Play,
                Play,
                None,
                ("width",),
                {at_valve: behind_play},
                state=State(Spool, None, moved, rests, settle=drawn_along),
            ),
            "torque-task-proportional",
            ("effects.play.width=0.2", "motion.kind=free", "run.duration=0.3 s"),
        ),
        (
            Effect(
                "wear",
                "Coils that slow.",
                Wear,
                Wear,
                None,
                ("slowing",),
                {opening_time: later},
                state=State(Worn, None, worn, wears),
            ),
            "torque-task-solenoid",
            ("effects.wear.slowing=1e4 1/kg", "valve.opening_delay=5 ms", "run.duration=0.5 s"),
        ),
    ],
    ids=["at_valve", "opening_time"],
)
def test_effects_of_others_on_command_and_coils_are_those_of_the_reference_solver(
    effect: Effect, name: str, texts: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(EFFECTS, effect.name, effect)
    run, plain = (plan_run(load_scenario(name, words)) for words in (texts, texts[1:]))
    agreement = compare_with_reference(run)
    assert agreement.angle < 2e-4
    assert agreement.worst_pressure < 1e-3
    assert compare_with_reference(plain, solve_reference(run)).worst_pressure > 2e-3
