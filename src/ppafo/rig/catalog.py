"""The experiments of the rig. To add one: a function ``Request -> Outcome`` and one line here."""

from collections.abc import Callable
from dataclasses import dataclass

from ppafo.rig.bench import dynamic, flow, static_torque
from ppafo.rig.request import Outcome, Request


@dataclass(frozen=True, slots=True)
class Experiment:
    """An experiment: name, what is done, and the function that does it."""

    name: str
    summary: str
    record: Callable[[Request], Outcome]


EXPERIMENTS: dict[str, Experiment] = {
    item.name: item
    for item in (
        Experiment("static-torque", "torque on a scale over pressure, three times up and down", static_torque.record),
        Experiment("free-decay", "angle after an impulse, chambers open to the room", dynamic.record_free_decay),
        Experiment("open-valve-flow", "flow of the open valve at many pressures", flow.record_open_valve),
        Experiment("vane-leak", "pressures of plugged chambers as gas leaks across the vane", dynamic.record_vane_leak),
        Experiment("vane-leak-steady", "flow that maintains the pressure in chamber 1", flow.record_steady_leak),
        Experiment("valve-map", "flow of the valve over its command, up and down", flow.record_valve_map),
        Experiment(
            "step-response", "figure 7: valve opened fully, vane from stop to stop", dynamic.record_step_response
        ),
        Experiment("torque-task", "figure 8: torque ramp and hold under control", dynamic.record_torque_task),
    )
}
