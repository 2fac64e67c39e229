"""Is every value within the limits of its declaration, which any device keeps?"""

from collections.abc import Iterator

from ppafo.model.declaration import Quantity
from ppafo.parameters.audit.evidence import Evidence
from ppafo.parameters.audit.finding import Finding, Side
from ppafo.parameters.declaration import is_within
from ppafo.parameters.parameter_set import number_in_si, number_text


def check(evidence: Evidence) -> Iterator[Finding]:
    """Yield an error for each value that no device can have."""
    for path, entry in evidence.parameter_set.numbers.items():
        quantity, value = evidence.declared[path], number_in_si(evidence.parameter_set, path)
        if value is None or is_within(value, quantity):
            continue
        yield Finding(
            id=f"range-of-{path.replace('.', '-').replace('_', '-')}",
            severity="error",
            title=f"{path} is out of range",
            values=evidence.values_of(path),
            sides=(Side("in the set", value, quantity.unit), *_limits(quantity)),
            paragraph=(
                f"{path} = {number_text(entry)}: {quantity.summary} must lie between {quantity.minimum:g} and "
                f"{quantity.maximum:g} {quantity.unit}".rstrip()
                + ". Reconciled by a value in that range."
            ),
        )


def _limits(quantity: Quantity) -> tuple[Side, Side]:
    return Side("lower limit", quantity.minimum, quantity.unit), Side("upper limit", quantity.maximum, quantity.unit)
