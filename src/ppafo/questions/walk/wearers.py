"""The answer of many wearers: quantiles of what they get and of what they are."""

import platform
from collections.abc import Mapping
from typing import Any

import numpy as np

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.display_units import display_value, title_with_unit
from ppafo.questions.walk.wearers_volumes import wearers_volumes_data, wearers_volumes_sections
from ppafo.signals.recording import Floats
from ppafo.simulation.document import UNITS
from ppafo.version import __version__
from ppafo.walking.anthropometry import CORRELATION, MASS_VARIATION, MAXIMUM_DEVIATIONS, STATURE_VARIATION
from ppafo.walking.document import walk_document
from ppafo.walking.figures.wearers import SHOWN, population_figure
from ppafo.walking.gait_subject import person_remarks
from ppafo.walking.person import START_VARIATION, THRESHOLD_VARIATION
from ppafo.walking.population import OUTCOMES, TRAITS, Number, Population

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
FORMAT = "ppafo wearers"
SCHEMA_VERSION = 1
_CAPTION = (
    "What the wearers get, with quantiles, and how it depends on their properties. Dot: the wearer of the "
    "configuration."
)


def wearers_answer(population: Population, volumes: Mapping[str, Population]) -> Answer:
    """Return the answer of many wearers; no figure where every walk diverged."""
    configuration = population.scenario
    tables = {**population.outcomes, **population.traits}
    head = (Column(""), *(Column(f"{100.0 * fraction:.0f} %") for fraction in QUANTILES))
    rows = [
        (title_with_unit(title, quantity), *_cells(tables[name], quantity, digits))
        for name, (title, quantity, digits) in SHOWN.items()
    ]
    figure = Figure("wearers", _CAPTION, lambda: population_figure(population))
    stopped = f"safe state: the controllers of {population.vented} wearers vented both chambers permanently"
    paused = (
        f"less help: the controllers of {population.paused} wearers lifted the foot only, or paused, for some strides"
    )
    remarks = [
        *person_remarks(configuration),
        *[stopped] * bool(population.vented),
        *[paused] * bool(population.paused),
    ]
    remarks += [population.message] * bool(population.diverged)
    return Answer(
        name="wearers",
        kicker="Walks of many wearers",
        title=f"{population.count} wearers with {configuration.name}",
        lead=(f"{configuration.name}: {population.count} wearers, {population.minutes:.3g} min each",),
        sections=(
            Section(table=Table(head, tuple(rows)), remarks=tuple(remarks)),
            *wearers_volumes_sections(volumes),
            *((Section("The wearers", figure=figure, is_detail=True),) if population.count else ()),
        ),
        data=_data(population) | {"volumes": wearers_volumes_data(volumes)},
        passed=not population.diverged,
        files={"wearers.csv": lambda: wearers_csv(population)},
        command="walk",
    )


def _cells(values: Floats, quantity: str, digits: int) -> list[str | None]:
    texts = [f"{display_value(value, quantity):.{digits}f}" for value in _values(values).tolist()]
    return [text.removeprefix("-") if float(text) == 0.0 else text for text in texts] or [None] * len(QUANTILES)


def _data(population: Population) -> dict[str, Any]:
    configuration = population.scenario
    return {
        "format": FORMAT,
        "schema_version": SCHEMA_VERSION,
        "units": UNITS,
        "status": {"kind": "diverged" if population.diverged else "completed", "message": population.message},
        "wearers": population.count,
        "diverged": population.diverged,
        "vented": population.vented,
        "paused": population.paused,
        "minutes": population.minutes,
        "seed": population.seed,
        "varied": {
            "body_mass": MASS_VARIATION,
            "stature": STATURE_VARIATION,
            "correlation": CORRELATION,
            "thresholds": THRESHOLD_VARIATION,
            "push_off_start": START_VARIATION,
            "gait": "stride time, stance share and series coefficients by the deviations of the gait",
            "most_deviations": MAXIMUM_DEVIATIONS,
        },
        **all_quantiles(population),
        "versions": {"ppafo": __version__, "python": platform.python_version(), "numpy": np.__version__},
        "configuration": walk_document(configuration),
    }


def wearers_csv(population: Population) -> bytes:
    """Return one line for each wearer, in SI units."""
    columns = {f"{name} [{item.unit}]": population.traits[name] for name, item in TRAITS.items()}
    columns |= {f"{name} [{item.unit}]": population.outcomes[name] for name, item in OUTCOMES.items()}
    lines = ["# simulated: a model's own output, not measured", ",".join(columns)]
    rows = zip(*(column.tolist() for column in columns.values()), strict=True)
    return ("\n".join([*lines, *(",".join(map(repr, row)) for row in rows)]) + "\n").encode()


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
