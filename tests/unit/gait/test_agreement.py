"""The side of each curve of an imported gait, and a gait without a remark."""

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
def remarks_of(csv_of: Callable[..., Path]) -> Callable[..., tuple[str, ...]]:
    """Remarks on a walk whose knee and centre of pressure are left out."""

    def said(columns: dict[str, Floats]) -> tuple[str, ...]:
        kept = {name: values for name, values in columns.items() if name in (SHANK, ANKLE, MOMENT, FORCE)}
        return import_gait([csv_of(kept)], ImportSettings(62.0)).remarks

    return said


def later(columns: dict[str, Floats], names: tuple[str, ...], seconds: float) -> dict[str, Floats]:
    """These columns later than the others; the walk repeats."""
    shift = round(PER_SECOND * seconds)
    return columns | {name: np.roll(columns[name][:-1], shift)[np.r_[: columns[name].size - 1, 0]] for name in names}


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
