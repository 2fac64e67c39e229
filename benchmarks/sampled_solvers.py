"""General-purpose solvers on the same closed loop: restarted at every sample, with the same controller between.

They integrate the compiled right-hand side that the reference solver uses, with the exact flow functions.
"""

from collections.abc import Callable
from importlib.util import find_spec

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.engine.rows import numbers
from ppafo.engine.run import Run
from ppafo.model.plant import actuator_torque, chamber_pressures
from ppafo.model.sensors import Measurement
from tests.reference.reference_solver import load_right_hand_side

PLANT_UNKNOWNS = 7
TYPICAL_SIZES = (1.0, 1.0, 1e-4, 1e-4, 1e-4, 1e-4, 1e-4, 1.0)
"""Angle [rad], angular velocity [rad/s], five masses [kg] and the opening of an ideal valve [-]."""

Interval = Callable[[Floats, float, float, float], Floats]
"""From the unknowns at one sample, its time, the next one's [s] and the command [-] to the unknowns at the next."""

SolverFactory = Callable[[Run, float], Interval]


def has_lsoda() -> bool:
    """True where SciPy is installed."""
    return find_spec("scipy") is not None


def has_cvode() -> bool:
    """True where scikit-sundae is installed."""
    return find_spec("sksundae") is not None


def lsoda_interval(run: Run, tolerance: float) -> Interval:
    """One sample period with ``scipy.integrate.solve_ivp(method="LSODA")`` at a relative tolerance."""
    from scipy.integrate import solve_ivp

    given, found, fill = load_right_hand_side(run)
    absolute = tolerance * np.array(TYPICAL_SIZES)

    def slopes(time: float, unknowns: Floats, command: float) -> Floats:
        given[:] = unknowns
        fill(time, command, 0.0)
        return found.copy()

    def advance(unknowns: Floats, begin: float, end: float, command: float) -> Floats:
        solution = solve_ivp(
            slopes, (begin, end), unknowns, method="LSODA", args=(command,), rtol=tolerance, atol=absolute
        )
        return np.array(solution.y[:, -1])

    return advance


def cvode_interval(run: Run, tolerance: float) -> Interval:
    """One sample period with SUNDIALS CVODE at a relative tolerance; one solver object for the whole run."""
    from sksundae.cvode import CVODE

    given, found, fill = load_right_hand_side(run)
    current = [0.0]

    def slopes(time: float, unknowns: Floats, out: Floats) -> None:
        given[:] = unknowns
        fill(time, current[0], 0.0)
        out[:] = found

    solver = CVODE(slopes, rtol=tolerance, atol=tolerance * np.array(TYPICAL_SIZES))

    def advance(unknowns: Floats, begin: float, end: float, command: float) -> Floats:
        current[0] = command
        solver.init_step(begin, unknowns)
        return np.array(solver.step(end, tstop=end).y)

    return advance


def solve_by_samples(run: Run, advance: Interval) -> Floats:
    """The seven numbers of ``PlantState`` at every sample (samples + 1, 7), with the run's own controller."""
    controller, period = run.program.controller, run.period
    if controller is None:
        raise ValueError("the benchmark runs controllers of the catalogue only")
    unknowns = np.array([*numbers(run.initial), *numbers(run.program.valve.state())])
    states = np.empty((run.step_count // run.steps_per_sample + 1, PLANT_UNKNOWNS))
    states[0] = unknowns[:PLANT_UNKNOWNS]
    memory = controller.initial
    for sample in range(states.shape[0] - 1):
        wanted = run.program.reference.value(run.reference, sample * period)[0]
        command, memory = controller.update(run.controller, memory, wanted, measured(run, unknowns), period)
        unknowns = advance(unknowns, sample * period, (sample + 1) * period, command)
        states[sample + 1] = unknowns[:PLANT_UNKNOWNS]
    return states


def measured(run: Run, unknowns: Floats) -> Measurement:
    """What ideal sensors see."""
    angle = float(unknowns[0])
    pressure_1, pressure_2 = chamber_pressures(run.plant, angle, float(unknowns[2]), float(unknowns[3]))
    torque = actuator_torque(pressure_1, pressure_2, run.plant.torque_constant)
    return Measurement(angle=angle, pressure_1=pressure_1, pressure_2=pressure_2, torque=torque)
