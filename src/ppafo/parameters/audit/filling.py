"""Is the gas of one filling that was measured the gas that chamber 1 holds? Equations (3) and (4)."""

from collections.abc import Iterator

from ppafo.parameters.audit.evidence import Evidence, density_change
from ppafo.parameters.audit.finding import Finding, Side

_SUPPLY = "supply.pressure"
_VOLUME = ("actuator.volume_per_angle", "actuator.dead_volume_1")
_LEAST, _MOST = 0.6, 1.1
"""Fraction of the measured gas that a filling may hold: the rest leaks across the vane while the task lasts."""


def check(evidence: Evidence) -> Iterator[Finding]:
    """Yield what a filling in the middle of the range takes: a note where the measured gas can be that, else a warning.

    Silent where the set reports no gas of a single filling.
    """
    gas, supply, angles = evidence.gas(), evidence.number(_SUPPLY), evidence.angle_range()
    path = evidence.single_fill_gas()
    if gas is None or supply is None or supply <= evidence.atmosphere() or angles is None or path is None:
        return
    volume = evidence.chamber_1_volume(0.5 * (angles[1] + angles[3]))
    if volume is None or volume <= 0.0:
        return
    density, used = density_change(gas, supply - evidence.atmosphere()), evidence.number(path) or 0.0
    filled = density * volume
    agrees = _LEAST <= filled / used <= _MOST
    yield Finding(
        id="gas-of-one-filling",
        severity="note" if agrees else "warning",
        title=f"the measured gas of one filling {'can be' if agrees else 'is not'} what chamber 1 holds",
        values=evidence.values_of(*_VOLUME, path, _SUPPLY),
        sides=(
            Side("gas that fills chamber 1", filled, "kg"),
            Side("measured gas", used, "kg"),
            Side("volume of chamber 1 in the middle of the range", volume, "m^3"),
        ),
        paragraph=(
            f"In the middle of its range chamber 1 has {1e6 * volume:.3g} cm^3, dead volume included, and takes "
            f"{evidence.in_set_unit(path, filled)} of gas from atmosphere to supply; measured is "
            f"{evidence.in_set_unit(path, used)}, which also covers what leaks across the vane. How the volume is "
            f"divided into swept and dead volume makes no difference to this."
            + (
                ""
                if agrees
                else f" Reconciled by {1e6 * _LEAST * used / density:.3g} cm^3 or more, or by a longer task."
            )
        ),
    )
