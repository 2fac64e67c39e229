"""What our numbers for other publications are computed by: a catalogue of named computations. One entry adds one."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import SimulationError
from ppafo.parameters import load_device
from ppafo.parameters.chamber_volumes import PRINTED_VOLUMES, ChamberVolumes, readings
from ppafo.questions.timing.solve import WEARERS, rms_of, timed_events, uneven_course
from ppafo.simulation.scenario import Scenario
from ppafo.walking.comparison import healthy_metrics
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import walk_of
from ppafo.walking.result import WalkResult, integral_of_a_stride
from ppafo.walking.walk import walk

CHAMBERS = "chambers"
"""Stands for the unit of an argument that names a reading of the chambers' volumes."""

MINUTES = 0.5
"""A walk without noise repeats itself stride by stride, so that longer ones say the same."""

PAIR, RECYCLING = "solenoid", "solenoid-recycling"
"""The walks that direct event control and recycling stand for."""

KEEPS_GAIT = "wearer.keeps_gait=1"
"""A nondisabled wearer: muscles keep the measured ankle."""

Values = Mapping[str, str | float]


@dataclass(frozen=True, slots=True)
class Computation:
    """How a number comes about: what it is, its SI unit, its arguments with their SI units, and the function."""

    summary: str
    unit: str
    arguments: Mapping[str, str]
    compute: Callable[[Values], float]


def chamber_names() -> tuple[str, ...]:
    """Return the names of the readings of the chambers' volumes."""
    return tuple(reading.name for reading in readings())


def _chambers(values: Values) -> ChamberVolumes:
    return next(reading for reading in readings() if reading.name == values["chambers"])


def _pressure(values: Values) -> float:
    return float(values["pressure"])


@lru_cache(maxsize=16)
def _walked(name: str, chambers: ChamberVolumes, overrides: tuple[str, ...]) -> WalkResult:
    """Return a shipped walk with some chambers; SimulationError where it does not reach its end with help."""
    configuration = load_walk(name, overrides)
    result = walk(replace(configuration, device=chambers.of(configuration.device)), MINUTES)
    if not (result.status.is_completed and result.is_helped):
        raise SimulationError(f"{name}: {result.status.message}; the claims need a walk with help in most strides")
    return result


def _nondisabled(name: str, values: Values) -> WalkResult:
    held = (f"valve.holding_time={values['holding_time']!r} s",) if name == RECYCLING else ()
    return _walked(name, _chambers(values), (KEEPS_GAIT, *held))


def _healthy_peak_moment(configuration: Scenario) -> float:
    moment = walk_of(configuration).gait.curve("ankle_moment").values_at(np.linspace(0.0, 1.0, 1001))
    return walk_of(configuration).wearer.body_mass * float(moment.max())


def _work_of_a_stride(result: WalkResult) -> float:
    """Return the net work [J] of the actuator torque on the ankle, mean over the strides with help."""
    return integral_of_a_stride(result, result.recording["torque"])


def held_torque(values: Values) -> float:
    """Torque [N m] that a gauge pressure holds at rest: torque constant times pressure. Equation (2)."""
    constant = load_device(PRINTED_VOLUMES).actuator.torque_constant
    return constant * (_pressure(values) - STANDARD_ATMOSPHERE)


def share_of_healthy_moment(values: Values) -> float:
    """Torque that a pressure holds over the largest ankle moment of the built-in gait [-]."""
    return held_torque(values) / _healthy_peak_moment(load_walk(PAIR))


def swept_volume(values: Values) -> float:
    """Volume per angle [m^3/rad] of a reading of the chambers."""
    return _chambers(values).volume_per_angle


def walking_torque(values: Values) -> float:
    """Largest torque [N m] of the mean stride of the walk 'solenoid' at a supply pressure."""
    overrides = (f"supply.pressure={_pressure(values)!r} Pa_a",)
    return float(_walked(PAIR, _chambers(values), overrides).averages["torque"].mean.max())


def dorsiflexor_share(values: Values) -> float:
    """Moment of a nondisabled wearer's dorsiflexors with the device over that without any [-], means of a stride."""
    worn = _nondisabled(PAIR, values)
    return worn.metrics["dorsiflexor_moment"].value / healthy_metrics(worn.scenario)["dorsiflexor_moment"].value


def recycling_saving(values: Values) -> float:
    """Share [-] of the gas of a stride that the valve between the chambers saves against event-based control."""
    plain, recycling = (_nondisabled(name, values).metrics["gas"].value for name in (PAIR, RECYCLING))
    return 1.0 - recycling / plain


def recycling_work(values: Values) -> float:
    """Net work of a stride with the valve between the chambers over that of event-based control [-]."""
    plain, recycling = (_work_of_a_stride(_nondisabled(name, values)) for name in (PAIR, RECYCLING))
    return recycling / plain


def event_reduction(wearer: str) -> float:
    """Share [-] by which state estimation lowers the error of event times of one wearer, against thresholds."""
    configuration = load_walk(PAIR, WEARERS[wearer])
    course = uneven_course(2.0 / walk_of(configuration).gait.stride_time)
    errors = []
    for timing in ("thresholds", "estimated"):
        walked = load_walk(PAIR, (*WEARERS[wearer], f"timing.kind={timing}"))
        walked = replace(walked, motion=replace(walk_of(walked), course=course))
        errors.append(rms_of([event.errors for event in timed_events(walked, 1.0).values()]))
    return 1.0 - errors[1] / errors[0]


_OF_PRESSURE, _OF_CHAMBERS = {"pressure": "Pa_a"}, {"chambers": CHAMBERS}
_OF_RECYCLING = _OF_CHAMBERS | {"holding_time": "s"}

COMPUTATIONS: dict[str, Computation] = {
    "held_torque": Computation("torque constant times gauge pressure", "N m", _OF_PRESSURE, held_torque),
    "share_of_healthy_moment": Computation(
        "the same over the largest ankle moment of the built-in gait", "1", _OF_PRESSURE, share_of_healthy_moment
    ),
    "swept_volume": Computation("volume per angle of the chambers", "m^3/rad", _OF_CHAMBERS, swept_volume),
    "walking_torque": Computation(
        "largest torque of the mean stride of the walk 'solenoid'", "N m", _OF_PRESSURE | _OF_CHAMBERS, walking_torque
    ),
    "dorsiflexor_share": Computation(
        "moment of the dorsiflexors of a nondisabled wearer with the device over that without",
        "1",
        _OF_CHAMBERS,
        dorsiflexor_share,
    ),
    "recycling_saving": Computation(
        "gas of a stride saved by 'solenoid-recycling' against 'solenoid', nondisabled wearer",
        "1",
        _OF_RECYCLING,
        recycling_saving,
    ),
    "recycling_work": Computation(
        "net work of a stride with 'solenoid-recycling' over that with 'solenoid', nondisabled wearer",
        "1",
        _OF_RECYCLING,
        recycling_work,
    ),
    "healthy_event_reduction": Computation(
        "error of event times less with state estimation than with thresholds, nondisabled wearer, uneven strides",
        "1",
        {},
        lambda _: event_reduction("healthy"),
    ),
    "impaired_event_reduction": Computation(
        "error of event times less with state estimation than with thresholds, drop foot, uneven strides",
        "1",
        {},
        lambda _: event_reduction("impaired"),
    ),
}
