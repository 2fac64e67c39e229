"""Bench procedures: each fits one physical law to recordings, with the common least-squares estimator."""

from ppafo.identification.bench.free_decay import free_decay
from ppafo.identification.bench.law import BenchResult
from ppafo.identification.bench.open_valve_flow import open_valve_flow
from ppafo.identification.bench.static_torque import static_torque
from ppafo.identification.bench.valve_map import valve_map
from ppafo.identification.bench.vane_leak import vane_leak
from ppafo.identification.tolerances import Tolerances

__all__ = ["BenchResult", "Tolerances", "free_decay", "open_valve_flow", "static_torque", "valve_map", "vane_leak"]
