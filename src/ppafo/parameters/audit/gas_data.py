"""Do molar mass and heat capacity ratio belong to the gas that the set names?"""

from collections.abc import Iterator

from ppafo.model.gas import SPECIES
from ppafo.parameters.audit.evidence import Evidence
from ppafo.parameters.audit.finding import Finding, Side

_TOLERANCE = 0.02


def check(evidence: Evidence) -> Iterator[Finding]:
    """Yield an error for each gas constant that is more than 2 % off the named gas."""
    name = evidence.text("gas.species")
    if name is None:
        return
    species = SPECIES.get(name)
    if species is None:
        yield _unknown(evidence, name)
        return
    tabulated = {"gas.molar_mass": species.molar_mass, "gas.heat_capacity_ratio": species.heat_capacity_ratio}
    for path, expected in tabulated.items():
        value = evidence.number(path)
        if value is not None and abs(value / expected - 1.0) > _TOLERANCE:
            yield _differs(evidence, path, value, expected, species.source)


def _unknown(evidence: Evidence, name: str) -> Finding:
    return Finding(
        id="gas-species",
        severity="error",
        title=f"no data for the gas '{name}'",
        values=evidence.values_of("gas.species"),
        sides=(),
        paragraph=f"The gas '{name}' is not one of {', '.join(SPECIES)}; name one of these.",
    )


def _differs(evidence: Evidence, path: str, value: float, expected: float, source: str) -> Finding:
    unit = evidence.declared[path].unit
    return Finding(
        id=path.replace(".", "-").replace("_", "-"),
        severity="error",
        title=f"{path} is not that of the named gas",
        values=evidence.values_of("gas.species", path),
        sides=(Side("in the set", value, unit), Side("of the gas", expected, unit)),
        paragraph=(
            f"{path} is {evidence.in_set_unit(path, value)}, but {evidence.text('gas.species')} has "
            f"{evidence.in_set_unit(path, expected)} ({source}). Reconciled by that value or by naming the gas in use."
        ),
    )
