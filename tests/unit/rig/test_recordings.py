"""What the simulated bench records: the run or the steady state, with the errors of its sensors."""

import math
import tomllib
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from ppafo.errors import DataError, PpafoError
from ppafo.rig import RigRecording, list_presets, load_preset, record
from ppafo.rig.experiments import EXPERIMENTS, on_scale, write_rig_recording
from ppafo.rig.preset import PATHS, json_schema
from ppafo.running import simulate
from ppafo.signals.recording import CHANNELS
from ppafo.storage import read_csv
from ppafo.storage.comma_separated import marked_csv_bytes

SHORT = {"torque-task": ["run.duration=0.1 s"], "vane-leak": ["run.duration=2 s"], "free-decay": ["run.duration=0.2 s"]}
IN_MOTION = {"angle", "pressure_1", "pressure_2", "supply_pressure", "dorsiflexion_pressure", "command", "torque"}
WANTED = {
    "static-torque": {"torque", "pressure_difference", "direction", "repetition"},
    "free-decay": {"angle"},
    "open-valve-flow": {"upstream_pressure", "downstream_pressure", "mass_flow", "command"},
    "vane-leak": {"pressure_1", "pressure_2"},
    "vane-leak-steady": {"pressure_1", "pressure_2", "mass_flow"},
    "valve-map": {"command", "mass_flow", "upstream_pressure", "downstream_pressure"},
    "step-response": IN_MOTION,
    "torque-task": {*IN_MOTION, "reference"},
}
PERFECT = tuple(
    f"rig.{path}=0 {quantity.unit}".strip()
    for path, quantity in PATHS.items()
    if path.endswith((".noise", ".offset", ".resolution"))
)
"""Sensors without noise, offset and rounding."""


def perfect(experiment: str, *overrides: str, seed: int = 1) -> RigRecording:
    """What an ideal laboratory with perfect sensors records."""
    given = {text.partition("=")[0] for text in overrides}
    without = [text for text in PERFECT if text.partition("=")[0] not in given]
    return record(experiment, "ideal-laboratory", seed, overrides=(*without, *overrides))


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_an_experiment_records_its_channels_as_synthetic_and_reads_back(name: str, tmp_path: Path) -> None:
    made = record(name, "paper-bench", 3, overrides=SHORT.get(name, []))
    assert set(made.recording.names) == WANTED[name]
    assert all(made.recording.unit(channel) == CHANNELS[channel].unit for channel in made.recording.names)
    assert made.recording.kind == "synthetic"
    assert marked_csv_bytes(made.recording).startswith(b"# synthetic: ")
    files = write_rig_recording(tmp_path, made)
    assert read_csv(tmp_path / files[0]) == made.recording


@pytest.mark.parametrize("name", ["step-response", "torque-task"])
def test_a_perfect_bench_records_the_run_of_the_scenario_of_that_name(name: str) -> None:
    texts = ("run.duration=0.2 s",)
    made = perfect(name, *texts).recording
    run = simulate(name if name in ("step-response",) else "torque-task-proportional", texts).recording
    assert len(made) == len(run)
    # Its steps are a tenth as long.
    for channel, full in (("angle", math.radians(110.0)), ("pressure_1", 379e3), ("pressure_2", 379e3)):
        assert np.abs(made[channel] - run[channel]).max() < 1e-3 * full, channel


@pytest.mark.parametrize("name", ["static-torque", "step-response"])
def test_the_same_seed_gives_the_same_bytes_and_another_seed_others(name: str) -> None:
    first, again, other = (marked_csv_bytes(record(name, seed=seed).recording) for seed in (5, 5, 6))
    assert first == again
    assert first != other


def test_noise_has_the_size_of_the_preset_and_is_independent_between_channels() -> None:
    plain = perfect("step-response", seed=4).recording
    shown = perfect("step-response", "rig.pressure_sensor.noise=1000 Pa_d", seed=4).recording
    first, second = (shown[name] - plain[name] for name in ("pressure_1", "pressure_2"))
    count = first.size
    assert first.std() == pytest.approx(1000.0, rel=4.0 / np.sqrt(2.0 * count))
    assert abs(first.mean()) < 4.0 * 1000.0 / np.sqrt(count)
    assert abs(np.corrcoef(first, second)[0, 1]) < 4.0 / np.sqrt(count)
    assert abs(np.corrcoef(first[1:], first[:-1])[0, 1]) < 4.0 / np.sqrt(count)
    assert np.array_equal(shown["angle"], plain["angle"])


def test_offset_and_gain_are_drawn_once_and_told_in_the_truth() -> None:
    errors = ("rig.pressure_sensor.offset=500 Pa_d", "rig.pressure_sensor.gain=0.01")
    plain, shown = (perfect("step-response", *texts, seed=8) for texts in ((), errors))
    own = shown.truth["sensor_errors"]["pressure_1"]
    assert own["offset"] != 0.0 != own["gain"]
    gauge = plain.recording["pressure_1"] - 101325.0
    assert shown.recording["pressure_1"] - plain.recording["pressure_1"] == pytest.approx(
        own["offset"] + own["gain"] * gauge, abs=1e-6
    )
    drawn = [record("static-torque", seed=seed).truth["sensor_errors"]["torque"]["offset"] for seed in range(200)]
    assert np.std(drawn) == pytest.approx(0.02, rel=0.2)


def test_a_slow_sensor_shows_what_was_one_time_constant_ago_on_a_steady_ramp() -> None:
    lag = 2e-3
    fast, late = (
        perfect("vane-leak", "run.duration=2 s", "run.output_interval=10 ms", *texts).recording
        for texts in ((), (f"rig.pressure_sensor.lag={lag} s",))
    )
    slope = np.gradient(fast["pressure_1"], fast.time)
    expected = fast["pressure_1"] - lag * slope
    assert np.abs(late["pressure_1"] - expected)[5:-1].max() < 0.05 * np.abs(lag * slope).max()


def test_readings_are_whole_steps_of_the_sensor() -> None:
    angle = record("free-decay", "paper-bench", 2).recording["angle"] / math.radians(0.08)
    assert np.abs(angle - np.round(angle)).max() < 1e-6
    assert np.unique(np.round(angle)).size > 100


def test_the_sampling_rate_is_that_of_the_preset() -> None:
    slow = perfect("step-response", "rig.bench.rate=200 Hz").recording
    assert np.diff(slow.time) == pytest.approx(np.full(len(slow) - 1, 5e-3))


def test_static_torque_shows_the_planted_constant_and_twice_the_static_friction() -> None:
    made = perfect("static-torque", "friction.static_torque=0.6 N m")
    table = made.recording
    rising, falling = table["direction"] > 0.0, table["direction"] < 0.0
    order = np.argsort(table["pressure_difference"][falling], kind="stable")
    up = np.sort(table["torque"][rising])[3:]
    down = table["torque"][falling][order][3:]
    assert down - up == pytest.approx(np.full(up.size, 1.2))
    nominal = 0.5 * (up + down) / np.sort(table["pressure_difference"][rising])[3:]
    assert nominal == pytest.approx(np.full(up.size, made.truth["device"]["actuator"]["torque_constant"]))


def test_a_scale_carries_what_friction_cannot_and_never_pulls() -> None:
    assert on_scale(0.0, 1.0, 0.4) == pytest.approx(0.6)
    assert on_scale(3.0, 1.0, 0.4) == pytest.approx(1.4)
    assert on_scale(1.1, 1.0, 0.4) == pytest.approx(1.1)
    assert on_scale(0.0, 0.2, 0.4) == 0.0


def test_open_valve_flow_is_that_of_the_planted_orifice() -> None:
    made = perfect("open-valve-flow").recording
    choked = made["downstream_pressure"] < 0.5 * made["upstream_pressure"]
    # Cd A C1 with C1 = 0.002812 s/m of the paper's gas, printed as 0.00281.
    expected = 0.113 * 31.6e-6 * 0.0028118 * made["upstream_pressure"]
    assert made["mass_flow"][choked] == pytest.approx(expected[choked], rel=1e-3)
    assert choked.sum() > 10
    subsonic = made["downstream_pressure"] > 0.6 * made["upstream_pressure"]
    assert (made["mass_flow"][subsonic] < 0.995 * expected[subsonic]).all()


def test_the_valve_map_shows_dead_band_and_play() -> None:
    table = record("valve-map", "paper-bench").recording
    flow, command = table["mass_flow"], table["command"]
    top = int(np.argmax(command))
    half = [float(np.interp(0.5, command[:top], flow[:top])), float(np.interp(0.5, command[:top:-1], flow[:top:-1]))]
    assert half[1] - half[0] == pytest.approx(0.02 / 0.96 * 0.00448, rel=0.5)
    inside = np.abs(command) < 0.025
    assert np.abs(flow[inside] - np.median(flow[inside])).max() < 6e-5
    assert flow[-1] < 0.0 < flow[top]


@pytest.mark.parametrize("valve", ["proportional", "solenoid"])
def test_plugged_chambers_lose_nothing_but_to_each_other(valve: str) -> None:
    texts = (*PERFECT, "run.duration=5 s")
    table = record("vane-leak", "ideal-laboratory", overrides=texts, valve=valve).recording
    total = table["pressure_1"] + table["pressure_2"]
    assert total == pytest.approx(np.full(total.size, total[0]), rel=1e-5)
    assert table["pressure_1"][0] - table["pressure_1"][-1] > 1e4


def test_a_free_decay_slows_down_by_damping_and_friction() -> None:
    made = perfect("free-decay")
    rate = np.gradient(made.recording["angle"], made.recording.time)
    device = made.truth["device"]
    slowing = -np.gradient(rate, made.recording.time) * device["foot_plate"]["inertia"]
    expected = device["friction"]["viscous_damping"] * rate + device["friction"]["dynamic_torque"]
    assert slowing[5:300] == pytest.approx(expected[5:300], rel=1e-3)


def test_a_regulator_with_droop_falls_while_gas_flows() -> None:
    stiff, soft = (
        perfect("step-response", *texts).recording for texts in ((), ("supply_line.plantarflexion.droop=3e6 Pa s/kg",))
    )
    assert np.ptp(stiff["supply_pressure"]) == 0.0
    assert np.ptp(soft["supply_pressure"]) > 5e3


def test_the_truth_names_preset_overrides_and_device() -> None:
    made = record("static-torque", overrides=["rig.bench.friction_scatter=0", "friction.static_torque=0.5 N m"])
    assert made.truth["preset"]["values"]["bench.friction_scatter"] == 0.0
    assert made.truth["device"]["friction"]["static_torque"] == 0.5
    assert made.truth["device"]["effects"]["seal_friction"]["static_per_pressure"] == 2e-7
    assert "synthetic" in made.truth["notice"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"experiment": "step-respons"}, "did you mean 'step-response'"),
        ({"preset": "paper-bensh"}, "did you mean 'paper-bench'"),
        ({"overrides": ["rig.bench.friction_scater=0"]}, "did you mean 'rig.bench.friction_scatter'"),
        ({"overrides": ["rig.bench.friction_scatter=2"]}, "at least 0 and at most 0.5"),
        ({"overrides": ["rig.bench.rate=3 s"]}, "override 'rig.bench.rate=3 s'"),
    ],
)
def test_bad_input_is_one_line_with_the_nearest_name(words: dict[str, object], message: str) -> None:
    with pytest.raises(PpafoError) as caught:
        record(**{"experiment": "step-response", **words})  # type: ignore[arg-type]
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ("friction_scatter", "friction_scater", "did you mean 'friction_scatter'"),
        ('"-8 K"', '"-8 m"', "bench.gas_difference"),
    ],
)
def test_a_mistake_in_a_preset_file_is_named(before: str, after: str, message: str, tmp_path: Path) -> None:
    text = (resources.files("ppafo.rig") / "presets" / "paper-bench.toml").read_text(encoding="utf-8")
    assert before in text
    (tmp_path / "mine.toml").write_text(text.replace(before, after))
    with pytest.raises(PpafoError) as caught:
        record("static-torque", tmp_path / "mine.toml")
    assert message in str(caught.value)


def test_a_foreign_rig_file_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "rig.json").write_text('{"mine": 1}')
    with pytest.raises(DataError, match=r"no rig\.json of the simulated test bench"):
        write_rig_recording(tmp_path, record("static-torque"))
    assert (tmp_path / "rig.json").read_text() == '{"mine": 1}'


@pytest.mark.parametrize("renamed", [0, 1])
def test_a_folder_is_the_rig_s_again_whenever_a_writer_is_killed(
    renamed: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made, rename, done = record("static-torque"), Path.replace, list[Path]()

    def killed(path: Path, target: Path) -> Path:
        if len(done) == renamed:
            raise KeyboardInterrupt
        done.append(path)
        return rename(path, target)

    def not_tidied(path: Path, ignore_errors: bool) -> None:
        pass

    with monkeypatch.context() as patched:
        patched.setattr(Path, "replace", killed)
        patched.setattr("shutil.rmtree", not_tidied)
        with pytest.raises(KeyboardInterrupt):
            write_rig_recording(tmp_path, made)
    assert not (tmp_path / "static-torque.csv").exists()
    write_rig_recording(tmp_path, made)
    assert read_csv(tmp_path / "static-torque.csv").kind == "synthetic"


def test_the_published_schema_takes_every_preset() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    for name in list_presets():
        assert load_preset(name).name == name
        text = (resources.files("ppafo.rig") / "presets" / f"{name}.toml").read_text(encoding="utf-8")
        jsonschema.validate(tomllib.loads(text), json_schema())
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(tomllib.loads(text.replace("[bench]", "[bensh]")), json_schema())


def test_what_the_user_sets_takes_the_place_of_what_the_preset_sets() -> None:
    made = record("step-response", overrides=["valve.dead_band=0.1", "run.step=1 ms", "run.duration=20 ms"])
    assert made.truth["device"]["valve"]["dead_band"] == 0.1
