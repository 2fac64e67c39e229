"""The volume of lines between valve and chambers, filled at the pressure of their chamber."""

from ppafo.identification.trajectory.directions.kind import Direction
from ppafo.simulation.scenario import Scenario


def _settings(size: float, scenario: Scenario) -> dict[str, float]:
    actuator = scenario.device.actuator
    return {
        "actuator.dead_volume_1": actuator.dead_volume_1 + size,
        "actuator.dead_volume_2": actuator.dead_volume_2 + size,
    }


DIRECTION = Direction(
    name="line_volume",
    title="volume of the lines between valve and chambers",
    seems="lines of {size} more than the dead volumes have seem to lie between valve and chambers",
    unless="lines between valve and chambers have no more than {size} beyond the dead volumes",
    size_in_words=lambda size: f"{1e6 * size:.2g} cm^3",
    sizes=(1.0e-7, 5.0e-7, 2.5e-6, 1.0e-5),
    settings=_settings,
)
