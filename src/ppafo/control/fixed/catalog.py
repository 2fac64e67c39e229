"""Controllers that have an integer form. To add one here: a module and one line."""

from ppafo.control.fixed import on_off, pid
from ppafo.control.fixed.kind import FixedLaw

FIXED_LAWS: dict[str, FixedLaw] = {law.name: law for law in (pid.LAW, on_off.ON_OFF, on_off.DEAD_ZONE)}
