"""Delay, side and size of each curve of an imported gait, against the others."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from ppafo.errors import DataError
from ppafo.gait import at_speed, load_gait, walk_recording
from ppafo.gait.recorded import ImportSettings, import_gait
from ppafo.signals.recording import Floats

SHANK, ANKLE, MOMENT, FORCE = "shank_angle [rad]", "ankle_angle [rad]", "ankle_moment [N m/kg]", "vertical_force [-]"
HALF_A_STRIDE, PER_SECOND = 104, 200


@pytest.fixture
def remarks_of(csv_of: Callable[..., Path], tmp_path: Path) -> Callable[..., tuple[str, ...]]:
    """Remarks on a walk whose knee and centre of pressure are left out; some columns may be in a file of their own."""

    def said(columns: dict[str, Floats], apart: tuple[str, ...] = ()) -> tuple[str, ...]:
        kept = {name: values for name, values in columns.items() if name in (SHANK, ANKLE, MOMENT, FORCE)}
        files = []
        if apart:
            own = csv_of({name: kept.pop(name) for name in apart})
            files = [own.rename(tmp_path / "apart.csv")]
        return import_gait([csv_of(kept), *files], ImportSettings(62.0)).remarks

    return said


def later(columns: dict[str, Floats], names: tuple[str, ...], seconds: float) -> dict[str, Floats]:
    """These columns later than the others; the walk repeats."""
    shift = round(PER_SECOND * seconds)
    return columns | {name: np.roll(columns[name][:-1], shift)[np.r_[: columns[name].size - 1, 0]] for name in names}


@pytest.mark.parametrize("seconds", [-0.1, -0.05, 0.05, 0.1])
@pytest.mark.parametrize("names", [(SHANK, ANKLE), (SHANK,), (ANKLE,)])
def test_angles_on_another_clock_than_the_plates_are_said_with_the_delay(
    columns: dict[str, Floats],
    remarks_of: Callable[..., tuple[str, ...]],
    names: tuple[str, ...],
    seconds: float,
) -> None:
    remark = next(
        line for line in remarks_of(later(columns, names, seconds), names) if "check clocks and filters" in line
    )
    which = " and ".join(name.partition(" ")[0] for name in names)
    assert remark.startswith(f"{which}: about ")
    assert float(remark.partition("about ")[2].split()[0]) == pytest.approx(1000.0 * abs(seconds), abs=12.0)
    assert (" late relative to vertical_force" in remark) is (seconds > 0.0)


@pytest.mark.parametrize(
    ("name", "factor", "words"),
    [
        (MOMENT, 1.0 / 1.75, "8 cm about the ankle (usual: 10 to 21 cm); check the scale: N m/kg is per body mass"),
        (MOMENT, 0.5, "7 cm about the ankle"),
        (MOMENT, 2.0, "29 cm about the ankle"),
        (ANKLE, 2.0, "ankle_angle changes 1.9 times as much as shank_angle"),
        (ANKLE, 0.5, "ankle_angle has a range of 16 deg per stride"),
        (SHANK, 0.5, "shank_angle has a range of 36 deg per stride"),
    ],
)
def test_a_curve_of_another_size_than_the_others_let_expect_is_said(
    columns: dict[str, Floats],
    remarks_of: Callable[..., tuple[str, ...]],
    name: str,
    factor: float,
    words: str,
) -> None:
    middle = float(np.mean(columns[name])) if "rad" in name else 0.0
    scaled = middle + factor * (columns[name] - middle)
    assert any(words in line for line in remarks_of(columns | {name: scaled}))


@pytest.mark.parametrize(("follows", "is_said"), [(0.6, False), (0.4, False), (0.32, True)])
def test_an_ankle_that_turns_less_than_the_shank_while_the_foot_stands_is_usual_down_to_a_third(
    columns: dict[str, Floats], remarks_of: Callable[..., tuple[str, ...]], follows: float, is_said: bool
) -> None:
    # It turned 0.96 times as far; the factors leave what the whole stride covers above 18 deg for the first two alone.
    middle = float(np.mean(columns[ANKLE]))
    scaled = columns | {ANKLE: middle + follows / 0.96 * (columns[ANKLE] - middle)}
    assert any("times as much as shank_angle" in line for line in remarks_of(scaled)) is is_said


def test_a_moment_without_a_force_is_judged_by_its_peak(
    columns: dict[str, Floats], remarks_of: Callable[..., tuple[str, ...]]
) -> None:
    given = {name: columns[name] for name in (SHANK, ANKLE, MOMENT)}
    assert not any("ankle_moment" in line for line in remarks_of(given))
    said = remarks_of(given | {MOMENT: given[MOMENT] / 1.75})
    assert any("ankle_moment reaches 0.832 N m/kg (usual: 0.9 to 2.2 N m/kg)" in line for line in said)


def test_the_ankle_of_the_other_foot_is_refused_as_such_and_not_as_a_wrong_zero(
    columns: dict[str, Floats], remarks_of: Callable[..., tuple[str, ...]]
) -> None:
    other = later(columns, (ANKLE,), HALF_A_STRIDE / PER_SECOND)
    with pytest.raises(
        DataError, match=r"ankle_angle is shifted by 50 % of the stride against shank_angle, so it belongs"
    ):
        remarks_of(other)


@pytest.mark.parametrize("speed", [1.07, 1.2, 1.46, 1.59])
def test_the_built_in_gait_at_other_speeds_has_no_remark(
    csv_of: Callable[..., Path], remarks_of: Callable[..., tuple[str, ...]], speed: float
) -> None:
    walk = walk_recording(at_speed(load_gait(), speed), 4)
    given = {f"{name} [{walk.unit(name)}]": np.array(walk[name]) for name in ("shank_angle", "ankle_angle")}
    given |= {MOMENT: np.array(walk["ankle_moment"]), FORCE: np.array(walk["vertical_force"])}
    # The recording has no column of the knee, and nothing else is odd about it.
    (remark,) = import_gait([csv_of(given, walk.time)], ImportSettings(62.0)).remarks
    assert remark.startswith("no acceleration of the knee: ")
