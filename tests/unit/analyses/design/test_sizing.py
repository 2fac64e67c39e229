"""Sizing: what is planted is found, what limits is named, and bad files are one line."""

import dataclasses
import re
import shlex
import shutil
import tomllib
from importlib import resources
from pathlib import Path
from types import SimpleNamespace

import jsonschema
import numpy as np
import pytest

from ppafo.analyses.design import search
from ppafo.analyses.design.problem import choose_knots, json_schema, load_design
from ppafo.analyses.design.question import design
from ppafo.analyses.design.search import (
    OSCILLATES,
    Sizing,
    Trials,
    ceiling_pressure,
    cut_error,
    finding_of,
    lasting_bottle,
    smallest_bottle,
    usage_of,
)
from ppafo.control.profiles import KNOTS
from ppafo.errors import PpafoError
from ppafo.gait import load_gait
from ppafo.loading import load_scenario
from ppafo.parameters.bottles.bottle import load_bottle
from ppafo.running import simulate
from ppafo.signals import Channel, Recording
from ppafo.signals.recording import Floats
from ppafo.simulation.ensemble import COMPLETED
from ppafo.simulation.numbers import number_at
from ppafo.storage import write_csv
from ppafo.units import base_value

SHIPPED = Path(__file__).parents[4] / "src" / "ppafo" / "analyses" / "design" / "library" / "push-off.toml"
ATMOSPHERE = 101325.0
TORQUE_CONSTANT = 1.451e-5
FILE = """
schema_version = 1
name = "trapezium"
scenario = "torque-task-proportional"
bottles = ["co2-88g", "paper-co2-9oz"]
simulated = 1
gain_factors = [1.0, 4.0]

[profile]
time = ["0 s", "0.3 s", "0.6 s", "0.8 s", "1 s"]
torque = ["0 N m", "4 N m", "4 N m", "0 N m", "0 N m"]

[use]
repetitions = 100

[limits]
rms_error = "0.4 N m"

[valves.enfield-ls-v05s]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("sizing")
    (place / "trapezium.toml").write_text(FILE)
    return place


@pytest.fixture(scope="module")
def sizing(folder: Path) -> Sizing:
    return design(folder / "trapezium.toml").found


def test_the_shipped_sizing_keeps_its_published_schema_and_loads() -> None:
    jsonschema.validate(tomllib.loads(SHIPPED.read_text(encoding="utf-8")), json_schema())
    problem = load_design("push-off")
    assert problem.profile.table_error == 0.0
    assert problem.largest_error == pytest.approx(0.06 * 6.0)


def test_the_pressure_of_the_torque_ceiling_is_the_one_that_the_cut_crest_demands(sizing: Sizing) -> None:
    problem = sizing.problem
    pressure = ceiling_pressure(problem)
    most = TORQUE_CONSTANT * (pressure - ATMOSPHERE)
    assert problem.ceiling(pressure) == pytest.approx(most)
    assert cut_error(problem, pressure) == pytest.approx(0.4, rel=1e-6)
    # The crest above a level L: 0.3 s at 4 N m, and two straight flanks that fall away from it.
    flanks = (4.0 - most) ** 3 / 3.0 * (0.3 / 4.0 + 0.2 / 4.0)
    assert (4.0 - most) ** 2 * 0.3 + flanks == pytest.approx(0.4**2, rel=2e-2)


def test_the_lowest_pressure_is_just_above_the_torque_ceiling_and_is_said_to_be_limited_by_it(sizing: Sizing) -> None:
    choice = sizing.choice
    assert choice is not None
    assert choice.lowest_pressure is not None
    alone, gauge = ceiling_pressure(sizing.problem) - ATMOSPHERE, choice.lowest_pressure - ATMOSPHERE
    assert alone < gauge < 1.2 * alone
    assert choice.limit == "torque"
    error = choice.tried["error"][choice.tried["works"]][0]
    assert error <= 0.4
    assert error == pytest.approx(0.4, rel=0.02)


def test_the_suggestion_holds_the_whole_peak_at_the_lowest_pressure_that_does(sizing: Sizing) -> None:
    assert sizing.choice is not None
    assert sizing.choice.pressure == pytest.approx(ATMOSPHERE + 4.0 / TORQUE_CONSTANT)
    assert "cut off" not in sizing.summary


def test_the_suggestion_walks_as_printed_and_its_valve_is_one_of_a_parameter_set(sizing: Sizing) -> None:
    assert sizing.choice is not None
    command, _, table = usage_of(sizing).partition("# in a parameter set")
    walk = load_scenario("proportional", shlex.split(command.splitlines()[0])[4::2])
    valve = sizing.problem.valves[sizing.choice.name]
    for path, number in {**valve, **sizing.choice.gains, "supply.pressure": sizing.choice.pressure}.items():
        assert number_at(walk, path) == pytest.approx(number)
    kind, *entries = tomllib.loads(table.partition("\n")[2])["valves"][sizing.choice.name].items()
    assert kind == ("kind", "proportional")
    for name, entry in entries:
        assert base_value(entry["value"], entry["unit"]) == pytest.approx(valve[f"valve.{name}"])


def test_a_sizing_is_drawn_like_any_answer(sizing: Sizing) -> None:
    panels = finding_of(sizing).plot().axes
    assert [axes.get_xlabel() for axes in panels] == ["Supply pressure (psig)"] * 2


def test_a_tenth_of_a_psi_less_is_not_enough(sizing: Sizing) -> None:
    assert sizing.choice is not None
    below = np.array([sizing.choice.lowest_pressure or 0.0]) - 700.0
    assert Trials(sizing.problem).best(sizing.problem.valves[sizing.choice.name], below)["error"][0] > 0.4


def test_gas_bottle_and_margins_belong_together(sizing: Sizing) -> None:
    choice = sizing.choice
    assert choice is not None
    assert choice.bottle is not None
    assert sizing.recording is not None
    assert choice.gas == pytest.approx(sizing.recording["supplied_mass"][-1], rel=1e-9)
    assert choice.gas_in_all == pytest.approx(110.0 * choice.gas)
    assert choice.bottle.name == "co2-88g"
    assert choice.margins["gas"] == pytest.approx(0.088 / (100.0 * choice.gas) - 1.0)
    assert choice.margins["torque"] == pytest.approx(TORQUE_CONSTANT * (choice.pressure - ATMOSPHERE) / 4.0 - 1.0)
    assert 0.0 < choice.margins["flow"] < 1.0


def with_valve(folder: Path, name: str, *values: str) -> Path:
    """A design file whose only valve has these values."""
    (folder / f"{name}.toml").write_text("\n".join([FILE, *values]))
    return folder / f"{name}.toml"


def test_a_valve_that_is_too_small_is_limited_by_its_flow(folder: Path) -> None:
    file = with_valve(folder, "flow", 'area = "2.6 mm^2"')
    item = design(file).found.valves[0]
    assert item.limit == "flow"
    assert not item.works or item.pressure > 1.2 * ceiling_pressure(load_design(file))


SMALL = 'area = "12 mm^2"'


def error_by_hand(*overrides: str) -> float:
    """RMS error [N m] of the trapezium of FILE, followed by the proportional valve with 12 mm^2."""
    times = [f"reference.time_0{row}={time} s" for row, time in ((2, 0.3), (3, 0.6), (4, 0.8))]
    torques = [f"reference.value_0{row}={torque} N m" for row, torque in ((1, 0), (2, 4), (3, 4), (4, 0))]
    profile = ("reference.kind=tabulated", "reference.level=0 N m", "reference.period=1 s", *times, *torques)
    run = simulate("torque-task-proportional", [*profile, "run.duration=1 s", "valve.area=12 mm^2", *overrides])
    return run.metrics["rms_error"].value


def at_pressure(pressure: str) -> tuple[str, str]:
    return f"supply.pressure={pressure}", f"supply.dorsiflexion_pressure={pressure}"


def test_a_slow_valve_that_follows_by_hand_is_found_with_gains_of_another_size(folder: Path) -> None:
    gains = "controller.proportional_gain=2 1/(N m)", "controller.integral_gain=0 1/(N m s)"
    assert error_by_hand("valve.slew_limit=100 1/s", *at_pressure("45 psi_g"), *gains) < 0.2
    item = design(with_valve(folder, "slewing", SMALL, 'slew_limit = "100 1/s"')).found.valves[0]
    assert (item.works, item.limit) == (True, "torque")
    assert item.pressure < ATMOSPHERE + 45.0 * 6894.757
    assert item.margins["flow"] > 0.0


def test_smaller_gains_are_tried_where_a_valve_follows_with_none_of_the_file_s(folder: Path) -> None:
    file = with_valve(folder, "quick-gains", SMALL, 'delay = "20 ms"')
    file.write_text(file.read_text().replace("[1.0, 4.0]", "[0.0, 1000.0]"))
    item = design(file).found.valves[0]
    assert (item.works, item.limit) == (True, "torque")
    gains = [f"{path}={gain!r} SI" for path, gain in item.gains.items()]
    found = error_by_hand("valve.delay=20 ms", *at_pressure(f"{item.pressure!r} Pa_a"), *gains)
    assert item.error == pytest.approx(found, rel=1e-3)


def test_a_valve_too_late_for_any_gains_is_limited_by_the_control(folder: Path) -> None:
    item = design(with_valve(folder, "late", SMALL, 'delay = "200 ms"')).found.valves[0]
    # For 0.2 s after the start no torque can follow, which rises at 4 N m in 0.3 s: this part of the error alone is
    # the root of (4 / 0.3)^2 (0.2 s)^3 / 3 over the second of the run.
    assert item.error > ((4.0 / 0.3) ** 2 * 0.2**3 / 3.0) ** 0.5 > 0.4
    assert (item.works, item.limit) == (False, "control")


def test_a_valve_that_needs_pressure_only_because_it_slews_is_not_limited_by_its_flow(folder: Path) -> None:
    slow, quick = (
        design(with_valve(folder, f"slew-{limit}", SMALL, f'slew_limit = "{limit} 1/s"')).found.valves[0]
        for limit in (8.0, 1.0e4)
    )
    assert quick.lowest_pressure is not None
    assert slow.lowest_pressure is not None
    # The same opening follows at less pressure where it moves at once: its flow suffices.
    assert quick.lowest_pressure < slow.lowest_pressure - 20_000.0
    assert slow.limit == "control"


def test_a_controller_without_gains_is_limited_by_the_control(folder: Path) -> None:
    (folder / "idle.toml").write_text(FILE.replace("[1.0, 4.0]", "[0.0]"))
    sized = design(folder / "idle.toml").found
    assert (sized.valves[0].works, sized.valves[0].limit, sized.choice) == (False, "control", None)
    assert sized.recording is None


def test_use_that_no_bottle_lasts_for_is_no_suggestion(folder: Path) -> None:
    (folder / "long.toml").write_text(FILE.replace("repetitions = 100", "hours = 24"))
    sized = design(folder / "long.toml").found
    (valve,) = sized.valves
    assert (sized.choice, valve.works, valve.bottle) == (None, True, None)
    repetitions = 0.255 / (valve.gas * (1.0 + sized.problem.reserve))
    found = re.search(r"paper-co2-9oz lasts for .*, (\d+) repetitions", valve.remark)
    assert found is not None
    assert int(found[1]) == pytest.approx(repetitions, rel=2e-3, abs=0.6)


def test_the_smallest_bottle_that_holds_enough_is_chosen() -> None:
    bottles = [load_bottle(name) for name in ("paper-co2-9oz", "co2-16g", "co2-88g")]
    assert [smallest_bottle(bottles, gas) for gas in (0.016, 0.017, 0.2, 0.3)] == [
        bottles[1],
        bottles[2],
        bottles[0],
        None,
    ]


@pytest.mark.parametrize(("name", "most"), [("own.toml", 1.0), ("falisse2019-subject1", 1.0)])
def test_a_share_of_the_moment_of_a_wearer_is_a_profile(tmp_path: Path, name: str, most: float) -> None:
    if name == "own.toml":
        shutil.copy(resources.files("ppafo.gait") / "normative" / "falisse2019-subject1.toml", tmp_path / name)  # type: ignore[arg-type]
    text = f"gait:{name},mass=80 kg,share=5 %"
    typed = re.sub(r"time = .*\ntorque = .*\n", f'recording = "{text}"\n', FILE)
    (tmp_path / "of-gait.toml").write_text(typed)
    profile = load_design(tmp_path / "of-gait.toml").profile
    gait = load_gait()
    assert gait.ankle_moment is not None
    assert (profile.kind, profile.period) == ("gait", pytest.approx(gait.stride_time))
    phases = profile.time / profile.period
    assert profile.torque == pytest.approx(0.05 * 80.0 * gait.ankle_moment.values_at(phases))
    assert profile.table_error < 0.01 * profile.largest * most


def test_a_profile_that_is_given_replaces_that_of_the_file_and_its_paths_count_from_here(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "ankle.csv").write_text("time [s],torque [N m]\n0,1\n0.5,2\n1,1\n")
    assert load_design(folder / "trapezium.toml", profile="ankle.csv").profile.largest == 2.0
    with pytest.raises(PpafoError, match="give it to load_design"):
        design(load_design(folder / "trapezium.toml"), profile="ankle.csv")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("gait:falisse2019-subject1,mass=70 kg", "share"),
        ("gait:falisse2019-subject1,mass=70 kg,mass=80 kg,share=0.1", "give mass and share once"),
        ("gait:falisse2019-subject1,mass=70,share=0.1", "kg"),
        ("gait:falisse2019-subject1,mass=70 kg,share=1.1", "at most 1"),
        ("gait:falisse2019-subject1,mass=70 kg,share=0", "more than 0"),
        ("gait:falisse2019-subject1,mass=1 g,share=0.1", "at most 500000 g"),
    ],
)
def test_a_text_that_is_no_share_of_a_moment_is_one_line_with_what_is_allowed(text: str, said: str) -> None:
    with pytest.raises(PpafoError, match=re.escape(said)) as caught:
        load_design("push-off", profile=text)
    assert "\n" not in str(caught.value)
    assert text in str(caught.value)


def test_a_recording_becomes_a_table_with_its_corners_and_says_where_it_comes_from(tmp_path: Path) -> None:
    time = np.linspace(0.0, 1.1, 1101)
    torque = np.interp(time, [0.0, 0.35, 0.5, 0.7, 1.1], [0.0, 30.0, 60.0, 0.0, 0.0])
    write_csv(tmp_path / "ankle.csv", Recording("ankle", time, {"torque": Channel(torque, "N m")}, "synthetic"))
    typed = re.sub(r"time = .*\ntorque = .*\n", 'recording = "ankle.csv"\nscale = 0.1\n', FILE)
    (tmp_path / "recorded.toml").write_text(typed)
    profile = load_design(tmp_path / "recorded.toml").profile
    assert (profile.kind, profile.period) == ("synthetic", pytest.approx(1.1))
    assert profile.largest == pytest.approx(6.0)
    assert profile.table_error < 1e-9
    assert profile.knot_times.size < 10


def test_many_samples_are_thinned_to_the_knots_that_matter() -> None:
    time = np.linspace(0.0, 1.0, 2000)
    torque = np.sin(2.0 * np.pi * time) ** 3
    times, values = choose_knots(time, torque)
    assert times.size == KNOTS
    assert np.max(np.abs(np.interp(time, times, values) - torque)) < 0.02


def test_a_profile_that_ends_elsewhere_than_it_begins_jumps_at_its_end(tmp_path: Path) -> None:
    (tmp_path / "saw.toml").write_text(FILE.replace('"0 N m", "0 N m"]', '"0 N m", "2 N m"]'))
    profile = load_design(tmp_path / "saw.toml").profile
    assert profile.at(np.array([0.9, 0.9999, 1.0])).tolist() == pytest.approx([1.0, 1.999, 0.0], abs=1e-3)


def test_simulated_repetitions_are_covered_to_a_whole_sample(folder: Path) -> None:
    (folder / "odd.toml").write_text(FILE.replace('"1 s"]', '"1.0007 s"]').replace("simulated = 1", "simulated = 3"))
    problem = load_design(folder / "odd.toml")
    assert problem.scenario.run.duration == pytest.approx(3.003)
    assert dataclasses.asdict(problem.scenario.reference)["kind"] == "tabulated"


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("[valves.enfield-ls-v05s]", '[valves.a]\narea = "-1 mm^2"', "valves.a: "),
        ("[valves.enfield-ls-v05s]", "", "valves"),
        ("co2-88g", "air-48ci-3000psi", "'air-48ci-3000psi' contains air, but the device uses CO2"),
        ("repetitions = 100", "", "[use]: give either repetitions or hours"),
        ('"0.4 N m"', '"0 %"', "must be above 0"),
        ('time = ["0 s", "0.3 s"', 'time = ["0.1 s", "0.3 s"', "must start at '0 s' and increase"),
        ('time = ["0 s", "0.3 s"', 'time = ["0 s"', "time has 4 entries and torque has 5"),
        (
            '"4 N m", "4 N m"',
            '"0 N m", "0 N m"',
            "the torque is 0 N m throughout; give a profile with a torque other than 0",
        ),
        ('"4 N m", "4 N m"', '"4 N", "4 N m"', "unit 'N' does not fit"),
        ("[use]", 'recording = "a.csv"\n[use]', "give either a recording, or both time and torque"),
        ("[use]", '[pressure]\nlowest = "-3 psi_g"\n[use]', "must be above atmospheric pressure and below"),
        ("torque-task-proportional", "step-response", "scenario 'step-response' has no reference"),
    ],
)
def test_every_mistake_in_a_file_is_one_line(tmp_path: Path, before: str, after: str, message: str) -> None:
    assert before in FILE
    path = tmp_path / "wrong.toml"
    path.write_text(FILE.replace(before, after, 1))
    with pytest.raises(PpafoError, match=re.escape(message)) as caught:
        load_design(path)
    assert "\n" not in str(caught.value)


def test_a_limit_is_kept_in_every_noise_stream_and_the_seed_of_the_scenario_decides_nothing(
    sizing: Sizing, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Error [N m] and gas [kg] from the seed alone stand in for runs."""
    problem, seen = sizing.problem, []

    def run(_scenario: object, columns: dict[str, Floats], _metrics: object, threads: int | None = None) -> object:
        seeds = columns["sensors.seed"]
        seen.append(seeds)
        error = np.array([np.random.default_rng(int(seed)).random() for seed in seeds])
        metrics = {"rms_error": error, "gas_supplied": 2.0 * error}
        return SimpleNamespace(metrics=metrics, status=np.full(error.size, COMPLETED), reasons={})

    monkeypatch.setattr(search, "run_ensemble", run)
    found = []
    for seed in (1, 2):
        noisy = dataclasses.replace(problem.scenario.sensors, pressure_noise=1000.0, seed=seed)
        own = dataclasses.replace(problem, scenario=dataclasses.replace(problem.scenario, sensors=noisy))
        valve = problem.valves["enfield-ls-v05s"]
        found.append(Trials(own).run(valve, np.full(3, 5e5), np.zeros(3, dtype=np.intp)))
    streams = np.array([np.random.default_rng(int(seed)).random() for seed in np.unique(seen[0])])
    assert streams.size == 16
    assert found[0]["error"] == pytest.approx(np.full(3, streams.max()))
    assert found[0]["gas"] == pytest.approx(np.full(3, 2.0 * streams.mean() / problem.simulated))
    assert np.array_equal(found[0]["error"], found[1]["error"])
    assert Trials(problem).seeds.size == 0


def test_a_trial_whose_loop_oscillates_is_no_design_however_small_its_error_is(sizing: Sizing) -> None:
    overrides = ["reference.level=4 N m", "run.duration=1 s", "reference.ramp_time=0.5 s", "valve.delay=10 ms"]
    scenario = load_scenario("torque-task-proportional", overrides)
    gain = scenario.controller.settings["proportional_gain"]
    factors = tuple(number / gain for number in (0.02, 1.0, 8.0))
    gains = ("controller.proportional_gain",)
    trials = Trials(dataclasses.replace(sizing.problem, scenario=scenario, gains=gains, gain_factors=factors))
    found = trials.run(sizing.problem.valves["enfield-ls-v05s"], np.full(3, 4.5e5), np.arange(3))
    assert np.isfinite(found["error"]).tolist() == [True, True, False]
    assert (trials.runs, trials.failures) == (3, {OSCILLATES: 1})


def test_a_pressure_that_cuts_half_of_the_peak_is_not_suggested(tmp_path: Path) -> None:
    zeros = ", ".join(['"0 N m"'] * 2)
    (tmp_path / "brief.toml").write_text(
        'schema_version = 1\nname = "brief"\nscenario = "torque-task-proportional"\nbottles = ["paper-co2-9oz"]\n'
        '[profile]\ntime = ["0 s", "0.1 s", "0.2 s", "0.3 s", "1.1 s"]\n'
        f'torque = ["0 N m", "2.5 N m", "5 N m", {zeros}]\n'
        '[use]\nrepetitions = 10\n[limits]\nrms_error = "1.5 N m"\n[valves.own]\nsonic_conductance = "2.75 L/(s bar)"\n'
        'critical_ratio = "0.3"\nspool_frequency = "100 Hz"\n[pressure]\nlowest = "15 psi_g"\nhighest = "45 psi_g"\n'
    )
    sizing = design(tmp_path / "brief.toml").found
    assert sizing.choice is not None
    assert sizing.choice.margins["torque"] >= -0.3
    # Equation (2): the peak of 5 N m needs 5 N m / 14.51 cm^3 = 344.6 kPa, 50 psi above the atmosphere.
    most = TORQUE_CONSTANT * (sizing.choice.pressure - ATMOSPHERE)
    assert f"% of the peak cut off (at most {most:.3g} N m of 5 N m)" in sizing.summary


def recorded_torques(sizing: Sizing) -> list[float]:
    """Torques [N m] in the file suggested.csv of a finding."""
    rows = finding_of(sizing).files["suggested.csv"]().decode().splitlines()
    head, *samples = [row.split(",") for row in rows if not row.startswith("#")]
    return [float(sample[head.index("torque [N m]")]) for sample in samples]


BOTH_SIGNS = (
    FILE.replace('"0.3 s", "0.6 s", "0.8 s"', '"0.25 s", "0.5 s", "0.75 s"')
    .replace('"4 N m", "4 N m", "0 N m"', '"8 N m", "0 N m", "-8 N m"')
    .replace('"0.4 N m"', '"0.8 N m"')
)
"""Torque between 8 N m and -8 N m, whose crests last too briefly for the valve."""


def test_a_suggested_run_that_stays_below_a_peak_of_either_sign_says_so(tmp_path: Path) -> None:
    (tmp_path / "both.toml").write_text(BOTH_SIGNS)
    both = design(tmp_path / "both.toml").found
    torques = recorded_torques(both)
    assert 0.0 < max(torques) < 0.95 * 8.0
    assert -0.95 * 8.0 < min(torques) < 0.0
    reaches = f"; reaches {max(torques):.3g} of 8 N m and {min(torques):.3g} of -8 N m in the simulated run"
    assert reaches in both.summary


def test_a_bottle_with_gas_enough_that_gets_too_cold_is_not_suggested() -> None:
    big = load_bottle(
        "paper-co2-9oz", ["bottle.gas_mass=567 g", "bottle.volume=834 cm^3", "bottle.wall_heat_capacity=889 J/K"]
    )
    bottles = (load_bottle("paper-co2-9oz"), big)
    problem = dataclasses.replace(load_design("push-off"), repetitions=500.0, bottles=bottles)
    gas, pressure = 0.45e-3, 101325.0 + 50.0 * 6894.757
    in_all = gas * problem.repetitions * (1.0 + problem.reserve)
    assert smallest_bottle(bottles, in_all) is bottles[0], "its gas alone would do"
    assert lasting_bottle(problem, gas, in_all, pressure) == (big, True)
    alone = dataclasses.replace(problem, bottles=bottles[:1])
    assert lasting_bottle(alone, gas, in_all, pressure) == (None, True)
