"""Numbers of a parameter set in the units that its file has for them."""

from ppafo.identification.new_set import fitting_unit
from ppafo.parameters.parameter_set import ParameterSet, atmospheric_pressure
from ppafo.units import from_si


def in_set_unit(number: float, path: str, si_unit: str, parameter_set: ParameterSet) -> tuple[float, str]:
    """Return a number of a path in the unit that the set has for it, and this unit; as it is where the set has none."""
    entry, quantity = parameter_set.numbers.get(path), parameter_set.declared().get(path)
    if entry is None or quantity is None or entry.unit == si_unit:
        return number, si_unit
    si = fitting_unit(entry.unit, quantity)
    return from_si(number, entry.unit, si, atmospheric_pressure(parameter_set)), entry.unit
