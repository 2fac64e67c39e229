"""From a problem file to a new set: order, provenance, units, and every mistake in one line."""

import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ppafo.analyses.identify import Identification, finding_of, identify
from ppafo.cli.main import main
from ppafo.errors import IdentificationError, PpafoError
from ppafo.identification.bench.free_decay import FreeDecayProblem
from ppafo.identification.bench.law import BenchContext
from ppafo.identification.bench.vane_leak import VaneLeakProblem
from ppafo.identification.estimate import UNKNOWN, Estimate, relative_half_width
from ppafo.identification.new_set import with_estimates
from ppafo.identification.tolerances import Tolerances
from ppafo.identification.trajectory.experiment import FittedExperiment, tolerance_parameters
from ppafo.parameters import apply_overrides, build_device
from ppafo.parameters.audit import findings_of
from ppafo.parameters.audit.changes import changes
from ppafo.parameters.loading import load_device, load_parameter_set, parameter_set_toml, parse_parameter_set
from ppafo.report.finding import files_of, text_of
from ppafo.running import simulate
from ppafo.signals import Channel, Recording
from ppafo.simulation.loading import load_scenario
from ppafo.storage import write_csv
from ppafo.units import to_si
from tests.unit.identification import planted

HEAD = 'schema_version = 1\nname = "twin"\ndevice.set = "ppafo2011"\n'
STATIC = '[[procedure]]\nkind = "static-torque"\nrecordings = ["static.csv"]\n'
DECAY = '[[procedure]]\nkind = "free-decay"\nrecordings = ["decay.csv"]\n'
FLOW = '[[procedure]]\nkind = "open-valve-flow"\nrecordings = ["flow.csv"]\n'
MAP = '[[procedure]]\nkind = "valve-map"\nrecordings = ["sweep.csv"]\n'
LEAK = '[[procedure]]\nkind = "vane-leak"\nrecordings = ["leak.csv"]\nvolume_1 = "60 cm^3"\nvolume_2 = "46.15 cm^3"\n'
MAPPED = "[columns.rig]\n"
ALL = LEAK + MAP + FLOW + DECAY + STATIC

Solve = Callable[[str], Identification]


@pytest.fixture
def bench(tmp_path: Path) -> Path:
    """A folder with one recording for each procedure."""
    leak = planted.leak("orifice", 0.3e-6 * 0.113)
    growing = planted.static(growth=8.0e-7)
    write_csv(tmp_path / "growing.csv", growing.recording)
    sources = (planted.static(), planted.decay(), planted.flow(), planted.sweep(), leak)
    for source in sources:
        write_csv(tmp_path / f"{source.recording.label}.csv", source.recording)
    return tmp_path


@pytest.fixture
def solved(bench: Path) -> Solve:
    """Solves a problem in that folder."""

    def solve(text: str) -> Identification:
        path = bench / "problem.toml"
        path.write_text(HEAD + text)
        return identify(path).found

    return solve


def test_trials_below_each_other_are_recordings_of_one_procedure(bench: Path, solved: Solve) -> None:
    decays = [planted.decay(seed=seed) for seed in (1, 2, 3)]
    rows = ["t,angle"]
    for number, one in enumerate(decays):
        write_csv(bench / f"decay{number}.csv", one.recording)
        pairs = zip(one.recording.time.tolist(), one.recording["angle"].tolist(), strict=True)
        rows += [f"{time!r},{angle!r}" for time, angle in pairs]
    (bench / "logged.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")
    columns = '[columns.log]\ntrial = "all"\n[columns.log.channels]\ntime = { column = "t", unit = "s" }\n'
    columns += 'angle = { column = "angle", unit = "rad" }\n'
    one_file = DECAY.replace("decay.csv", "logged.csv") + 'columns = "log"\n' + columns
    three = DECAY.replace('"decay.csv"', '"decay0.csv", "decay1.csv", "decay2.csv"')
    found = [solved(text).results[0].estimates for text in (one_file, three)]
    values = [[(estimate.path, estimate.value) for estimate in estimates] for estimates in found]
    assert [path for path, _ in values[0]] == [path for path, _ in values[1]]
    assert [value for _, value in values[0]] == pytest.approx([value for _, value in values[1]], rel=1e-9)
    assert "logged.csv trial 3 sha256:" in " ".join(found[0][0].recordings)


def test_an_angle_in_degrees_that_is_called_radians_is_refused(bench: Path, solved: Solve) -> None:
    one = planted.decay().recording
    write_csv(bench / "turned.csv", one.with_channel("angle", np.degrees(one["angle"]), "rad"))
    with pytest.raises(
        IdentificationError,
        match=r"turned.csv: free-decay: 'angle' covers 2.* turns\), .*; in degrees, give it the unit deg",
    ):
        solved(DECAY.replace("decay.csv", "turned.csv"))


def test_drop_outs_within_a_decay_are_left_out_before_the_push_is_looked_for(bench: Path, solved: Solve) -> None:
    one, base = planted.decay().recording, solved(DECAY).results[0].estimates
    lost = np.where(np.arange(len(one)) % 101 == 50, 0.0, one["angle"])
    write_csv(bench / "lost.csv", one.with_channel("angle", lost, "rad"))
    result = solved(DECAY.replace("decay.csv", "lost.csv")).results[0]
    assert result.remarks[0].startswith("left out: 16 of 1600 samples where 'angle' is an outlier")
    for estimate, right in zip(result.estimates, base, strict=True):
        assert estimate.value == pytest.approx(right.value, rel=0.02)
        assert estimate.verdict == "identified"


def test_a_discharge_coefficient_above_one_is_doubted(bench: Path, solved: Solve) -> None:
    one = planted.flow().recording
    write_csv(bench / "minutes.csv", one.with_channel("mass_flow", 60.0 * one["mass_flow"], "kg/s"))
    result = solved(FLOW.replace("flow.csv", "minutes.csv")).results[0]
    assert result.remarks[0].startswith("Cd = ")
    assert result.estimates[0].verdict == "holds for this model only"


def test_readings_before_the_air_is_on_show_the_zeros_and_no_swapped_columns(bench: Path, solved: Solve) -> None:
    one, right = planted.flow().recording, solved(FLOW).results[0].estimates[0].value
    channels = {}
    for name in ("upstream_pressure", "downstream_pressure", "mass_flow"):
        before = one["downstream_pressure"][0] if name != "mass_flow" else 0.0
        channels[name] = Channel(np.concatenate([np.full(40, before), one[name]]), one.unit(name))
    write_csv(bench / "rest.csv", Recording("rest", np.arange(100.0), channels, "synthetic"))
    result = solved(FLOW.replace("flow.csv", "rest.csv")).results[0]
    assert result.remarks[0].startswith("40 of 100 readings are without flow")
    assert result.estimates[0].value == pytest.approx(right, rel=5e-3)


def test_procedures_run_in_the_recommended_order_whatever_the_order_of_the_file(solved: Solve) -> None:
    names = [result.procedure for result in solved(ALL).results]
    assert names == ["static-torque", "free-decay", "open-valve-flow", "valve-map", "vane-leak"]


def test_every_planted_value_gets_into_the_new_set_with_interval_and_origin(solved: Solve) -> None:
    outcome = solved(ALL)
    new = outcome.new_set.parameter_set
    assert set(outcome.new_set.written) == {
        "actuator.torque_constant",
        "friction.static_torque",
        "friction.viscous_damping",
        "friction.dynamic_torque",
        "valves.proportional.discharge_coefficient",
        "valves.proportional.dead_band",
        "actuator.leak.area",
    }
    entry = new.numbers["actuator.leak.area"]
    assert (entry.origin, entry.unit) == ("identified", "mm^2")
    assert entry.uncertainty is not None
    assert abs(entry.value - 0.3) <= entry.uncertainty
    assert entry.source.startswith("leak.csv sha256:")
    assert len(entry.source.partition("sha256:")[2]) == 64
    assert "Before, the set had 0.3 mm^2 (published" in entry.note


def test_an_identified_set_is_audited_without_what_was_reported_of_the_set_that_it_came_from(solved: Solve) -> None:
    before = load_parameter_set("ppafo2011")
    assert any(path.startswith("reported.") for path in before.numbers)
    found = solved(FLOW).new_set.parameter_set
    assert not any(path.startswith("reported.") for path in found.numbers)
    ids = {one.id for one in findings_of(found)}
    assert {"flow-of-proportional", "idle-acceptance"} & ids == set()
    assert "open-flow-of-proportional" in ids
    assert not any(one.path.startswith("reported.") for one in changes(found, before))


def test_the_new_set_reads_back_and_makes_a_device(solved: Solve, bench: Path) -> None:
    outcome = solved(ALL)
    text = parameter_set_toml(outcome.new_set.parameter_set)
    assert parse_parameter_set(text.encode(), "twin.toml") == outcome.new_set.parameter_set
    assert outcome.new_set.parameter_set.parent == "ppafo2011"
    (bench / "twin.toml").write_text(text)
    device = load_device(bench / "twin.toml")
    assert device.valve.dead_band == pytest.approx(0.12, abs=0.01)
    assert outcome.is_good


def test_a_value_that_is_not_identified_is_written_as_fitted_and_not_counted(solved: Solve, bench: Path) -> None:
    bent = planted.static().recording
    pressure = bent["pressure_difference"]
    write_csv(bench / "bent.csv", bent.with_channel("torque", bent["torque"] + 2.0 * (pressure / 6.5e5) ** 2, "N m"))
    outcome = solved(STATIC.replace("static.csv", "bent.csv"))
    assert outcome.new_set.written == ()
    assert set(outcome.new_set.fitted) == {"actuator.torque_constant", "friction.static_torque"}
    entry = outcome.new_set.parameter_set.numbers["friction.static_torque"]
    assert entry.origin == "fitted"
    assert entry.note.startswith("holds for this model only")
    assert not outcome.is_good
    said = text_of(finding_of(outcome))
    assert said.count("fitted alone, ") == 1


def test_friction_that_grows_is_written_with_its_growth(solved: Solve) -> None:
    outcome = solved(STATIC.replace("static.csv", "growing.csv"))
    growth = "effects.seal_friction.static_per_pressure"
    assert set(outcome.new_set.written) == {"actuator.torque_constant", "friction.static_torque", growth}
    assert outcome.results[0][growth].value == pytest.approx(8.0e-7, rel=0.1)
    assert outcome.new_set.problem == ""


@pytest.mark.parametrize("name", ["decay.csv", "copy.csv"])
def test_the_same_recording_twice_is_refused_by_the_hash_of_its_numbers(solved: Solve, bench: Path, name: str) -> None:
    (bench / "copy.csv").write_text("# a copy\n" + (bench / "decay.csv").read_text())
    for text in (DECAY.replace('"decay.csv"', f'"decay.csv", "{name}"'), DECAY + DECAY.replace("decay.csv", name)):
        with pytest.raises(PpafoError, match=r"problem\.toml: .* are the same recording"):
            solved(text)


def test_two_procedures_that_find_one_number_agree_or_contradict_each_other(solved: Solve, bench: Path) -> None:
    # Two parts of one recording are not the same samples twice.
    outcome = solved(f'{DECAY}start = "1.1 s"\nend = "3 s"\n{DECAY}start = "3.5 s"\nend = "6 s"\n')
    assert "by free-decay, which agree: the set takes 0.0" in outcome.results[1].remarks[0]
    other = planted.static().recording
    write_csv(bench / "other.csv", other.with_channel("torque", 1.2 * other["torque"], "N m"))
    outcome = solved(STATIC + STATIC.replace("static.csv", "other.csv"))
    for result in outcome.results:
        assert "by static-torque, which contradict each other" in result.conflict
    assert not outcome.is_good


def test_a_set_says_from_which_recordings_it_was_made(solved: Solve, bench: Path) -> None:
    notes = solved(STATIC).new_set.parameter_set.notes
    assert "on the set 'ppafo2011' from synthetic recordings: static.csv; " in notes
    text = (bench / "static.csv").read_text()
    (bench / "static.csv").write_text("".join(line for line in text.splitlines(True) if line[0] != "#"))
    assert "from measured recordings: static.csv; " in solved(STATIC).new_set.parameter_set.notes


def test_the_citation_of_a_problem_is_that_of_the_new_set(solved: Solve) -> None:
    before = load_parameter_set("ppafo2011").citation
    cited = '[citation]\ntitle = "Our orthosis"\nauthors = ["Roe"]\nyear = 2026\n'
    written = parameter_set_toml(solved(STATIC + cited).new_set.parameter_set)
    found = parse_parameter_set(written.encode(), "twin.toml").citation
    assert found is not None
    assert (found.title, found.authors, found.year) == ("Our orthosis", ("Roe",), 2026)
    assert solved(STATIC).new_set.parameter_set.citation == before


def test_values_that_no_procedure_touched_stay_as_they_were(solved: Solve) -> None:
    new, old = solved(STATIC).new_set.parameter_set, load_parameter_set("ppafo2011")
    changed = {
        path for path in old.numbers if not path.startswith("reported.") and new.numbers[path] != old.numbers[path]
    }
    assert changed == {"actuator.torque_constant", "friction.static_torque"}


def test_the_standard_form_of_an_orifice_takes_the_place_of_the_area(solved: Solve) -> None:
    new = solved(f'{FLOW}law = "iso6358"\n').new_set.parameter_set
    names = {path.rpartition(".")[2] for path in new.numbers if path.startswith("valves.proportional.")}
    assert names == {"sonic_conductance", "critical_ratio"}


def test_friction_that_contradicts_itself_is_told_and_fails(solved: Solve) -> None:
    outcome = solved(f'{STATIC}{DECAY}inertia = "100 kg m^2"\n')
    assert "friction.dynamic_torque" in outcome.new_set.problem
    assert not outcome.is_good


def test_figures_and_files_are_there_for_each_procedure(solved: Solve) -> None:
    files = files_of(finding_of(solved(STATIC + DECAY)))
    names = {"twin.toml", "identify.json", "identify.txt", "report.html"}
    names |= {f"{name}.{kind}" for name in ("static-torque", "free-decay") for kind in ("png", "svg")}
    assert set(files) == names
    assert files["free-decay.png"].startswith(b"\x89PNG")
    assert json.loads(files["identify.json"])["procedures"][0]["recordings_are"] == "synthetic"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "procedure"),
        (STATIC.replace("static-torque", "static_torqe"), "did you mean 'static-torque'"),
        (
            STATIC.replace("static.csv", "decoy.csv"),
            "procedure.1.recordings.1 = 'decoy.csv': no such file, did you mean 'decay.csv'",
        ),
        (STATIC.replace("static.csv", "decay.csv"), "decay.csv: static-torque: needs a channel 'torque [N m]'"),
        (f'{DECAY}start = "2 m"\n', "procedure.1.start = '2 m': unit 'm' does not fit"),
        (f'{DECAY}inertia = "0 kg m^2"\n', "must be more than 0 kg m^2"),
        (f'{FLOW}temperature = "17 K"\n', "temperature = '17 K': must be at least 150 K and at most 600 K"),
        (f'{FLOW}gas = "CO3"\n', "gas = 'CO3' is unknown, did you mean 'CO2'"),
        (LEAK.replace('volume_1 = "60 cm^3"', 'angle = "200 deg"'), "lies beyond the stops"),
        (STATIC.replace('["static.csv"]', '"static.csv"'), "procedure.1"),
    ],
)
def test_a_mistake_is_one_line_that_says_where(solved: Solve, text: str, message: str) -> None:
    with pytest.raises(PpafoError) as caught:
        solved(text)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


def test_what_a_column_map_has_wrong_and_what_it_lacks_are_one_refusal(bench: Path, solved: Solve) -> None:
    (bench / "meter.csv").write_text("t,Q,p1\n" + "".join(f"{k},{10 + k},{1 + k}\n" for k in range(20)))
    mapped = (
        '[columns.rig.channels]\ntime.column = 1\ntime.unit = "s"\nupstream_pressure = {column = 3, unit = "bar_g"}\n'
    )
    problem = f"{FLOW.replace('flow.csv', 'meter.csv')}columns = 'rig'\n{mapped}"
    for flow, fragment in (
        ('unit = "NL/min"', "is a volume flow; a mass flow needs a gas and a condition"),
        ('unit = "L/min", at = "ANR", gas = "air"', "is a flow of air, 0.02897 kg/mol, but the gas of"),
    ):
        with pytest.raises(PpafoError) as refused:
            solved(f'{problem}mass_flow = {{column = "Q", {flow}}}\n')
        assert len(refused.value.parts) == 2
        assert fragment in str(refused.value)
        assert "needs a channel 'downstream_pressure [Pa]', absolute downstream pressure; channels read: " in str(
            refused.value
        )


def test_the_leak_of_a_cylinder_is_identified_as_that_of_a_vane(bench: Path) -> None:
    head = HEAD.replace("ppafo2011", "cylinder-lever")
    (bench / "problem.toml").write_text(f'{head}{LEAK}gas = "CO2"\n')
    outcome = identify(bench / "problem.toml").found
    assert outcome.results[0].summary.endswith("; gas: CO2, 20 degC")
    assert outcome.new_set.written == ("actuator.leak.area",)
    assert outcome.results[0].estimates[0].value == pytest.approx(0.3e-6 * 0.113 / 0.6, rel=0.05)
    (bench / "problem.toml").write_text(head + LEAK.partition("volume_1")[0] + 'angle = "60 deg"\n')
    with pytest.raises(PpafoError, match="allowed: volume_1, volume_2"):
        identify(bench / "problem.toml")


def test_the_command_writes_the_folder_and_prints_json(
    bench: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (bench / "problem.toml").write_text(HEAD + STATIC)
    assert main(["identify", str(bench / "problem.toml"), "--out", str(tmp_path / "made"), "--json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["new_set"]["identified"] == ["actuator.torque_constant", "friction.static_torque"]
    assert (tmp_path / "made" / "twin.toml").is_file()


def test_bad_input_writes_nothing_and_exits_with_two(
    bench: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (bench / "problem.toml").write_text(HEAD + STATIC.replace("static.csv", "decay.csv"))
    assert main(["identify", str(bench / "problem.toml"), "--out", str(tmp_path / "made")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not (tmp_path / "made").exists()


def test_a_leak_in_the_form_of_the_standard_is_written_in_that_form(bench: Path) -> None:
    text = parameter_set_toml(load_parameter_set("ppafo2011"))
    head, _, rest = text.partition("[actuator.leak.area]")
    other = rest[rest.index("[friction") :]
    entry = 'origin = "assumed"\nsource = "a test"\n'
    sonic = f'[actuator.leak.sonic_conductance]\nvalue = 1e-10\nunit = "m^3/(s Pa)"\n{entry}\n'
    sonic += f'[actuator.leak.critical_ratio]\nvalue = 0.5\nunit = ""\n{entry}\n'
    (bench / "sonic.toml").write_text(head + sonic + other)
    problem = HEAD.replace("ppafo2011", "sonic.toml") + LEAK
    (bench / "problem.toml").write_text(problem)
    outcome = identify(bench / "problem.toml").found
    assert {*outcome.new_set.written, *outcome.new_set.fitted} == {"actuator.leak.sonic_conductance"}
    numbers = outcome.new_set.parameter_set.numbers
    assert numbers["actuator.leak.critical_ratio"].origin == "assumed"
    assert "actuator.leak.area" not in numbers
    assert outcome.new_set.problem == ""
    # The law seeks both numbers, whichever form the starting set has.
    for name in ("sonic.toml", "ppafo2011"):
        (bench / "problem.toml").write_text(f'{HEAD.replace("ppafo2011", name)}{LEAK}law = "iso6358"\n')
        outcome = identify(bench / "problem.toml").found
        assert outcome.new_set.written == ("actuator.leak.sonic_conductance", "actuator.leak.critical_ratio")
        numbers = outcome.new_set.parameter_set.numbers
        leak = {path.removeprefix("actuator.leak.") for path in numbers if path.startswith("actuator.leak.")}
        assert leak == {"sonic_conductance", "critical_ratio"}
        assert outcome.new_set.problem == ""
        assert outcome.is_good


def test_a_laminar_coefficient_of_another_gas_is_not_written_to_the_set(bench: Path, solved: Solve) -> None:
    write_csv(bench / "laminar.csv", planted.leak("laminar", 0.64e-16).recording)
    both = LEAK.replace("leak.csv", "laminar.csv") + 'law = "both"\n'
    gap = "effects.laminar_leak.coefficient"
    assert gap in solved(f'{both}gas = "CO2"\n').new_set.written
    of_air = solved(f'{both}gas = "air"\n')
    assert gap not in of_air.new_set.parameter_set.numbers
    assert of_air.results[0]["vane_leak.laminar_coefficient"].is_identified
    (remark,) = of_air.results[0].remarks
    assert f"{gap} is not written to the set" in remark


@pytest.mark.parametrize(
    ("text", "stated"),
    [
        (STATIC, 'gain = "5 %"'),
        (DECAY, 'held = "20 %"'),
        (FLOW, 'gas_temperature = "40 K"'),
        (MAP, 'gas_law = "10 %"'),
        (LEAK, 'held = "20 %"'),
    ],
)
def test_what_a_problem_states_of_the_bench_takes_the_place_of_the_default(
    solved: Solve, text: str, stated: str
) -> None:
    usual, wide = (solved(f"{more}{text}").estimates for more in ("", f"[bench]\n{stated}\n"))
    assert any(b.wider_half_width > 1.5 * a.wider_half_width for a, b in zip(usual, wide, strict=True))


def test_the_gas_temperature_is_known_as_well_as_it_is_stated(solved: Solve, bench: Path) -> None:
    path = "valves.proportional.discharge_coefficient"
    usual = solved(FLOW).results[0][path]
    measured = solved(f'{FLOW}temperature = "24.85 degC"\n').results[0][path]
    assert "gas temperature" in usual.explanation
    assert measured.wider_half_width < 0.85 * usual.wider_half_width
    text = parameter_set_toml(load_parameter_set("ppafo2011"))
    known = '[gas.temperature]\nvalue = 298.0\nunit = "K"\n'
    assert text.count(known) == 1
    (bench / "warm.toml").write_text(text.replace(known, f"{known}uncertainty = 40.0\n"))
    head, half = HEAD.replace("ppafo2011", "warm.toml"), {}
    for stated in ("", "gas_temperature = '1 K'", "gas_temperature = '35.348 K'", "held = '1 %'"):
        (bench / "problem.toml").write_text(f"{head}[bench]\n{stated}\n{FLOW}")
        half[stated] = identify(bench / "problem.toml").found.results[0][path].wider_half_width
    assert half[""] > 1.4 * usual.wider_half_width
    # The set states half a 95 % interval: 40 K / 1.96 is the standard deviation of a limit of 35.348 K.
    assert half[""] == half["held = '1 %'"] == pytest.approx(half["gas_temperature = '35.348 K'"], rel=1e-4)
    assert half["gas_temperature = '1 K'"] == pytest.approx(measured.wider_half_width, rel=1e-6)


def test_bench_and_trajectory_hold_a_number_alike() -> None:
    chosen, device = BenchContext(load_parameter_set("ppafo2011"), "proportional", "here"), load_device("ppafo2011")
    scenario = load_scenario("step-response", ["motion.kind=free"])
    experiment = FittedExperiment("step", scenario, simulate(scenario).recording)
    found = tolerance_parameters(Tolerances(), (experiment,), (), chosen.parameter_set)
    held = {one.path: one.deviation for one in found}
    leak = VaneLeakProblem(kind="vane-leak", recordings=("leak.csv",), angle=math.radians(60.0))
    decay = FreeDecayProblem(kind="free-decay", recordings=("decay.csv",))
    told = FreeDecayProblem(kind="free-decay", recordings=("decay.csv",), inertia=8.4e-3)
    assert decay.inertia_of(chosen)[1] == held["foot_plate.inertia"] == told.inertia_of(chosen)[1]
    assert leak.gas_of((), chosen).temperature_deviation == held["gas.temperature"]
    # The displacement is known as well as the torque constant, which it follows.
    swept = math.radians(60.0) - device.actuator.angle_min
    volume = math.hypot(held["actuator.dead_volume_1"], swept * held["actuator.torque_constant"])
    first, _, deviation = leak.volumes_of(chosen)
    assert first is not None
    assert deviation == pytest.approx(volume / first)


def test_a_measured_gas_temperature_takes_the_place_of_the_set_s(solved: Solve) -> None:
    path = "valves.proportional.discharge_coefficient"
    temperatures = ("24.85 degC", "16.85 degC")
    results = [solved(f'{FLOW}temperature = "{item}"\n').results[0] for item in temperatures]
    assert results[1].summary.endswith("; gas: CO2 of the set, 16.85 degC")
    plain, cool = (result[path] for result in results)
    assert cool.value / plain.value == pytest.approx((290.0 / 298.0) ** 0.5, rel=1e-4)


def estimate(value: float, low: float, high: float, verdict: str = "identified") -> Estimate:
    return Estimate("a.b", value, "m", low, high, verdict, "why", ("file sha256:0",))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("low", "high", "verdict", "text"),
    [
        (1.9, 2.1, "identified", "identified"),
        (1.12, 2.5, "identified", "identified, +-44 %"),
        (1.7, 2.6, "holds for this model only", "holds for this model only, +-30 %"),
        (0.0, 5.0, "not identifiable", "not identifiable"),
    ],
)
def test_the_verdict_states_the_half_width_of_a_wide_interval(low: float, high: float, verdict: str, text: str) -> None:
    assert estimate(2.0, low, high, verdict).verdict_text == text


def test_an_interval_that_holds_zero_or_twice_the_value_does_not_identify_it() -> None:
    assert relative_half_width(2.0, 0.1, 3.9) < UNKNOWN
    assert relative_half_width(2.0, 0.0, 2.5) >= UNKNOWN
    assert relative_half_width(2.0, 1.5, 4.0) >= UNKNOWN
    # The zero of a sensor is known although it may be zero.
    assert relative_half_width(0.0, -0.1, 0.1, 10.0) == pytest.approx(0.01)


@pytest.mark.parametrize(("apart", "second"), [([], 60.0), (["supply.dorsiflexion_pressure=45 psi_g"], 45.0)])
def test_fitted_supply_pressure_is_that_of_both_regulators_unless_they_are_apart(
    apart: list[str], second: float
) -> None:
    fitted, low, high = (to_si(number, "psi_g", "Pa_a") for number in (60.0, 59.0, 61.0))
    estimate = Estimate("supply.pressure", fitted, "Pa", low, high, "identified", "Fitted.", ("bench.csv",))
    before = apply_overrides(load_parameter_set("ppafo2011"), apart)
    supply = build_device(with_estimates(before, [estimate]).parameter_set).supply
    assert supply.pressure == pytest.approx(fitted, rel=1e-12)
    assert supply.dorsiflexion_pressure == pytest.approx(to_si(second, "psi_g", "Pa_a"), rel=1e-12)


def test_a_set_states_the_half_width_for_its_own_confidence() -> None:
    wide = Estimate(
        "foot_plate.inertia", 0.01, "kg m^2", 0.009, 0.011, "identified", "Why.", ("a.csv",), confidence=0.99
    )
    entry = with_estimates(load_parameter_set("ppafo2011"), [wide]).parameter_set.numbers["foot_plate.inertia"]
    # With three digits, as many as the value then has behind its point.
    assert entry.uncertainty == round(0.1 * entry.value * 1.959964 / 2.575829, 3)
    assert "99% interval" in entry.note
