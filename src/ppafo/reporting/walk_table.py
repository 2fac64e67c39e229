"""The numbers of a walk as a table: with the device, without it, and of a healthy ankle."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ppafo.metrics import Metric
from ppafo.studies.endurance import Endurance
from ppafo.units import from_si
from ppafo.walking.comparison import Comparison

COLUMNS = ("with", "without", "healthy")
_NOTHING = "-"


@dataclass(frozen=True, slots=True)
class _Row:
    """A quantity of the table, and the unit in which it is shown; a share of the healthy work is in percent."""

    metric: str
    title: str
    unit: str
    digits: int


_ROWS = (
    _Row("gas", "Gas per stride", "g", 3),
    _Row("push_off_work", "Work on the wearer in push-off", "J", 2),
    _Row("push_off_share", "... of the healthy ankle's positive work", "percent", 1),
    _Row("slap_rate", "Rate of the foot as it comes down", "deg/s", 0),
    _Row("lowest_toes", "Lowest toes over the ground in mid-swing", "cm", 1),
    _Row("toe_landing", "Strides that begin on the toes", "percent", 0),
    _Row("angle_difference", "Ankle against healthy, RMS over the stride", "deg", 1),
)


def walk_rows(comparison: Comparison) -> list[tuple[str, str, tuple[str, ...]]]:
    """Return title, unit and the three cells of every row; a dash where there is no number."""
    healthy = dict(comparison.healthy)
    if "push_off_work" in healthy:
        healthy["push_off_share"] = Metric(1.0, "-", "")
    columns = (comparison.with_device.metrics, comparison.without_device.metrics, healthy)
    return [
        (row.title, "%" if row.unit == "percent" else row.unit, tuple(_cell(row, metrics) for metrics in columns))
        for row in _ROWS
    ]


def walk_table(comparison: Comparison) -> list[str]:
    """Return the table as aligned lines of text."""
    rows = walk_rows(comparison)
    title = max(len(f"{name} ({unit})") for name, unit, _ in rows)
    lines = [f"{'':<{title}}" + "".join(f"  {name:>8}" for name in COLUMNS)]
    for name, unit, cells in rows:
        lines.append(f"{f'{name} ({unit})':<{title}}" + "".join(f"  {cell:>8}" for cell in cells))
    return lines


def safety_sentence(comparison: Comparison) -> str:
    """Return what there is to say of the safe state; empty where the controller never went into it."""
    metrics = comparison.with_device.metrics
    if "safe_state_time" not in metrics:
        return ""
    return f"safe state: {metrics['safe_state_time'].summary}, at {metrics['safe_state_time'].value:.2f} s"


def bottle_sentence(life: Endurance | None) -> str:
    """Return how long one bottle lasts on the walk; empty where it took no gas."""
    if life is None:
        return ""
    course = life.discharge
    return (
        f"one bottle ({life.bottle.name}, {1.0e3 * life.bottle.mass:.0f} g): {course.walking_time / 60.0:.1f} min, "
        f"{course.steps:.0f} strides of this leg; {course.ending.message}"
    )


def bottle_document(life: Endurance | None) -> dict[str, Any] | None:
    """Return the same as data, in SI units."""
    if life is None:
        return None
    course = life.discharge
    return {
        "bottle": life.bottle.name,
        "gas_per_stride": life.draw.mass_per_step,
        "walking_time": course.walking_time,
        "strides": course.steps,
        "ending": course.ending.kind,
        "message": course.ending.message,
    }


def _cell(row: _Row, metrics: Mapping[str, Metric]) -> str:
    if row.metric not in metrics:
        return _NOTHING
    metric = metrics[row.metric]
    unit, si_unit = ("percent", "1") if metric.unit == "-" else (row.unit, metric.unit)
    text = f"{from_si(metric.value, unit, si_unit):.{row.digits}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text
