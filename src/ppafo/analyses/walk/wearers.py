"""Report of a walk of many wearers: quantiles of outcomes and traits, as text, table and figure."""

from collections.abc import Mapping
from functools import partial
from typing import Any

import numpy as np

from ppafo.analyses.walk.document import ShownNumber, csv_of, number_texts, versions, walk_document
from ppafo.documents.json_text import fields_of
from ppafo.report.finding import Finding, Section, columns_of
from ppafo.signals.recording import Floats
from ppafo.simulation.numbers import changes_in
from ppafo.simulation.scenario import UNITS
from ppafo.units.shown import in_units
from ppafo.walking.figures.population import population_figure
from ppafo.walking.motion import person_remarks
from ppafo.walking.population import OUTCOMES, SHOWN, TRAITS, Population
from ppafo.walking.variation import (
    CORRELATION,
    MASS_VARIATION,
    MAXIMUM_DEVIATIONS,
    START_VARIATION,
    STATURE_VARIATION,
    THRESHOLD_VARIATION,
)

QUANTILES = (0.05, 0.25, 0.5, 0.75, 0.95)
"""Quantiles in the table of wearers, as fractions of the wearers."""
WEARERS_FORMAT = "ppafo wearers"
WEARERS_SCHEMA_VERSION = 1
_WEARERS_CAPTION = (
    "Metrics of the wearers, with quantiles, over the properties of the wearers. Dot: the wearer of the configuration."
)


@in_units(lambda population: population.scenario.device.shown)
def wearers_finding(population: Population) -> Finding[dict[str, Any]]:
    """Return the report of the walks of many wearers; it has no figure if all walks diverged."""
    configuration = population.scenario
    tables = {**population.outcomes, **population.traits}
    rows = []
    for name, (title, quantity, digits) in SHOWN.items():
        values = np.quantile(tables[name], QUANTILES).tolist() if tables[name].size else [None] * len(QUANTILES)
        rows.append(number_texts(ShownNumber(name=name, title=title, quantity=quantity, digits=digits), values))
    remarks = [*person_remarks(configuration)]
    if population.diverged:
        remarks.append(population.message)
    # One line for each wearer, in SI units.
    columns = {f"{name} [{unit}]": tables[name] for name, (unit, _) in {**TRAITS, **OUTCOMES}.items()}
    draw = partial(population_figure, population)
    figure = Section("The wearers", name="wearers", caption=_WEARERS_CAPTION, draw=draw, is_detail=True)
    return Finding(
        name="wearers",
        kicker="Walks of many wearers",
        title=f"{population.count} wearers with {configuration.name}",
        said=(f"{configuration.name}: {population.count} wearers, {population.minutes:.3g} min each",),
        parts=(
            Section(
                columns=columns_of(("", *(f"{100.0 * share:.0f} %" for share in QUANTILES)), rows), remarks=remarks
            ),
            *([figure] if population.count else []),
        ),
        found=wearers_data(population),
        passed=not population.diverged,
        files={"wearers.csv": partial(csv_of, columns)},
        command="walk",
        overrides=changes_in(configuration),
    )


def quantiles(table: Mapping[str, Floats], numbers: Mapping[str, tuple[str, str]]) -> dict[str, dict[str, object]]:
    """Return mean and quantiles over the wearers of every number in SI units, with unit and meaning."""
    return {
        name: {
            "unit": unit,
            "summary": summary,
            "mean": float(table[name].mean()) if table[name].size else None,
            "quantiles": dict(zip(map(str, QUANTILES), np.quantile(table[name], QUANTILES).tolist(), strict=True))
            if table[name].size
            else {},
        }
        for name, (unit, summary) in numbers.items()
    }


def wearers_data(population: Population) -> dict[str, Any]:
    """Return the quantiles of outcomes and traits over the wearers as plain data in SI units."""
    return {
        "format": WEARERS_FORMAT,
        "schema_version": WEARERS_SCHEMA_VERSION,
        "units": UNITS,
        "status": {"kind": "diverged" if population.diverged else "completed", "message": population.message},
        "wearers": population.count,
        **fields_of(population, "diverged", "minutes", "seed"),
        "varied": {
            "body_mass": MASS_VARIATION,
            "stature": STATURE_VARIATION,
            "correlation": CORRELATION,
            "thresholds": THRESHOLD_VARIATION,
            "push_off_start": START_VARIATION,
            "gait": "stride time, stance share and series coefficients by the deviations of the gait",
            "most_deviations": MAXIMUM_DEVIATIONS,
        },
        "outcomes": quantiles(population.outcomes, OUTCOMES),
        "traits": quantiles(population.traits, TRAITS),
        "versions": versions(),
        "configuration": walk_document(population.scenario),
    }
