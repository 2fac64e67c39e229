"""A load at the joint, written once: a peer program has the same motion, and all backends have the same bits."""

import math
from typing import Any

import numpy as np
import pytest

from ppafo.running import simulate
from ppafo.simulation.loading import load_scenario
from tests.reference import bench as peer

FREE = ("motion.kind=free", "run.duration=0.4 s")


def settings(drag: float, stiffness: float, weight: float) -> tuple[str, ...]:
    name = "effects.joint_load"
    values = (("drag", drag, "N m s^2/rad^2"), ("stiffness", stiffness, "N m/rad"), ("weight", weight, "N m"))
    return tuple(f"{name}.{key}={value} {unit}" for key, value, unit in values)


def bench_with(drag: float, stiffness: float, weight: float) -> type[peer.Bench]:
    """The equations of ``tests/reference/bench.py``, which shares no code with the package, with the load."""

    class Loaded(peer.Bench):
        def drive(self, y: Any) -> float:
            return super().drive(y) - stiffness * float(y[0] - 0.5 * math.pi) + weight * math.sin(y[0])

        def between(self, inside: float, outside: float, share: float) -> float:
            # The supplies of the set have check valves.
            is_shut = outside in (self.rig.source_1, self.rig.source_2) and inside > outside
            return 0.0 if is_shut else super().between(inside, outside, share)

        def rates(self, y: Any, way: float, opening: float) -> list[float]:
            found = super().rates(y, way, opening)
            found[1] -= drag * y[1] * abs(y[1]) / self.rig.inertia if way != 0.0 else 0.0
            return found

    return Loaded


@pytest.mark.parametrize(
    "load", [(0.05, 0.0, 0.0), (0.5, 0.0, 0.0), (0.0, 8.0, 0.0), (0.0, 0.0, 4.0), (0.05, 5.0, 3.0)]
)
def test_a_vane_with_a_load_moves_as_by_a_peer_program(
    load: tuple[float, float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    recording = simulate(load_scenario("step-response", (*FREE, *settings(*load)))).recording
    monkeypatch.setattr(peer, "Bench", bench_with(*load))
    plain = load_scenario("step-response", FREE)
    angle, *pressures = peer.bench(plain, [(0.0, 1.0)], np.asarray(recording.time))
    assert np.abs(recording["angle"] - angle).max() < 1.0e-4 * math.radians(110.0)
    for number, pressure in enumerate(pressures, 1):
        assert np.abs(recording[f"pressure_{number}"] - pressure).max() < 1.0e-4 * plain.device.supply.pressure


def test_a_drag_limits_the_speed_to_where_it_takes_the_whole_torque() -> None:
    result = simulate(load_scenario("step-response", (*FREE, *settings(0.05, 0.0, 0.0))))
    # sqrt(torque constant times 55 psi over the drag): the actuator can drive no faster.
    bound = math.sqrt(1.451e-5 * 55.0 * 6894.757 / 0.05)
    assert 0.9 * bound < result.metrics["largest_speed"].value < bound


def test_the_torque_that_prescribes_a_motion_has_the_load_in_it() -> None:
    texts = ("run.duration=0.3 s",)
    without, loaded = (
        simulate(load_scenario("torque-task-moving-ankle", (*texts, *more))).recording
        for more in ((), settings(0.05, 5.0, 0.0))
    )
    angle = without["angle"]
    rate = without["angular_velocity"]
    taken = 0.05 * rate * np.abs(rate) + 5.0 * (angle - 0.5 * math.pi)
    assert without["external_torque"] - loaded["external_torque"] == pytest.approx(taken, abs=1e-12)
