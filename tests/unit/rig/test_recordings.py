"""What the rig records: channels, noise, rounding, the same bytes for the same seed."""

import sys
import tomllib
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from ppafo.errors import DataError, ParameterError, PpafoError
from ppafo.progress import Progress
from ppafo.rig import list_presets, load_preset, record
from ppafo.rig.experiments import EXPERIMENTS
from ppafo.rig.folder import write_rig_recording
from ppafo.rig.preset import PATHS, SECTIONS, Preset, json_schema
from ppafo.rig.steady import on_scale
from ppafo.signals.recording import CHANNELS
from ppafo.storage import read_csv
from ppafo.storage.comma_separated import marked_csv_bytes

SHORT = {"torque-task": ["run.duration=0.1 s"], "vane-leak": ["run.duration=2 s"]}
WANTED = {
    "static-torque": {"torque", "pressure_difference", "direction", "repetition"},
    "free-decay": {"angle"},
    "open-valve-flow": {"upstream_pressure", "downstream_pressure", "mass_flow", "command"},
    "vane-leak": {"pressure_1", "pressure_2"},
    "vane-leak-steady": {"pressure_1", "pressure_2", "mass_flow"},
    "valve-map": {"command", "mass_flow", "upstream_pressure", "downstream_pressure"},
    "step-response": {
        "angle",
        "pressure_1",
        "pressure_2",
        "supply_pressure",
        "dorsiflexion_pressure",
        "command",
        "torque",
    },
    "torque-task": {
        "angle",
        "pressure_1",
        "pressure_2",
        "supply_pressure",
        "dorsiflexion_pressure",
        "command",
        "torque",
        "reference",
    },
}


@pytest.mark.parametrize("name", ["free-decay", "static-torque", "step-response", "valve-map"])
def test_an_effect_that_the_rig_does_not_have_is_refused_before_it_records_without_it(name: str) -> None:
    with pytest.raises(
        ParameterError,
        match=r"not support the effect 'silencer': .* off with 'effects\.silencer\.sonic_conductance=0 m\^3/\(s Pa\)'",
    ):
        record(name, "ideal-laboratory", 1, overrides=["effects.silencer.sonic_conductance=1e-8 m^3/(s Pa)"])
    record("valve-map", "ideal-laboratory", 1, overrides=["effects.silencer.sonic_conductance=0 m^3/(s Pa)"])


@pytest.mark.parametrize("name", EXPERIMENTS)
def test_an_experiment_records_its_channels_as_synthetic_and_reads_back(name: str, tmp_path: Path) -> None:
    made = record(name, "paper-bench", 3, overrides=SHORT.get(name, []))
    assert set(made.recording.names) == WANTED[name]
    assert all(made.recording.unit(channel) == CHANNELS[channel].unit for channel in made.recording.names)
    assert made.recording.kind == "synthetic"
    assert marked_csv_bytes(made.recording).startswith(b"# synthetic: ")
    files = write_rig_recording(tmp_path, made)
    back = read_csv(tmp_path / files[0])
    assert back == made.recording


def test_the_samples_are_counted_while_it_records_and_stay_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    words = ("torque-task", "ideal-laboratory", 1, "ppafo2011", SHORT["torque-task"])
    quiet = record(*words).recording
    monkeypatch.setattr("ppafo.rig.solution._BETWEEN_REPORTS", 0.0)
    told: list[Progress] = []
    assert record(*words, progress=told.append).recording == quiet
    # A decision every millisecond, for 0.1 s.
    assert len(told) >= 100
    done = [progress.done for progress in told]
    assert done == sorted(done)
    assert {progress.total for progress in told} == {len(quiet)}
    assert 0 < done[-1] <= len(quiet)


@pytest.mark.parametrize("name", ["static-torque", "step-response"])
def test_the_same_seed_gives_the_same_bytes_and_another_seed_others(name: str) -> None:
    first, again, other = (marked_csv_bytes(record(name, seed=seed).recording) for seed in (5, 5, 6))
    assert first == again
    assert first != other


def test_noise_has_the_size_of_the_preset_and_is_independent_between_channels(perfect: Preset) -> None:
    noisy = perfect.with_value("pressure_sensor.noise", 1000.0, "a test")
    plain, shown = (record("step-response", preset, 4).recording for preset in (perfect, noisy))
    first, second = (shown[name] - plain[name] for name in ("pressure_1", "pressure_2"))
    count = first.size
    assert first.std() == pytest.approx(1000.0, rel=4.0 / np.sqrt(2.0 * count))
    assert abs(first.mean()) < 4.0 * 1000.0 / np.sqrt(count)
    assert abs(np.corrcoef(first, second)[0, 1]) < 4.0 / np.sqrt(count)
    assert abs(np.corrcoef(first[1:], first[:-1])[0, 1]) < 4.0 / np.sqrt(count)
    assert np.array_equal(shown["angle"], plain["angle"])


def test_an_offset_is_drawn_once_and_told_in_the_truth(perfect: Preset) -> None:
    moved = perfect.with_value("angle_sensor.offset", 0.01, "a test")
    plain, shown = (record("step-response", preset, 8) for preset in (perfect, moved))
    difference = shown.recording["angle"] - plain.recording["angle"]
    assert difference == pytest.approx(np.full(difference.size, shown.truth["sensor_offsets"]["angle"]))
    drawn = [record("static-torque", seed=seed).truth["sensor_offsets"]["torque"] for seed in range(200)]
    assert np.std(drawn) == pytest.approx(0.02, rel=0.2)


def test_readings_are_whole_steps_of_the_sensor() -> None:
    preset = load_preset("paper-bench")
    angle = record("free-decay", preset, 2).recording["angle"] / preset.values["angle_sensor.resolution"]
    assert np.abs(angle - np.round(angle)).max() < 1e-6
    assert np.unique(np.round(angle)).size > 100


def test_the_sampling_rate_is_that_of_the_preset(perfect: Preset) -> None:
    slow = record("step-response", perfect.with_value("sampling.rate", 200.0, "a test")).recording
    assert np.diff(slow.time) == pytest.approx(np.full(len(slow) - 1, 5e-3))


def test_static_torque_shows_the_planted_constant_and_twice_the_static_friction(perfect: Preset) -> None:
    made = record("static-torque", perfect, overrides=["friction.static_torque=0.6 N m"])
    table = made.recording
    rising, falling = table["direction"] > 0.0, table["direction"] < 0.0
    order = np.argsort(table["pressure_difference"][falling], kind="stable")
    up = np.sort(table["torque"][rising])[3:]
    down = table["torque"][falling][order][3:]
    assert down - up == pytest.approx(np.full(up.size, 1.2))
    nominal = 0.5 * (up + down) / np.sort(table["pressure_difference"][rising])[3:]
    assert nominal == pytest.approx(np.full(up.size, made.device.actuator.torque_constant))


def test_a_scale_carries_what_friction_cannot_and_never_pulls() -> None:
    assert on_scale(0.0, 1.0, 0.4) == pytest.approx(0.6)
    assert on_scale(3.0, 1.0, 0.4) == pytest.approx(1.4)
    assert on_scale(1.1, 1.0, 0.4) == pytest.approx(1.1)
    assert on_scale(0.0, 0.2, 0.4) == 0.0


def test_open_valve_flow_is_that_of_the_planted_orifice(perfect: Preset) -> None:
    made = record("open-valve-flow", perfect).recording
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


def test_plugged_chambers_lose_nothing_but_to_each_other(perfect: Preset) -> None:
    table = record("vane-leak", perfect, overrides=["run.duration=5 s"]).recording
    total = table["pressure_1"] + table["pressure_2"]
    assert total == pytest.approx(np.full(total.size, total[0]), rel=1e-5)
    assert table["pressure_1"][0] - table["pressure_1"][-1] > 1e4


def test_a_free_decay_slows_down_by_damping_and_friction(perfect: Preset) -> None:
    made = record("free-decay", perfect)
    rate = np.gradient(made.recording["angle"], made.recording.time)
    inertia, friction = made.device.foot_plate.inertia, made.device.friction
    slowing = -np.gradient(rate, made.recording.time) * inertia
    expected = friction.viscous_damping * rate + friction.dynamic_torque
    assert slowing[5:300] == pytest.approx(expected[5:300], rel=1e-3)


@pytest.mark.parametrize("name", list_presets())
def test_every_value_of_a_preset_has_a_reason(name: str) -> None:
    preset = load_preset(name)
    assert preset.name == name
    assert set(preset.values) == set(preset.reasons) == set(PATHS)
    assert all(len(reason) > 5 for reason in preset.reasons.values())


def test_the_truth_names_the_preset_with_overrides_and_the_device() -> None:
    made = record("static-torque", overrides=["rig.friction.scatter=0", "friction.static_torque=0.5 N m"])
    assert made.truth["preset"]["values"]["friction.scatter"] == 0.0
    assert made.truth["preset"]["reasons"]["friction.scatter"] == "override"
    assert made.truth["device"]["friction"]["static_torque"] == 0.5
    assert "synthetic" in made.truth["notice"]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"experiment": "step-respons"}, "did you mean 'step-response'"),
        ({"preset": "paper-bensh"}, "did you mean 'paper-bench'"),
        ({"seed": -1}, "seed = -1"),
        ({"device": "ppafo2012"}, "ppafo2011"),
        ({"overrides": ["rig.friction.scater=0"]}, "did you mean 'rig.friction.scatter'"),
        ({"overrides": ["rig.friction.scatter=2"]}, "at least 0 and at most 0.5"),
        ({"overrides": ["rig.line.volume=3 s"]}, "override 'rig.line.volume=3 s'"),
        ({"overrides": ["rig.line.volume=40 cm^3"]}, "is part of each dead volume"),
        ({"overrides": ["rig.line.area=0 m^2"]}, "must be above 0 if line.volume is above 0"),
        ({"overrides": ["friction.statik_torque=1 N m"]}, "did you mean"),
        ({"valve": "solenoyd"}, "did you mean 'solenoid'"),
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
        (
            "[gas.heat_transfer_coefficient]",
            "[gas.heat_transfer_coeficient]",
            "did you mean 'heat_transfer_coefficient'",
        ),
        ('unit = "1/m"', 'unit = "K"', "gas.wall_area_per_volume"),
        ("value = 60.0", 'value = "60"', "must be a valid number"),
        ("value = 60.0", "value = -60.0", "must be at least 0"),
        ("schema_version = 1", "schema_version = 2", "schema_version = 2 is not allowed; allowed: 1"),
        ("reason =", "note =", "allowed here: value, unit, reason"),
        ("[sampling.rate]", "[sampling.rates]", "did you mean 'rate'"),
    ],
)
def test_a_mistake_in_a_preset_file_is_named(before: str, after: str, message: str, tmp_path: Path) -> None:
    text = (resources.files("ppafo.rig") / "presets" / "paper-bench.toml").read_text(encoding="utf-8")
    assert before in text
    file = tmp_path / "mine.toml"
    file.write_text(text.replace(before, after))
    with pytest.raises(ParameterError, match=r"mine\.toml") as caught:
        load_preset(file)
    assert message in str(caught.value)


def test_a_foreign_rig_file_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "rig.json").write_text('{"mine": 1}')
    with pytest.raises(DataError, match="was not written by the simulated test bench"):
        write_rig_recording(tmp_path, record("static-torque"))


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


def test_an_empty_preset_points_to_the_schema_or_names_what_is_missing(tmp_path: Path) -> None:
    for text, message in (
        ("", "'ppafo doctor --schema rig' prints its format"),
        ("# nothing yet\n", "'gas.heat_transfer_coefficient', 'gas.wall_area_per_volume'"),
    ):
        (tmp_path / "mine.toml").write_text(text)
        with pytest.raises(ParameterError, match=message):
            load_preset(tmp_path / "mine.toml")


def test_the_published_schema_takes_every_preset_and_names_every_value() -> None:
    jsonschema = pytest.importorskip("jsonschema")
    for name in list_presets():
        text = (resources.files("ppafo.rig") / "presets" / f"{name}.toml").read_text(encoding="utf-8")
        jsonschema.validate(tomllib.loads(text), json_schema())
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(tomllib.loads(text.replace("[line.delay]", "[line.dely]")), json_schema())
    described = json_schema()["$defs"]
    assert {item.name for item in SECTIONS["line"]} == set(described["Line"]["required"])


def test_the_second_supply_sags_by_itself_and_leaves_the_noise_of_the_others_as_it_was(perfect: Preset) -> None:
    sagging = perfect.with_value("supply.droop", 3.0e6, "a test").with_value("supply.recovery_time", 0.03, "a test")
    recording = record("step-response", sagging, 1).recording
    first, second = (recording[name] for name in ("supply_pressure", "dorsiflexion_pressure"))
    # The valve feeds chamber 1 only, so only that regulator gives way.
    assert np.ptp(first) > 5.0e3
    assert np.ptp(second) < 0.1 * np.ptp(first)
    noisy = perfect.with_value("pressure_sensor.noise", 1000.0, "a test")
    shown = record("step-response", noisy, 1).recording
    likeness = np.corrcoef(shown["supply_pressure"], shown["dorsiflexion_pressure"])[0, 1]
    assert abs(likeness) < 4.0 / np.sqrt(len(shown))


def test_a_rig_records_without_a_solver_of_another_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "sksundae", None)
    monkeypatch.setitem(sys.modules, "sksundae.cvode", None)
    made = record("step-response", overrides=["run.duration=0.02 s"]).recording
    assert len(made) == 21
    assert np.all(np.isfinite(made["pressure_1"]))
