"""Plant faults and shut-off valve of a walking device, in an integration step and at a sample of the controller."""

from typing import Any

from ppafo.engine.groups import Groups, given, kept
from ppafo.engine.plain_python import refusal
from ppafo.engine.program import Program
from ppafo.engine.step.lane import Lane, Now
from ppafo.model import plant_faults, shut_off
from ppafo.model.helping import STOPPED
from ppafo.model.plant import PlantParameters
from ppafo.model.plant_faults import PlantFaults
from ppafo.model.shut_off import ShutOff, Unpowered
from ppafo.model.valves.kind import VENT


def groups(parts: Program) -> Groups:
    """Groups for faults and shut-off valve: parameters, and the state of the shut-off valve."""
    port = parts.valve.port
    if port not in plant_faults.FAILED_PORTS:
        known = " or ".join(row.__name__ for row in plant_faults.FAILED_PORTS)
        code = parts.valve.connect.__code__
        raise refusal(
            code.co_filename,
            code.co_firstlineno,
            f"plant faults need a valve whose port is {known}, not {port.__name__}",
        )
    return {"plant_faults": given(PlantFaults), "shut_off": given(ShutOff), "unpowered": kept(Unpowered)}


def failed_plant(parts: Program, lane: Lane, time: float) -> PlantParameters:
    """Return the plant with the additional leakage due to faults at a time [s]."""
    return plant_faults.failed_plant(lane.plant, lane.plant_faults, time)


def failed_ports(
    parts: Program, lane: Lane, source: PlantParameters, port_1: Any, port_2: Any, time: float
) -> tuple[Any, Any]:
    """Return the valve ports of both chambers, modified by the faults active at a time [s]."""
    return plant_faults.FAILED_PORTS[parts.valve.port](
        source, lane.plant_faults, lane.shut_off, lane.unpowered, port_1, port_2, time
    )


def decide(parts: Program, lane: Lane, now: Now, ordered: float, after: Any) -> None:
    """Apply the ``ordered`` command and the new controller state ``after``, subject to faults.

    The controller may miss a sample or lose power, and a valve may respond late to a command. Without power, the
    controller returns to its initial state.
    """
    time, period = now.step * lane.timing.step, lane.timing.period
    brown_out = plant_faults.is_in_brown_out(lane.plant_faults, time)
    runs = plant_faults.runs_at(lane.plant_faults, time, period, int(lane.sensors.seed), now.sample)
    takes = plant_faults.is_due(lane.plant_faults.slow_time, lane.plant_faults.slow_delay, time, period)
    stopped = (after.safety.level if parts.has_level_of_help else 0.0) >= STOPPED
    lane.unpowered = shut_off.next_unpowered(lane.shut_off, lane.unpowered, runs, stopped, brown_out, period)
    vents = brown_out | shut_off.is_silenced(lane.shut_off, lane.unpowered)
    command = VENT if vents else (ordered if runs & takes else lane.result.command)
    lane.result = lane.result._replace(command=command)
    lane.controller_state = after if runs else lane.controller_state
    lane.controller_state = parts.initial_controller_state if brown_out else lane.controller_state
