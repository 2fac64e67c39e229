"""The paper's numbers as the printed parameter set has them, and their printed digits."""

from dataclasses import dataclass

from ppafo.errors import ParameterError
from ppafo.parameters import ParameterSet, load_parameter_set
from ppafo.parameters.audit.evidence import Evidence, Interval
from ppafo.parameters.device import Gas

PRINTED_SET = "ppafo2011-printed"


@dataclass(frozen=True, slots=True)
class Printed:
    """Read access to the printed set; every requested value has to be there."""

    parameter_set: ParameterSet
    evidence: Evidence

    def number(self, path: str) -> float:
        """Return the number as printed, in its printed unit."""
        return self._entry_of(path)[0]

    def unit(self, path: str) -> str:
        """Return the printed unit, ``-`` for a plain number."""
        return self._entry_of(path)[1] or "-"

    def source(self, path: str) -> str:
        """Return where the paper prints it."""
        self._entry_of(path)
        return self.parameter_set.numbers[path].source

    def quotation(self, path: str) -> str:
        """Return number and unit for a sentence, for example ``8.4 g m^2``."""
        number, unit = self._entry_of(path)
        return f"{number:g} {unit}".rstrip()

    def in_si(self, path: str) -> float:
        """Return the value in SI units."""
        value = self.evidence.number(path)
        if value is None:
            raise self._lack(path)
        return value

    def in_printed_unit(self, path: str, value: float) -> float:
        """Return an SI value in the unit in which the paper prints the quantity at a path (a unit without offset)."""
        return value * self.number(path) / self.in_si(path)

    def range(self, path: str) -> Interval:
        """Return the range in SI that the printed digits leave open, without sign."""
        interval = self.evidence.magnitude(path)
        if interval is None:
            raise self._lack(path)
        return interval

    def gas(self) -> Gas:
        """Return the printed gas."""
        gas = self.evidence.gas()
        if gas is None:
            raise self._lack("gas")
        return gas

    def _entry_of(self, path: str) -> tuple[float, str]:
        entry = self.parameter_set.numbers.get(path)
        if entry is None:
            raise self._lack(path)
        return entry.value, entry.unit

    def _lack(self, path: str) -> ParameterError:
        return ParameterError(f"{self.parameter_set.file}: '{path}' is missing; the claims of the paper need it")


def load_printed() -> Printed:
    """Return the paper's numbers, exactly as printed."""
    parameter_set = load_parameter_set(PRINTED_SET)
    return Printed(parameter_set, Evidence(parameter_set, parameter_set.declarations()))
