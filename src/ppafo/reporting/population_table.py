"""What many wearers get, as quantiles: in text, and as data."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from ppafo.signals.recording import Floats
from ppafo.walking.population import OUTCOMES, TRAITS, Number, Population

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)


@dataclass(frozen=True, slots=True)
class Shown:
    """How a number is shown: title, unit, and what an SI value is multiplied by."""

    title: str
    unit: str
    factor: float
    digits: int


SHOWN: dict[str, Shown] = {
    "gas": Shown("Gas per stride", "g", 1000.0, 3),
    "push_off_work": Shown("Work on the wearer in push-off", "J", 1.0, 2),
    "slap_rate": Shown("Rate of the foot as it comes down", "deg/s", float(np.degrees(1.0)), 0),
    "toe_clearance": Shown("Lowest toes in mid-swing against healthy", "cm", 100.0, 1),
    "toe_landing": Shown("Strides that begin on the toes", "%", 100.0, 0),
    "body_mass": Shown("Body mass", "kg", 1.0, 1),
    "shank_length": Shown("Shank", "cm", 100.0, 1),
    "stride_time": Shown("Stride time", "s", 1.0, 3),
    "stance_share": Shown("Stance", "%", 100.0, 1),
}


def population_table(population: Population) -> list[str]:
    """Return the quantiles as aligned lines of text."""
    tables = {**population.outcomes, **population.traits}
    title = max(len(f"{item.title} ({item.unit})") for item in SHOWN.values())
    head = f"{population.configuration.name}: {population.count} wearers, {population.minutes:.3g} min each"
    names = "".join(f"  {f'{100.0 * share:.0f} %':>8}" for share in QUANTILES)
    lines = [head, "", f"{'':<{title}}{names}"]
    for name, item in SHOWN.items():
        cells = "".join(f"  {text:>8}" for text in _cells(tables[name], item))
        lines.append(f"{f'{item.title} ({item.unit})':<{title}}{cells}")
    if population.vented:
        lines += ["", f"safe state: the controllers of {population.vented} wearers vented both chambers for good"]
    return lines


def population_rows(population: Population) -> list[tuple[str, list[str]]]:
    """Return title and cells of every row."""
    tables = {**population.outcomes, **population.traits}
    return [(f"{item.title} ({item.unit})", _cells(tables[name], item)) for name, item in SHOWN.items()]


def quantiles(table: Mapping[str, Floats], numbers: Mapping[str, Number]) -> dict[str, dict[str, object]]:
    """Return the quantiles of every number in SI units, with unit and meaning."""
    return {
        name: {
            "unit": item.unit,
            "summary": item.summary,
            "mean": float(table[name].mean()) if table[name].size else None,
            "quantiles": dict(zip(map(str, QUANTILES), _values(table[name]).tolist(), strict=False)),
        }
        for name, item in numbers.items()
    }


def all_quantiles(population: Population) -> dict[str, dict[str, dict[str, object]]]:
    """Return the quantiles of outcomes and traits."""
    return {
        "outcomes": quantiles(population.outcomes, OUTCOMES),
        "traits": quantiles(population.traits, TRAITS),
    }


def _values(values: Floats) -> Floats:
    return np.quantile(values, QUANTILES) if values.size else np.zeros(0)


def _cells(values: Floats, item: Shown) -> list[str]:
    texts = [f"{item.factor * value:.{item.digits}f}" for value in _values(values).tolist()]
    return [text.removeprefix("-") if float(text) == 0.0 else text for text in texts] or ["-"] * len(QUANTILES)
