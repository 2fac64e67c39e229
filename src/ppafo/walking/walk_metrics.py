"""Results of a walk as numbers: means over the strides, fractions of a healthy ankle, tracking and safety."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from ppafo.control.walking.phases import PUSH_OFF
from ppafo.engine.lanes import Floats
from ppafo.metrics import Metric
from ppafo.metrics.strides import PER_STRIDE, SETTLING
from ppafo.signals import Recording
from ppafo.simulation.scenario import Scenario
from ppafo.walking.gait_series import gait_timing
from ppafo.walking.motion import walk_of
from ppafo.walking.posture import ankle_path
from ppafo.walking.strides import PHASES, Curves, samples_of


def walk_metrics(
    configuration: Scenario,
    recording: Recording,
    strides: Mapping[str, Floats],
    averages: Mapping[str, Curves],
    starts: NDArray[np.intp],
    helped: NDArray[np.bool_],
    counted: NDArray[np.bool_],
) -> dict[str, Metric]:
    """Metrics of a walk by name, in SI, of its strides with help.

    ``starts`` are the samples after each heel strike, ``helped`` tells which strides had help and ``counted`` which of
    all are for means. ``averages`` are those of the counted strides with help.
    """
    counts = (
        Metric(float(helped.size), "-", "whole strides of the walk"),
        Metric(float(helped.sum()), "-", "whole strides with help from strike to strike"),
        Metric(
            float((~helped).sum()),
            "-",
            "whole strides with less help (lifted only, paused or stopped) in at least a part of them",
        ),
        Metric(float(np.ptp(recording["supplied_mass"][[0, -1]])), "kg", "gas taken from the supply in the whole walk"),
    )
    found = stride_metrics(configuration, strides, averages, helped & counted)
    found |= dict(zip(("strides", "helped_strides", "vented_strides", "total_gas"), counts, strict=True))
    return found | _tracking(recording, starts, helped & counted) | _safety(recording)


def settled(chosen: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The chosen strides without the first ones of the walk."""
    return chosen & (np.arange(chosen.size) >= SETTLING)


def stride_metrics(
    configuration: Scenario,
    strides: Mapping[str, Floats],
    averages: Mapping[str, Curves],
    chosen: NDArray[np.bool_],
) -> dict[str, Metric]:
    """Means over the chosen strides (strides,), and what they are of a healthy ankle; ``averages`` are theirs too."""
    found = {}
    over = "" if walk_of(configuration).course is None else " over the strides at an even speed on level ground"
    for name, item in PER_STRIDE.items():
        values = strides[name][chosen]
        if name == "slap_rate":
            values = values[values < 0.0]
        if values.size:
            found[name] = Metric(float(values.mean()), item.unit, f"{item.summary}, mean{over}")
    found["counted_strides"] = Metric(float(chosen.sum()), "-", "strides over which the means are taken")
    healthy = healthy_positive_work(configuration)
    if healthy > 0.0:
        found["healthy_positive_work"] = Metric(healthy, "J", "positive work of the healthy ankle in one stride")
        if "push_off_work" in found:
            fraction = found["push_off_work"].value / healthy
            found["push_off_share"] = Metric(
                fraction, "-", "work of T_ex in push-off over the healthy ankle's positive work"
            )
    if "dorsiflexor_moment" in averages:
        moment = float(averages["dorsiflexor_moment"].mean[:-1].mean())
        found["dorsiflexor_moment"] = Metric(moment, "N m", "moment of the wearer's dorsiflexors, mean over the stride")
    if "toe_height" in averages:
        found["lowest_toes"] = lowest_toes(configuration, averages["toe_height"].mean)
    if "angle" in averages:
        away = averages["angle"].mean - averages["healthy_angle"].mean
        found["angle_difference"] = Metric(
            float(np.sqrt(np.mean(away**2))), "rad", "RMS difference of the mean ankle angle to the healthy one"
        )
    return found


def lowest_toes(configuration: Scenario, height: Floats) -> Metric:
    """Lowest toes in mid-swing, where they must clear the ground, from their height [m] at ``PHASES``."""
    timing = gait_timing(walk_of(configuration).gait)
    first, last = np.searchsorted(PHASES, [timing.clearance_from, timing.clearance_to])
    return Metric(
        float(height[first:last].min()), "m", "lowest toe height above ground in mid-swing of the mean stride"
    )


def _tracking(recording: Recording, starts: NDArray[np.intp], chosen: NDArray[np.bool_]) -> dict[str, Metric]:
    """How well a controller that wants a torque gets it in push-off; nothing for others or without strides."""
    if "reference" not in recording or not chosen.any():
        return {}
    pushes = samples_of(chosen, starts, recording.time.size) & (recording["controller_phase"] == PUSH_OFF)
    error = (recording["reference"] - recording["torque"])[pushes]
    if not error.size:
        return {}
    rms = float(np.sqrt(np.mean(error**2)))
    return {"push_off_error": Metric(rms, "N m", "RMS of requested torque less actuator torque in push-off")}


def _safety(recording: Recording) -> dict[str, Metric]:
    """When the controller first helped less; nothing where it never did."""
    if "safe_state" not in recording or not recording["safe_state"].any():
        return {}
    time = float(recording.time[int(np.argmax(recording["safe_state"] > 0.5))])
    return {"safe_state_time": Metric(time, "s", "time at which the controller first lifted only, paused or stopped")}


def healthy_positive_work(configuration: Scenario) -> float:
    """Positive work [J] of the measured ankle moment in one stride of the wearer; 0 where no moment was measured."""
    gait = walk_of(configuration).gait
    if "ankle_moment" not in gait.curves:
        return 0.0
    phases = np.linspace(0.0, 1.0, 2001)
    moment = walk_of(configuration).wearer.body_mass * gait.curve("ankle_moment").values_at(phases)
    angle = gait.ankle_angle.values_at(phases)
    power = np.maximum(moment * np.gradient(angle, phases), 0.0)
    return float(np.trapezoid(power, phases))


def healthy_toe_height(configuration: Scenario) -> Floats:
    """Toes of the healthy gait over the ground [m] at ``PHASES``."""
    gait = walk_of(configuration).gait
    path = ankle_path(gait, gait_timing(gait), walk_of(configuration).wearer)
    return path.toe_height(PHASES % 1.0, gait.shank_angle.values_at(PHASES), gait.ankle_angle.values_at(PHASES))
