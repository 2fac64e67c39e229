"""Task sequences: files and their mistakes, segments in time, and what foot, gas and many wearers do in them."""

import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ppafo.analyses.endurance.walk_gas import walk_gas
from ppafo.analyses.walk.task_sequence import task_sequence_parts
from ppafo.errors import ScenarioError
from ppafo.gait import load_gait
from ppafo.model.contact import FLAT
from ppafo.model.plant import chamber_mass, chamber_volumes
from ppafo.walking import load_walk, walk, walk_population
from ppafo.walking.evaluation import integral_of_a_stride
from ppafo.walking.motion import walk_of, with_duration
from ppafo.walking.planning import plan_walk, planned_task_sequence
from ppafo.walking.result import WalkResult
from ppafo.walking.strides import steady_strides, task_sequence_metrics
from ppafo.walking.task_sequence import FILE, TaskSequence, load_task_sequence
from ppafo.walking.walk import WalkComparison
from tests.composed_programs import lane_source

HEAD = 'schema_version = 1\nname = "tried"\n'
STAND = '[[segment]]\nkind = "stand"\nduration = "1 s"\n'
WALK = '[[segment]]\nkind = "walk"\nspeed = "1.2 m/s"\nstrides = 2\n'
GAIT = load_gait("falisse2019-subject1")


def written(folder: Path, *segments: str) -> Path:
    path = folder / "tried.toml"
    path.write_text(HEAD + "".join(segments))
    return path


def sequence_of(folder: Path, *segments: str) -> TaskSequence:
    return load_task_sequence(written(folder, *segments))


MISTAKES = {
    "unknown segment": ('[[segment]]\nkind = "wlk"\n', ("segment 1: kind = 'wlk' is not known", "'walk'")),
    "no kind": ('[[segment]]\nduration = "1 s"\n', ("segment 1: 'kind' is missing", "allowed: stand")),
    "unknown key": (WALK + "speeed = 1\n", ("segment 1 (walk): unknown key 'speeed'", "'speed'")),
    "too fast": (WALK.replace("1.2", "3"), ("segment 1 (walk): speed = '3 m/s'", "at least 0.4 m/s", "1.6 m/s")),
    "too slow": (WALK.replace("1.2", "0.1"), ("speed = '0.1 m/s'", "at least 0.4 m/s")),
    "negative duration": (STAND.replace("1 s", "-1 s"), ("segment 1 (stand): duration = '-1 s'", "at least 0.5 s")),
    "no unit": (WALK.replace('"1.2 m/s"', "1.2"), ("segment 1 (walk): speed = 1.2", "without a unit")),
    "no duration": ('[[segment]]\nkind = "stand"\n', ("segment 1 (stand): 'duration' is missing",)),
    "half a stride": (WALK.replace("= 2", "= 1.5"), ("segment 1 (walk): strides = 1.5", "whole number")),
    "both lengths": (WALK + 'duration = "3 s"\n', ("segment 1 (walk): give either duration or strides, not both",)),
    "no length": (WALK.replace("strides = 2\n", ""), ("segment 1 (walk): give either duration or strides",)),
    "both speeds": (WALK + 'cadence = "100 1/min"\n', ("segment 1 (walk): give either speed or cadence, not both",)),
    "stop in standing": (STAND + '[[segment]]\nkind = "stop"\n', ("segment 2 (stop): the wearer is standing at this",)),
    "scuff in standing": ('[[segment]]\nkind = "scuff"\n', ("segment 1 (scuff): the wearer is standing at this",)),
    "start in walking": (
        WALK + '[[segment]]\nkind = "start"\n',
        ("segment 2 (start): the wearer is already walking at this point",),
    ),
    "ramp to nowhere": (
        WALK + '[[segment]]\nkind = "ramp"\nstrides = 3\n',
        ("segment 2 (ramp): give speed or cadence",),
    ),
    "tight turn": ('[[segment]]\nkind = "turn"\nstrides = 2\nradius = "0.2 m"\n', ("radius must be at least 0.5 m",)),
    "steep slope": (WALK + 'slope = "20 deg"\n', ("segment 1 (walk): slope = '20 deg'", "at most")),
    "no segments": ("segment = []\n", ("segment",)),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_one_line_that_names_the_segment(mistake: str, tmp_path: Path) -> None:
    text, said = MISTAKES[mistake]
    with pytest.raises(ScenarioError) as raised:
        load_task_sequence(written(tmp_path, text))
    message = str(raised.value)
    assert "\n" not in message
    assert message.startswith(f"{tmp_path / 'tried.toml'}: ")
    for words in said:
        assert words in message


def test_mistakes_in_several_segments_are_in_one_refusal(tmp_path: Path) -> None:
    lacking = STAND.replace('duration = "1 s"\n', ""), WALK.replace('kind = "walk"\n', ""), WALK
    with pytest.raises(ScenarioError) as raised:
        load_task_sequence(written(tmp_path, *lacking))
    missing = [part.partition("segment ")[2].partition(" missing")[0] for part in raised.value.parts]
    assert missing == ["1 (stand): 'duration' is", "2: 'kind' is"]


def test_a_cadence_beyond_the_speeds_of_a_task_sequence_is_refused(tmp_path: Path) -> None:
    sequence = sequence_of(tmp_path, WALK.replace('speed = "1.2 m/s"', 'cadence = "150 1/min"'))
    with pytest.raises(ScenarioError, match=r"segment 1 \(walk\): cadence: .* 0\.4 to 1\.6 m/s"):
        planned_task_sequence(sequence, GAIT)


def test_more_segments_than_a_task_sequence_has_room_for_are_refused(tmp_path: Path) -> None:
    sequence = sequence_of(tmp_path, *([STAND, WALK] * 20))
    with pytest.raises(ScenarioError, match="32 are allowed"):
        planned_task_sequence(sequence, GAIT)


def test_an_unknown_task_sequence_is_refused_with_the_nearest_name() -> None:
    with pytest.raises(ScenarioError, match="there is no task sequence 'corider', did you mean 'corridor'"):
        load_walk("solenoid", task_sequence="corider")


def test_a_walk_file_names_its_task_sequence_by_a_path_beside_it(tmp_path: Path) -> None:
    written(tmp_path, STAND, WALK)
    (tmp_path / "own.toml").write_text(
        'schema_version = 1\nname = "own"\ntask_sequence = "tried.toml"\n'
        '[device]\nset = "ppafo2011"\nvalve = "solenoid"\n'
        '[controller]\nkind = "event_on_off"\n'
    )
    sequence = walk_of(load_walk(tmp_path / "own.toml")).task_sequence
    assert sequence is not None
    assert [segment.kind for segment in sequence.segments] == ["stand", "walk"]
    replaced = walk_of(load_walk(tmp_path / "own.toml", task_sequence="stairs")).task_sequence
    assert replaced is not None
    assert replaced.name == "stairs"


@pytest.mark.parametrize("name", FILE.names())
def test_the_segments_of_a_task_sequence_follow_each_other_and_walk_whole_strides(name: str) -> None:
    planned = planned_task_sequence(load_task_sequence(name), GAIT)
    ends = [float(span.end) for span in planned.spans]
    assert [float(span.start) for span in planned.spans] == [0.0, *ends[:-1]]
    assert ends[-1] == planned.duration
    turns = [float(part.turns) for part in planned.timed.parts if part.start < 1.0e5]
    whole = np.array(turns) - turns[0]
    assert np.abs(2.0 * whole - np.round(2.0 * whole)).max() < 1.0e-9


def test_a_walk_takes_the_nearest_whole_number_of_strides(tmp_path: Path) -> None:
    given = '[[segment]]\nkind = "walk"\nspeed = "1.2 m/s"\nduration = "20 s"\n'
    span = planned_task_sequence(sequence_of(tmp_path, STAND, given), GAIT).spans[1]
    assert abs(span.end - span.start - 20.0) <= 0.5 * GAIT.stride_time * (1.33 / 1.2) ** 0.5


def test_a_walk_without_a_task_sequence_is_composed_without_one() -> None:
    text = lane_source(plan_walk(with_duration(load_walk("solenoid"), 60.0)).program)
    assert "gait_in_task_sequence(" not in text
    assert "scuff" not in text
    with_task_sequence = lane_source(
        plan_walk(with_duration(load_walk("solenoid", task_sequence="stairs"), 60.0)).program
    )
    assert "gait_in_task_sequence(" in with_task_sequence
    assert "model_gait_measured_at" in text
    assert "model_gait_measured_at" not in with_task_sequence


@pytest.fixture(scope="module")
def corridor() -> WalkResult:
    return walk("solenoid", task_sequence="corridor")


def within(result: WalkResult, kind: str, margin: float = 0.0) -> list[np.ndarray]:
    time = result.recording.time
    return [
        (time >= item.start + margin) & (time <= item.end - margin) for item in result.segments if item.kind == kind
    ]


def test_in_standing_the_foot_is_flat_and_both_sensors_are_loaded(corridor: WalkResult) -> None:
    recording, weight = corridor.recording, 72.5 * 9.80665
    first, second, _, last = within(corridor, "stand")
    for standing in (first, second, last):
        assert (recording["contact"][standing] == FLAT).all()
        assert np.ptp(recording["angle"][standing]) < 1.0e-3
        for sensor in ("heel_force", "toe_force"):
            assert recording[sensor][standing] == pytest.approx(0.25 * weight, rel=0.05)


def test_gas_is_kept_in_a_task_sequence(corridor: WalkResult) -> None:
    run = plan_walk(with_duration(load_walk("solenoid", task_sequence="corridor"), 1.0))
    recording, plant = corridor.recording, run.plant
    volumes = chamber_volumes(plant, recording["angle"])  # type: ignore[arg-type]
    masses = [
        chamber_mass(recording[f"pressure_{side}"], volume, plant.gas_product)
        for side, volume in zip((1, 2), volumes, strict=True)
    ]
    balance = masses[0] + masses[1] - recording["supplied_mass"] + recording["vented_mass"]
    assert recording["supplied_mass"][-1] > 0.01
    assert np.ptp(balance) < 1.0e-10


def test_the_segments_add_up_to_the_task_sequence(corridor: WalkResult) -> None:
    metrics, segments = corridor.metrics, corridor.segments
    assert sum(item.gas for item in segments) == pytest.approx(metrics["task_sequence_gas"].value, rel=1.0e-9)
    assert metrics["task_sequence_gas"].value == corridor.recording["supplied_mass"][-1]
    assert sum(item.strides for item in segments) == corridor.starts.size
    assert metrics["task_sequence_strides"].value == corridor.starts.size
    lowest = [item.lowest_toes for item in segments if item.lowest_toes is not None]
    assert metrics["task_sequence_lowest_toes"].value == min(lowest)
    assert metrics["steady_strides"].value < metrics["strides"].value


def test_means_are_over_the_strides_at_an_even_speed_on_level_ground(corridor: WalkResult) -> None:
    strikes = corridor.recording.time[corridor.starts]
    walked = [item for item in corridor.segments if item.kind == "walk"]
    inside = [
        any(item.start <= first and last <= item.end for item in walked) for first, last in itertools.pairwise(strikes)
    ]
    steady = int(corridor.metrics["steady_strides"].value)
    assert 0 < steady <= sum(inside)
    assert "even speed" in corridor.metrics["gas"].summary


def test_an_integral_of_a_stride_is_over_the_strides_of_the_means(corridor: WalkResult) -> None:
    steady = steady_strides(
        planned_task_sequence(load_task_sequence("corridor"), GAIT), corridor.recording.time[corridor.starts]
    )
    angle = corridor.recording["angle"]
    # Of the angle itself it is half of what its square gained from strike to strike.
    gains = np.diff(0.5 * angle[corridor.starts] ** 2)[steady]
    assert integral_of_a_stride(corridor, angle) == pytest.approx(gains.mean(), abs=1.0e-12)


def test_a_walk_longer_than_its_task_sequence_has_the_gas_and_the_time_of_the_sequence(corridor: WalkResult) -> None:
    planned = planned_task_sequence(load_task_sequence("corridor"), GAIT)
    longer = task_sequence_metrics(replace(planned, duration=40.0), corridor.segments, corridor.recording, 0)
    assert longer["task_sequence_time"].value == longer["task_sequence_planned_time"].value == 40.0
    assert longer["task_sequence_gas"].value == corridor.recording["supplied_mass"][corridor.recording.time <= 40.0][-1]
    gas = walk_gas(replace(corridor, metrics={**corridor.metrics, **longer}))
    assert (gas.stride_time, gas.gas_per_stride) == (40.0, longer["task_sequence_gas"].value)


def test_the_table_of_a_task_sequence_counts_strides(corridor: WalkResult) -> None:
    table = task_sequence_parts(WalkComparison(corridor, corridor, {}))[0]
    *parts, whole = (int(str(row[3])) for row in table.rows)
    assert whole == sum(parts)


def test_the_toe_sensor_shows_a_scuff_in_the_swing(corridor: WalkResult) -> None:
    recording = corridor.recording
    (scuff,) = within(corridor, "scuff")
    usual = within(corridor, "walk", 2.0)[1]
    swing = recording["contact"] == 0.0
    late = recording["toe_force"] > 100.0
    interval = recording.time[1]
    assert 0.03 < np.count_nonzero(scuff & swing & late) * interval < 0.05
    assert np.count_nonzero(usual & swing & late) == 0


def test_the_recording_has_the_speed_of_each_segment(corridor: WalkResult) -> None:
    recording = corridor.recording
    walked = [item for item in corridor.segments if item.kind == "walk"]
    for item, speed in zip(walked, (1.2, 0.8, 0.8, 1.4, 1.4), strict=True):
        late = (recording.time > item.end - 2.0) & (recording.time < item.end)
        assert np.count_nonzero(late) > 300
        assert recording["walking_speed"][late] == pytest.approx(speed, rel=1.0e-6)
    assert recording["walking_speed"][within(corridor, "stand")[0]].max() == 0.0
    way = np.diff(recording["walking_speed"][within(corridor, "walk", 2.5)[0]]).size * recording.time[1] * 1.2
    assert way < corridor.metrics["task_sequence_length"].value < 1.4 * recording.time[-1]


def first_loaded(result: WalkResult, start: float, end: float) -> list[str]:
    """Which sensor shows a tenth of the body weight first after each strike."""
    found = []
    for first in result.starts:
        if start <= result.recording.time[first] < end:
            later = slice(first, first + 400)
            heel, toe = (np.argmax(result.recording[f"{name}_force"][later] > 71.0) for name in ("heel", "toe"))
            found.append("toe" if toe < heel else "heel")
    return found


def test_on_stairs_the_toes_are_loaded_first_also_with_a_device_that_lifts_them() -> None:
    result = walk("solenoid", task_sequence="stairs")
    before, first, _, second, after, *_ = result.segments[1:]
    for item in (first, second):
        assert first_loaded(result, item.start, item.end) == ["toe"] * 6
    for item in (before, after):
        assert set(first_loaded(result, item.start + 2.0, item.end)) == {"heel"}


def test_a_task_sequence_has_the_same_bits_alone_and_in_a_population() -> None:
    configuration = load_walk("solenoid", task_sequence="stairs")
    people = walk_population(configuration, minutes=0.3, wearers=20, seed=2)
    alone = walk_population(configuration, minutes=0.3, wearers=1, seed=2)
    single = walk(configuration, minutes=0.3)
    for name, values in people.outcomes.items():
        assert values[0] == alone.outcomes[name][0], name
    assert people.outcomes["gas"].size == 20
    assert np.ptp(people.outcomes["gas"]) > 0.0
    strides = single.recording["supplied_mass"][-1] / people.outcomes["gas"][0]
    assert strides == pytest.approx(single.starts.size, abs=1.0)


def test_a_population_walks_until_the_slowest_is_through() -> None:
    configuration = load_walk("solenoid", task_sequence="first-steps")
    people = walk_population(configuration, minutes=None, wearers=12, seed=2)
    assert people.diverged == 0
    assert 60.0 * people.minutes > planned_task_sequence(load_task_sequence("first-steps"), GAIT).duration
