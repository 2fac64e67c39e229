"""Makes and frees many instances of a unit in FMPy, and prints by how much the process grows.

ppafo export fmu torque-task-proportional --out out/unit
python scripts/instances.py out/unit/torque_task_proportional.fmu 100000
"""

import resource
import shutil
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

STEP = 1.0e-3
"""From one communication point to the next [s]."""
WARM = 1000
"""Instances before the first measurement: by then the process has what it needs once."""


class Instance:
    """An instance that runs from 0 s, with parameters by name; ``events`` uses the event mode of FMI 3."""

    def __init__(self, unit: str, given: Mapping[str, float] | None = None, events: bool = False) -> None:
        import fmpy

        self.description = fmpy.read_model_description(unit)
        self.files = fmpy.extract(unit)
        self.numbers = {item.name: item.valueReference for item in self.description.modelVariables}
        further = {"event_mode_used": True, "early_return_allowed": True} if events else {}
        self.slave: Any = fmpy.instantiate_fmu(self.files, self.description, fmi_type="CoSimulation", **further)
        self.is_of_fmi_3 = self.description.fmiVersion == "3.0"
        self.time = 0.0
        begin(self.slave)
        for name, value in (given or {}).items():
            self.set(name, value)
        self.slave.exitInitializationMode()

    def get(self, name: str) -> float:
        """A variable in SI units."""
        read = self.slave.getFloat64 if self.is_of_fmi_3 else self.slave.getReal
        return float(read([self.numbers[name]])[0])

    def set(self, name: str, value: float) -> None:
        """Set a variable in SI units."""
        write = self.slave.setFloat64 if self.is_of_fmi_3 else self.slave.setReal
        write([self.numbers[name]], [value])

    def go_to(self, time: float) -> Any:
        """Go to a time [s] in one step; what FMPy returns of it."""
        found = self.slave.doStep(self.time, time - self.time)
        self.time = time
        return found

    def kept(self) -> bytes:
        """The state, written out."""
        slave = self.slave
        state = slave.getFMUState() if self.is_of_fmi_3 else slave.getFMUstate()
        found = slave.serializeFMUState(state) if self.is_of_fmi_3 else slave.serializeFMUstate(state)
        self.drop(state)
        return bytes(found)

    def restored(self, written: bytes) -> Any:
        """Take a state that was written out; the state in the memory of the unit, to be dropped."""
        slave = self.slave
        state = slave.deserializeFMUState(written) if self.is_of_fmi_3 else slave.deSerializeFMUstate(written)
        (slave.setFMUState if self.is_of_fmi_3 else slave.setFMUstate)(state)
        return state

    def drop(self, state: Any) -> None:
        """Free a state."""
        (self.slave.freeFMUState if self.is_of_fmi_3 else self.slave.freeFMUstate)(state)

    def course(self, first: float, last: float) -> list[float]:
        """Torque and pressures at every step from one time [s] to another."""
        self.time = first
        found = []
        for number in range(round((last - first) / STEP)):
            self.go_to(first + (number + 1) * STEP)
            found += [self.get(name) for name in ("torque", "pressure_1", "pressure_2", "supplied_mass")]
        return found

    def close(self) -> None:
        """Free the instance."""
        self.slave.terminate()
        self.slave.freeInstance()
        shutil.rmtree(self.files, ignore_errors=True)


def begin(slave: Any) -> None:
    """Let an instance be prepared, from 0 s on."""
    if hasattr(slave, "setupExperiment"):
        slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()


def growth_of(unit: str, count: int, warm: int = WARM) -> int:
    """Bytes by which the process grows while ``count`` instances are made, run for two steps and freed."""
    import fmpy

    described = fmpy.read_model_description(unit)
    files = fmpy.extract(unit)
    slave = fmpy.instantiate_fmu(files, described, fmi_type="CoSimulation")
    before = 0
    for number in range(warm + count):
        if number == warm:
            before = _resident()
        again(slave)
    grown = _resident() - before
    slave.freeInstance()
    shutil.rmtree(files, ignore_errors=True)
    return grown


def again(slave: Any) -> None:
    """Free an instance, make it anew from the same library, run it for two steps and keep its state between."""
    is_of_fmi_3 = hasattr(slave, "fmi3FreeInstance")
    (slave.fmi3FreeInstance if is_of_fmi_3 else slave.fmi2FreeInstance)(slave.component)
    slave.instantiate()
    begin(slave)
    slave.exitInitializationMode()
    slave.doStep(0.0, STEP)
    if is_of_fmi_3:
        slave.freeFMUState(slave.getFMUState())
    else:
        slave.freeFMUstate(slave.getFMUstate())
    slave.doStep(STEP, STEP)


def _resident() -> int:
    """Memory of this process that is in use now [bytes]."""
    pages = int(Path("/proc/self/statm").read_text(encoding="utf-8").split()[1])
    return pages * resource.getpagesize()


if __name__ == "__main__":
    chosen, wanted = sys.argv[1], int(sys.argv[2])
    begun = time.perf_counter()
    print(f"{wanted:,} instances: {growth_of(chosen, wanted):,} bytes more, {time.perf_counter() - begun:.0f} s")
