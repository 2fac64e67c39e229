"""The checks, in the order of the report. To add one: a module beside this file and one line here."""

from collections.abc import Callable, Iterator

from ppafo.parameters.audit import (
    choked_flow,
    dimensions,
    filling,
    flow,
    gas_data,
    ideal_gas,
    inertia,
    orifices,
    published_torque,
    ranges,
    sonic_flow,
    torque_ceiling,
    virtual_work,
    volumes,
)
from ppafo.parameters.audit.evidence import Evidence
from ppafo.parameters.audit.finding import Finding

CHECKS: dict[str, Callable[[Evidence], Iterator[Finding]]] = {
    "dimensions": dimensions.check,
    "ranges": ranges.check,
    "gas data": gas_data.check,
    "orifices": orifices.check,
    "choked flow": choked_flow.check,
    "flow": flow.check,
    "sonic flow": sonic_flow.check,
    "inertia": inertia.check,
    "virtual work": virtual_work.check,
    "volumes": volumes.check,
    "filling": filling.check,
    "torque ceiling": torque_ceiling.check,
    "published torque": published_torque.check,
    "ideal gas": ideal_gas.check,
}
