"""Gas that is not ideal, in shares of the second virial coefficient of CO2."""

from ppafo.identification.trajectory.directions.kind import TRACE, Direction
from ppafo.model.catalog import ACTUATORS
from ppafo.model.effects.second_virial import SECOND_VIRIAL
from ppafo.simulation.scenario import Scenario

_SHARE, _COEFFICIENT = (f"effects.second_virial.{name}" for name in ("share", "coefficient"))


def _suits(scenario: Scenario) -> bool:
    """Return whether there are steps for gas that is not ideal: none with an energy balance, supply lines or shapes."""
    has_shape = ACTUATORS[scenario.device.actuator.kind].model.shape is not None
    return scenario.thermal is None and scenario.supply_lines is None and not has_shape


DIRECTION = Direction(
    name="second_virial",
    title="gas that is not ideal",
    seems="the gas seems not to be ideal, with a second virial coefficient of {size}",
    unless="the gas is ideal, or has a second virial coefficient of no more than {size}",
    size_in_words=lambda size: f"{1e6 * SECOND_VIRIAL['CO2'] * size:.2g} cm^3/mol",
    sizes=(0.02, 0.1, 0.5, 2.5),
    settings=lambda size, _: {_SHARE: size, _COEFFICIENT: SECOND_VIRIAL["CO2"]},
    neutral={_SHARE: TRACE, _COEFFICIENT: SECOND_VIRIAL["CO2"]},
    suits=_suits,
)
