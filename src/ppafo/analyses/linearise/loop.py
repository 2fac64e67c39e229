"""Control loop of a linear model with the scenario's own PID: margins, crossovers, bandwidth and stability."""

import numpy as np
from numpy.typing import NDArray

from ppafo.analyses.linearise.model import LinearModel, LoopMargins
from ppafo.analyses.linearise.plant import size_of
from ppafo.control.torque_loop import SHARPNESS
from ppafo.engine.lanes import Floats
from ppafo.model.controlled import error_functions

PID_LAWS = ("pid", "pid_feedforward")
"""Controllers whose feedback is a PID: their loop is linear while the command is not clipped."""
_POINTS = 20_000
"""Number of frequencies at which a loop is computed, equally spaced on a logarithmic scale."""
_BELOW_POLES = 1.0e-3
"""Lowest frequency of a loop, relative to the frequency of the slowest pole or corner that is no integrator [-]."""
_LEAST_START = 1.0e3
"""Least magnitude [-] at the lowest frequency of a loop with an integrator: there the integrator decides."""
_POINTS_BELOW = 2_000
"""Number of frequencies added below, where the magnitude at the lowest frequency is less."""
_INTEGRATOR = 1.0e-9
"""Magnitude [1/s] up to which a pole counts as an integrator."""
_ROUNDING = 1.0e-9
"""Tolerance for the rounding of a delay in sample periods [-]."""
_HALF_POWER = float(np.sqrt(0.5))


def open_loop(model: LinearModel) -> tuple[Floats, NDArray[np.complex128]] | None:
    """Return frequencies [Hz] up to half the sample rate, and the open-loop response of PID and plant at each.

    The sampled loop is cut at the command. It has the PID with rectangular integration and filtered difference, a
    zero-order hold, the delays that the model omits and the bandwidths of the sensors, but no noise or resolution.
    None for a controller without PID, a command that is clipped or has no effect, or a controlled quantity at rest.
    """
    scenario, gains, period = model.scenario, model.scenario.controller.settings, model.scenario.controller.period
    command, outputs = abs(model.inputs[0].value), [signal.name for signal in model.outputs]
    difference = {"pressure_1": 1.0, "pressure_2": -1.0}
    weights = difference if scenario.controlled == "pressure_difference" else {scenario.controlled: 1.0}
    if scenario.controller.kind not in PID_LAWS or command >= 1.0 or not weights.keys() <= set(outputs):
        return None
    rates = [1.0 / period, *np.abs(model.poles).tolist(), gains["integral_gain"] / (gains["proportional_gain"] or 1.0)]
    slowest = min(rate for rate in rates if rate > _INTEGRATOR) / (2.0 * np.pi)
    frequencies = np.geomspace(_BELOW_POLES * slowest, 0.5 / period, _POINTS)
    row = np.asarray(sum(weight * model.c[outputs.index(name)] for name, weight in weights.items()))
    # The law skips the dead band that it assumes, within a narrow range of openings.
    band = gains.get("dead_band", 0.0)
    opened = 1.0 - band + (band / SHARPNESS if command < band + (1.0 - band) * SHARPNESS else 0.0)
    steered = error_functions(scenario.controlled, scenario.device.supply.is_vacuum).steered(opened)

    def response(frequencies: Floats) -> NDArray[np.complex128]:
        z = np.exp(2.0j * np.pi * frequencies * period)
        change = 1.0 - 1.0 / z
        law = gains["proportional_gain"] + gains["integral_gain"] * period / change
        law += gains["derivative_gain"] * change / (period + gains["derivative_filter"] * change)
        return np.asarray(steered * law * _sampled_plant(model, row, z))

    loop = response(frequencies)
    if not loop.all():
        return None
    start = float(np.abs(loop[0]))
    if _integrators(frequencies, loop) > 0 and start < _LEAST_START:
        below = np.geomspace(frequencies[0] * start / _LEAST_START, frequencies[0], _POINTS_BELOW)[:-1]
        frequencies, loop = np.concatenate([below, frequencies]), np.concatenate([response(below), loop])
    return frequencies, loop


def loop_margins(model: LinearModel) -> LoopMargins | None:
    """Return the margins of the loop that the scenario's PID closes around a linear model; None without a loop."""
    found = open_loop(model)
    if found is None:
        return None
    frequencies, loop = found
    sensitivity = 1.0 / (1.0 + loop)
    # Nyquist: of a stable closed loop, 1 + L turns by a quarter for each integrator, by a half for each unstable pole.
    turned = np.unwrap(np.angle(1.0 + loop))
    log_gain, closed = np.log(np.abs(loop)), np.abs(loop * sensitivity)
    quarters = _integrators(frequencies, loop) + 2 * np.count_nonzero(model.poles.real > _INTEGRATOR)
    at_gain = _crossings(log_gain, frequencies, np.angle(-loop))
    # At half the sample rate, where the curve ends, the loop is real.
    at_phase = _crossings(np.where(loop.real < 0.0, loop.imag, np.nan)[:-1], frequencies, log_gain)
    at_phase += [(float(frequencies[-1]), float(log_gain[-1]))] if loop[-1].real < 0.0 else []
    falls = _crossings(closed - _HALF_POWER * closed[0], frequencies, closed)
    gain_crossover, phase_margin = min(at_gain, key=lambda pair: abs(pair[1]), default=(None, None))
    phase_crossover, log_margin = min(at_phase, key=lambda pair: abs(pair[1]), default=(None, None))
    return LoopMargins(
        is_stable=bool(round(float(turned[-1] - turned[0]) / (0.5 * np.pi)) == quarters),
        gain_margin=None if log_margin is None else float(np.exp(-log_margin)),
        phase_crossover=phase_crossover,
        phase_margin=phase_margin,
        gain_crossover=gain_crossover,
        bandwidth=falls[0][0] if falls else None,
        peak_sensitivity=float(np.max(np.abs(sensitivity))),
    )


def _integrators(frequencies: Floats, loop: NDArray[np.complex128]) -> int:
    """Return the number of integrators of a loop, by its slope at the lowest frequency.

    Two sealed chambers are two integrators of one command, of which the loop has one.
    """
    return round(float(np.log(np.abs(loop[0] / loop[1])) / np.log(frequencies[1] / frequencies[0])))


def _sampled_plant(model: LinearModel, row: Floats, z: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Return the sampled response at ``z`` of measured states, weighted by ``row``, to a command held for a period."""
    from scipy.linalg import expm

    count, period, sensors = len(model.states), model.scenario.controller.period, model.scenario.sensors
    sizes = np.array([size_of(signal.name) for signal in model.states])
    # The readings of sensors with a bandwidth are states as well; then come the command now, and the one before.
    matrix = np.zeros((2 * count + 1, 2 * count + 1))
    matrix[:count, :count] = model.a * sizes / sizes[:, None]
    matrix[:count, -1] = model.b[:, 0] / sizes
    shown = np.zeros(2 * count)
    for index, signal in enumerate(model.states):
        bandwidth = getattr(sensors, f"{signal.name.partition('_')[0]}_bandwidth", 0.0)
        matrix[count + index, [index, count + index]] = np.array([1.0, -1.0]) * (2.0 * np.pi * bandwidth or 1.0)
        shown[index + (count if bandwidth else 0)] = row[index] * sizes[index]
    whole, rest = divmod((model.delays.command + model.delays.signals) / period + _ROUNDING, 1.0)
    step, early = expm(matrix * period), expm(matrix * period * (1.0 - rest))
    # A command that comes within the period acts on its last part; the one before on the first.
    late = step[:-1, -1:] - early[:-1, -1:]
    held = early[:-1, -1:] * z[:, None, None] ** -whole + late * z[:, None, None] ** -(whole + 1.0)
    responses = np.linalg.solve(z[:, None, None] * np.eye(2 * count) - step[:-1, :-1], held)[:, :, 0]
    return np.asarray(responses @ shown, dtype=np.complex128)


def _crossings(values: Floats, frequencies: Floats, others: Floats) -> list[tuple[float, float]]:
    """Frequencies [Hz] at which ``values`` change their sign, each with ``others`` there, by linear interpolation."""
    found: list[tuple[float, float]] = []
    for before in np.flatnonzero(values[:-1] * values[1:] < 0.0).tolist():
        share = values[before] / (values[before] - values[before + 1])
        frequency, other = (each[before] + share * (each[before + 1] - each[before]) for each in (frequencies, others))
        found.append((float(frequency), float(other)))
    return found
