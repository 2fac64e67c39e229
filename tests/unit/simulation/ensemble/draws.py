"""Random columns for any scenario: every number that can vary, within what is allowed and what makes sense together."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ppafo.model.controlled import ANGLE
from ppafo.model.declaration import Quantity
from ppafo.simulation.numbers import chosen_path, declared_numbers, number_at
from ppafo.simulation.scenario import Scenario

Floats = NDArray[np.float64]

NEAR = 0.05
"""Numbers are drawn within this share of the scenario's own."""

CHOICES: dict[str, Sequence[float]] = {
    "run.duration": (0.05, 0.08),
    "run.output_interval": (0.001, 0.002),
    "controller.rate": (1000.0, 500.0),
    "flow.linear_ratio": (0.995, 0.999, 0.9995),
    "sensors.seed": (1.0, 7.0, 4294967295.0),
    "gas.heat_capacity_ratio": (1.3, 1.4),
    "valve.dead_band": (0.0, 0.05),
    "valve.delay": (0.0, 0.0007, 0.003),
    "valve.spool_frequency": (0.0, 30.0, 60.0),
    "valve.spool_damping_ratio": (0.5, 1.0, 2.0),
    "valve.slew_limit": (0.0, 5.0, 50.0),
    "valve.opening_delay": (0.0, 0.0011),
    "valve.closing_delay": (0.0, 0.002),
    "valve.switching_interval": (0.0, 0.005),
    "sensors.delay": (0.0, 0.0013, 0.002),
    "sensors.angle_noise": (0.0, 0.001),
    "sensors.pressure_noise": (0.0, 500.0),
    "sensors.angle_resolution": (0.0, 0.0002),
    "sensors.pressure_resolution": (0.0, 100.0),
    "controller.derivative_filter": (0.0, 0.004),
    "controller.anti_windup": (0.0, 5.0),
    "controller.command": (-1.0, 0.3, 1.0),
    "motion.angular_velocity": (0.0, 0.5, -0.5),
    "motion.external_torque": (0.0, 0.3, -0.3),
    "motion.profile.phase": (0.0, 0.25),
    "reference.phase": (0.0, -0.3),
    "reference.start_level": (0.0, 0.4),
    "reference.ramp_start": (0.0, 0.01),
    "reference.ramp_time": (0.02, 0.5),
    "valve.critical_ratio": (0.2, 0.35),
    "valve.sonic_conductance": (1.0e-8, 2.0e-8),
    "actuator.leak.critical_ratio": (0.2, 0.35),
    "actuator.leak.sonic_conductance": (1.0e-11, 2.0e-11),
}
"""Values for numbers that are 0 in the scenarios, that make another program, or that must fit each other."""

OTHER_FORMS = (
    ("valve.sonic_conductance", "valve.critical_ratio"),
    ("actuator.leak.sonic_conductance", "actuator.leak.critical_ratio"),
)


def drawn_columns(scenario: Scenario, generator: np.random.Generator, runs: int) -> dict[str, Floats]:
    """Columns of a random half of all numbers that can vary; gauge pressures stay what they are, in pascals."""
    declared = declared_numbers(scenario)
    paths = [path for path in declared if path not in ("run.step", "controller.period") and has(scenario, path)]
    chosen = {path for path in paths if generator.random() < 0.5}
    if scenario.controlled == ANGLE:
        # A stop that moves inside the wanted angle is refused.
        chosen -= {"actuator.angle_min", "actuator.angle_max"}
    for pair in OTHER_FORMS:
        chosen -= set(pair)
        if generator.random() < 0.3:
            section = pair[0].rpartition(".")[0]
            chosen -= {f"{section}.area", f"{section}.discharge_coefficient"}
            chosen |= set(pair)
    return {path: column(scenario, path, declared[path], generator, runs) for path in paths if path in chosen}


def has(scenario: Scenario, path: str) -> bool:
    """Tell whether a scenario has a number, or values are chosen for it: a valve by ISO 6358 has no area."""
    try:
        number_at(scenario, chosen_path(path, scenario))
    except AttributeError:
        return path in CHOICES
    return True


def column(scenario: Scenario, path: str, quantity: Quantity, generator: np.random.Generator, runs: int) -> Floats:
    """Values of one number for all runs."""
    if path in CHOICES:
        return generator.choice(CHOICES[path], runs)
    own = number_at(scenario, chosen_path(path, scenario))
    values = own * generator.uniform(1.0 - NEAR, 1.0 + NEAR, runs)
    return np.clip(values, quantity.minimum, quantity.maximum)
