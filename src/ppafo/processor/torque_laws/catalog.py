"""Catalogue of integer controllers by name in scenarios."""

from ppafo.processor.torque_laws.law import FixedLaw
from ppafo.processor.torque_laws.on_off import DEAD_ZONE, ON_OFF
from ppafo.processor.torque_laws.pid import PID

FIXED_LAWS: dict[str, FixedLaw] = {law.kind.name: law for law in (PID, ON_OFF, DEAD_ZONE)}
