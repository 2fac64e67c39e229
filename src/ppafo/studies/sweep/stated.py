"""Uncertainty as the parameter set of a scenario states it, for example one that ``ppafo identify`` has written."""

from pathlib import Path

from ppafo.errors import UnitError
from ppafo.parameters import apply_overrides, load_parameter_set
from ppafo.parameters.parameter_set import atmospheric_pressure, entry_in_si
from ppafo.parameters.provenance import Entry
from ppafo.simulation.building import set_name
from ppafo.simulation.overriding import is_of_device, split_override
from ppafo.simulation.scenario import Scenario
from ppafo.studies.sweep.paths import VariedPath
from ppafo.studies.sweep.sampling.distributions import NormalAround

DEVIATIONS_IN_HALF_WIDTH = 1.959963984540054
"""Standard deviations of a normal distribution in the half width of its 95 % interval."""

_DIFFERENCES = {"psi_g": "psi_d", "psi_a": "psi_d", "degC": "K", "°C": "K"}


def stated_normal(place: VariedPath, scenario: Scenario) -> NormalAround:
    """Return the distribution of a path; UnitError where the set of the scenario states no uncertainty for it."""
    entry, mean = _entry(place.path, scenario)
    if entry is None or not entry.uncertainty:
        why = "was changed by an override" if entry is not None and entry.source == "override" else "has none"
        raise UnitError(
            f"kind 'stated' needs an uncertainty in the parameter set '{scenario.origin.parameter_set}', and it {why}"
        )
    unit = _DIFFERENCES.get(entry.unit, entry.unit)
    if unit.endswith(("_g", "_a")):
        unit = f"{unit[:-2]}_d"
    half_width = place.distance(f"{entry.uncertainty!r} {unit}".strip())
    return NormalAround(mean, half_width / DEVIATIONS_IN_HALF_WIDTH)


def _entry(path: str, scenario: Scenario) -> tuple[Entry | None, float]:
    """Return what the set, with the overrides of the scenario, says of a path, and the value in SI."""
    origin = scenario.origin
    folder = Path(origin.file).parent if origin.file is not None else Path()
    own = [text for text in origin.overrides if is_of_device(split_override(text)[0])]
    parameters = load_parameter_set(set_name(origin.parameter_set, folder))
    for given in (origin.content["device"].get("overrides", ()), own):
        parameters = apply_overrides(parameters, given, origin.valve)
    inside = f"valves.{origin.valve}.{path.removeprefix('valve.')}" if path.startswith("valve.") else path
    entry = parameters.numbers.get(inside)
    if entry is None:
        return None, 0.0
    return entry, entry_in_si(entry, parameters.declared()[inside], atmospheric_pressure(parameters))
