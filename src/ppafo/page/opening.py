"""Initial state of a page, computed by its programs: effect of each setting, and first panel.

For bundled scenarios the package stores it in ``opening.json``, written by ``scripts/page_tables.py``. For others it is
computed when the page is made.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ppafo.engine.cache.texts import kept_bytes
from ppafo.engine.channels import TRACED
from ppafo.errors import ScenarioError
from ppafo.model.controlled import CONTROLLED
from ppafo.page.wasm import WasmModule
from ppafo.page.words import stored_data
from ppafo.signals.recording import Floats
from ppafo.simulation.scenario import Scenario

MOST_FIRST = 12
_STORED = "opening.json"
LEAST_CHANGE = 1e-3
"""Relative change of a result [-] below which the effect of a setting is invisible."""
_STEP = 0.2
"""Change of a setting up and down, relative to its value (gauge value for a pressure) [-]."""
_MOST_POINTS = 300
_NATURE = ("gas.", "gas_model.", "flow.", "run.", "sensors.seed", "supply.atmospheric_pressure")
"""Prefixes of settings without a first slider: physical constants, step and duration of a run."""
_RANKED = ("published", "task", "changed", "identified", "fitted", "datasheet", "derived", "assumed", "default")
"""Provenances in order of preference, for the choice between settings of equal effect."""


def opening_of(
    scenario: Scenario, module: WasmModule, changes: Mapping[str, float], claims: Sequence[str]
) -> dict[str, Any]:
    """Return the initial state of a page: ``changes`` by setting, and ``courses`` of the first panel.

    A change is a list of fractions: relative change of each claim, and change divided by the span of the first panel.
    """
    key = _key(module, changes, claims)
    stored = stored_data(_STORED).get(scenario.name, {})
    if stored.get("key") == key:
        return dict(stored)
    numbers = [[entry["key"], entry["value"]] for entry in module.description["settings"]]
    ingredients = json.dumps([key, hashlib.sha256(module.wasm).hexdigest(), numbers])
    content = kept_bytes(
        "opening", ingredients, lambda: json.dumps(computed_opening(scenario, module, changes, claims)).encode()
    )
    opening: dict[str, Any] = json.loads(content)
    return opening


def opening_like(module: WasmModule) -> dict[str, Any]:
    """Return the stored initial state of the bundled scenario with most settings in common, without a run."""
    keys = {entry["key"] for entry in module.description["settings"]}
    stored = stored_data(_STORED)
    of_same_name = stored.get(module.description["name"])
    return dict(of_same_name or max(stored.values(), key=lambda opening: len(keys & set(opening["changes"]))))


def _key(module: WasmModule, changes: Mapping[str, float], claims: Sequence[str]) -> str:
    """Return the hash of a scenario's file, overrides and changes on a page."""
    content = [module.description["document"], module.description["overrides"], sorted(changes.items()), list(claims)]
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()[:32]


def computed_opening(
    scenario: Scenario, module: WasmModule, initial: Mapping[str, float], claims: Sequence[str]
) -> dict[str, Any]:
    """Compute the initial state of a page by runs with initial and changed settings."""
    from ppafo.simulation.ensemble import run_ensemble  # a report computes nothing

    known = [metric["name"] for metric in module.description["metrics"]]
    all_claims, claims = claims, [name for name in claims if name in known]
    channels = [channel["name"] for channel in module.description["channels"]]
    # The first panel shows what is controlled, else the motion of the vane.
    followed = next((kind for kind in CONTROLLED.values() if kind.reference in channels), None)
    lead = "angle" if followed is None else followed.name if followed.name in TRACED else "pressure_1"

    def runs(columns: Mapping[str, Floats], bands: Sequence[str]) -> Any:
        count = max((len(column) for column in columns.values()), default=1)
        usual = {path: np.full(count, value) for path, value in initial.items()}
        varied_columns = {**usual, **columns} or {"run.duration": np.full(count, scenario.run.duration)}
        return run_ensemble(scenario, varied_columns, claims, bands)

    # A difference of pressures is no channel: its reference would be no level beside the one that is shown.
    references = () if followed is None or lead != followed.name else (followed.reference,)
    channels_of_panel = [lead, *references]
    base = runs({}, channels_of_panel)
    usual = [float(base.metrics[name][0]) for name in claims]
    course = base.traces[lead][:, 0]
    span = float(np.ptp(course)) if np.isfinite(course).all() else 0.0
    changes, atmosphere = {}, scenario.device.supply.atmospheric_pressure
    for entry in module.description["settings"]:
        value = initial.get(entry["key"], entry["value"])
        size = _STEP * abs(value - (atmosphere if entry["unit"] == "Pa_a" else 0.0))
        low = value - size if entry["minimum"] is None else max(entry["minimum"], value - size)
        high = value + size if entry["maximum"] is None else min(entry["maximum"], value + size)
        if entry["key"].startswith(_NATURE) or entry["kept"] == "zero" or not low < high:
            continue
        try:
            outcomes = runs({entry["key"]: np.array([low, high])}, (lead,))
        except ScenarioError:
            continue  # what an ensemble does not vary, such as a time that others divide, is not a first slider
        moved = [_share(outcomes.metrics[name] - value, abs(value)) for name, value in zip(claims, usual, strict=True)]
        # Runs that failed, or whose duration is another, have no course to compare.
        varied = outcomes.traces[lead]
        apart = np.sqrt(np.mean((varied - course[:, None]) ** 2, axis=0)) if len(varied) == len(course) else np.zeros(0)
        if max(all_changes := [*moved, _share(apart, span)]) > LEAST_CHANGE:
            changes[entry["key"]] = all_changes
    # As many points as a picture of some hundred pixels shows.
    thin = slice(None, None, max(1, len(base.times) // _MOST_POINTS))
    return {
        "key": _key(module, initial, all_claims),
        "changes": changes,
        "times": _short(base.times[thin]),
        "courses": {name: _short(base.traces[name][thin, 0]) for name in channels_of_panel},
    }


def _short(values: Floats) -> list[float | None]:
    """Round values to four digits for plotting; None for samples of a failed run."""
    return [float(f"{value:.4g}") if np.isfinite(value) else None for value in values.tolist()]


def _share(change: Floats, of: float) -> float:
    sizes = np.abs(change[np.isfinite(change)])
    return float(f"{sizes.max() / of:.3g}") if of > 0.0 and sizes.size else 0.0


def first_settings(openings: Sequence[Mapping[str, Any]], programs: Sequence[Mapping[str, Any]]) -> list[str]:
    """Return the keys of up to twelve settings with the largest effects over all configurations."""
    origins = {setting["key"]: setting["origin"] for program in programs for setting in program["settings"]}
    rank = {origin: index for index, origin in enumerate(_RANKED)}
    largest: dict[str, float] = {}
    for opening in openings:
        # Two settings with one effect to the last digit are one slider: the better known comes first.
        key_of_effect: dict[tuple[float, ...], str] = {}
        for key, change in sorted(
            opening["changes"].items(), key=lambda change_of_key: rank.get(origins.get(change_of_key[0], ""), 99)
        ):
            if key in origins and key_of_effect.setdefault(tuple(change), key) == key:
                largest[key] = max(largest.get(key, 0.0), *change)
    # Where nothing is known, as of a run that fails, the settings come in the order of the program.
    ranked = sorted(largest, key=lambda key: (-largest[key], key)) or [
        key for key in origins if not key.startswith(_NATURE)
    ]
    return ranked[:MOST_FIRST]
