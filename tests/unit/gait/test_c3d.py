"""C3D files: markers and model outputs, through ezc3d."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.gait import Gait
from ppafo.gait.recorded import ImportSettings, import_gait
from ppafo.gait.recorded.forms.c3d import open_c3d
from ppafo.gait.recorded.mapping import AngleMap, ForceMap, GaitMap, KneeMap, MomentMap, ShankMap
from ppafo.gait.recorded.source import read_table
from ppafo.signals import Recording
from ppafo.signals.recording import Floats

PHASES = np.linspace(0.0, 1.0, 101)


@pytest.fixture
def written(
    walk: Recording, normative: Gait, knee_way: Callable[[Floats], tuple[Floats, Floats]], tmp_path: Path
) -> Callable[..., Path]:
    """Writes the walk as a C3D file of 100 frames a second; points may be added or changed, channels too."""
    ezc3d = pytest.importorskip("ezc3d", reason="the extra c3d is not installed")

    def write(points: dict[str, Floats] | None = None, plate: bool = False, walk_along: float = 1.0) -> Path:
        frames = np.arange(0.0, walk.duration, 0.01)
        at = walk.resample(frames)
        shank, nothing = at["shank_angle"], np.zeros(frames.size)
        forward, up = knee_way(frames)
        knee = np.array([walk_along * 1000.0 * forward, nothing, 1000.0 * up])
        lean = np.array([walk_along * np.sin(shank), nothing, -np.cos(shank)])
        mass = normative.body_mass
        known = {
            "RKNE": knee,
            "RANK": knee + 400.0 * lean,
            "RAnkleAngles": np.array([90.0 - np.degrees(at["ankle_angle"]), nothing, nothing]),
            "RAnkleMoment": np.array([1000.0 * at["ankle_moment"], nothing, nothing]),
            "RGroundReactionForce": np.array([nothing, nothing, 9.80665 * at["vertical_force"]]),
        } | (points or {})
        file = ezc3d.c3d()
        file["parameters"]["POINT"]["RATE"]["value"] = [100.0]
        file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
        file["parameters"]["POINT"]["LABELS"]["value"] = [f"Walker:{label}" for label in known]
        file["data"]["points"] = np.array([np.vstack([xyz, np.ones(frames.size)]) for xyz in known.values()]).transpose(
            1, 0, 2
        )
        if plate:
            fast = np.repeat(9.80665 * mass * at["vertical_force"], 10)
            file["parameters"]["ANALOG"]["RATE"]["value"] = [1000.0]
            file["parameters"]["ANALOG"]["LABELS"]["value"] = ["Fz1"]
            file["parameters"]["ANALOG"]["UNITS"]["value"] = ["N"]
            file["data"]["analogs"] = fast[None, None, :]
        path = tmp_path / "walk.c3d"
        file.write(str(path))
        return path

    return write


def same(gait: Gait, truth: Gait) -> bool:
    """True where the curves agree, but for the 0.4 % of the stride by which the events differ."""
    shift = np.linspace(0.0, 0.01, 101)
    errors = [
        np.max(np.abs(gait.ankle_angle.values_at(PHASES) - truth.ankle_angle.values_at(PHASES + s))) for s in shift
    ]
    lean = [np.max(np.abs(gait.shank_angle.values_at(PHASES) - truth.shank_angle.values_at(PHASES + s))) for s in shift]
    return min(errors) < 0.004 and min(lean) < 0.004


def knee_error(gait: Gait, truth: Gait) -> float:
    """Largest root mean square error of the acceleration of the knee [m/s^2], at the start that fits best."""
    shift = np.linspace(0.0, 0.01, 21)
    errors = [
        max(
            float(np.sqrt(np.mean((gait.curve(name).values_at(PHASES) - truth.curve(name).values_at(PHASES + s)) ** 2)))
            for name in ("knee_forward", "knee_up")
        )
        for s in shift
    ]
    return min(errors)


def test_markers_and_outputs_of_plug_in_gait_are_read_by_convention(
    written: Callable[..., Path], normative: Gait
) -> None:
    found = import_gait([written()], ImportSettings(normative.body_mass)).gait
    assert same(found, normative)
    assert knee_error(found, normative) < 0.15
    assert found.curve("ankle_moment").mean == pytest.approx(normative.curve("ankle_moment").mean, abs=0.01)
    assert found.curve("vertical_force").mean == pytest.approx(normative.curve("vertical_force").mean, abs=0.01)


def test_a_walk_the_other_way_is_seen_in_the_markers_and_a_map_may_name_axes_and_plate(
    written: Callable[..., Path], normative: Gait
) -> None:
    columns = GaitMap(
        shank_angle=ShankMap(knee="RKNE", ankle="RANK", forward="-x"),
        ankle_angle=AngleMap(terms=("RAnkleAngles.x",), positive="dorsiflexion", unit="deg"),
        vertical_force=ForceMap(terms=("Fz1",)),
        knee=KneeMap(forward=("-RKNE.x",), up=("RKNE.z",)),
    )
    path = written(plate=True, walk_along=-1.0)
    found = import_gait([path], ImportSettings(normative.body_mass, columns=columns)).gait
    assert same(found, normative)
    assert knee_error(found, normative) < 0.15
    seen = import_gait([path], ImportSettings(normative.body_mass))
    assert same(seen.gait, normative)
    assert knee_error(seen.gait, normative) < 0.15
    assert "walking direction is -x, upwards is z" in seen.remarks
    forwards = replace(columns, shank_angle=ShankMap(knee="RKNE", ankle="RANK", forward="x"))
    with pytest.raises(DataError, match="forward = 'x' is reversed: 'RANK' travels against it; the axis is '-x'"):
        import_gait([path], ImportSettings(normative.body_mass, columns=forwards))


def test_what_a_map_leaves_out_is_read_from_the_outputs_of_the_model(
    written: Callable[..., Path], normative: Gait, walk: Recording
) -> None:
    moment = walk.resample(np.arange(0.0, walk.duration, 0.01))["ankle_moment"]
    # In kN m/kg: the format refuses the column, and a map of the moment alone mends it.
    path = written({"RAnkleMoment": np.array([1e-3 * moment, 0.0 * moment, 0.0 * moment])}, walk_along=-1.0)
    with pytest.raises(DataError, match="implausible for a moment in walking, in any of 'N m/kg'"):
        import_gait([path], ImportSettings(normative.body_mass))
    named = GaitMap(ankle_moment=MomentMap(terms=("RAnkleMoment.x",), positive="plantarflexion", unit="kN m/kg"))
    found = import_gait([path], ImportSettings(normative.body_mass, columns=named))
    assert same(found.gait, normative)
    assert knee_error(found.gait, normative) < 0.15
    assert "walking direction is -x, upwards is z" in found.remarks


@pytest.mark.parametrize("stored", [1.0, -1.0])
def test_the_weight_on_a_plate_is_upwards_whichever_axis_is_up(
    written: Callable[..., Path], monkeypatch: pytest.MonkeyPatch, stored: float
) -> None:
    path = written()
    content = open_c3d(path)
    weight = np.full(content["data"]["points"].shape[2], 600.0)
    plates = [{"force": stored * np.array([0.1 * weight, weight, -0.02 * weight])}]
    read = {"header": content["header"], "parameters": content["parameters"]}
    read["data"] = {name: content["data"][name] for name in ("points", "analogs")} | {"platform": plates}
    monkeypatch.setattr("ppafo.gait.recorded.forms.c3d.open_c3d", lambda _path: read)
    assert np.all(read_table(path).columns["force plate 1.y"] == weight)


def test_a_label_of_two_points_refuses_nothing_but_itself(
    written: Callable[..., Path], normative: Gait, walk: Recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    nobody = np.zeros((3, np.arange(0.0, walk.duration, 0.01).size))
    found = import_gait([written({"C1": nobody, "Other:C1": nobody + 1.0})], ImportSettings(normative.body_mass))
    assert same(found.gait, normative)
    assert "several points are named 'C1': they were renamed 'C1#1', 'C1#2'" in "\n".join(found.remarks)
    with pytest.raises(
        DataError, match=r"has several different columns 'RANK'; choose 'RANK#1' or 'RANK#2' in a gait map"
    ):
        import_gait([written({"Other:RANK": nobody})], ImportSettings(normative.body_mass))
    content = open_c3d(written({"C1": nobody}))
    content["parameters"]["POINT"]["LABELS"]["value"] = content["parameters"]["POINT"]["LABELS"]["value"][:-1]
    monkeypatch.setattr("ppafo.gait.recorded.forms.c3d.open_c3d", lambda _path: content)
    assert "1 point without a label not read" in read_table(written({"C1": nobody})).remarks


@pytest.mark.parametrize(
    ("place", "byte", "told"),
    [
        (b"DESCRIPTIONS\x07\x00\xff", 0x00, "is damaged: the library ezc3d crashes"),
        (b"EZC3D\x03\x00", 0x80, "ezc3d cannot read the file|requires far more memory"),
    ],
    ids=["no dimensions", "a description of negative length"],
)
def test_a_file_that_brings_the_library_down_is_refused_in_one_line(
    written: Callable[..., Path], place: bytes, byte: int, told: str
) -> None:
    path = written()
    content = bytearray(path.read_bytes())
    content[content.index(place) + len(place)] = byte
    path.write_bytes(content)
    resource = pytest.importorskip("resource", reason="this system does not tell how much memory was taken")
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(DataError, match=rf"walk\.c3d: ({told})"):
        read_table(path)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 500_000


def test_an_analog_channel_that_is_named_like_a_coordinate_takes_no_markers_place(
    written: Callable[..., Path], normative: Gait
) -> None:
    import ezc3d

    path = written(plate=True)
    file = ezc3d.c3d(str(path))
    file["parameters"]["ANALOG"]["LABELS"]["value"] = ["RKNE.x"]
    file.write(str(path))
    assert same(import_gait([path], ImportSettings(normative.body_mass)).gait, normative)
