"""A walk file: device, controller, wearer, sensors and faults, as frozen values in SI units."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from ppafo.control.kind import ControllerKind
from ppafo.gait import Gait
from ppafo.model.gait_sensors import Fault, GaitSensors
from ppafo.model.regulator import SupplyLines
from ppafo.model.sensors import SensorParameters
from ppafo.parameters.device import Device
from ppafo.parameters.graph import Graph
from ppafo.simulation.scenario import Thermal
from ppafo.walking.bottle_supply import BottleSupply
from ppafo.walking.course import WalkingCourse
from ppafo.walking.sensor_settings import NEVER, SensorSettings
from ppafo.walking.wearer import Wearer


@dataclass(frozen=True, slots=True)
class Configuration:
    """One device on one wearer; ``settings`` of the controller in SI, ``period`` and ``step`` in seconds.

    ``supply_lines`` are the lines behind its regulators, None where the supply pressures are constant. ``thermal`` is
    how the gas takes up heat, None where it keeps its temperature. ``course`` is what the wearer does one after the
    other, None where stride follows equal stride.
    ``bottle`` is the one that the device hangs on, None where its supply does not end.
    ``converter`` has the settings of the converter of a controller on whole numbers, None where it has floats.
    ``sensor_settings`` are what ``gait_sensors`` were made from, None where they were not read from a file.
    ``links`` say which numbers follow others that are set, beside those of the device.
    ``wearer_origin`` says in words whose body mass it is.
    ``assumed`` has the values that no source gives, by path, with the reason for each.
    """

    name: str
    description: str
    device: Device
    gait: Gait
    wearer: Wearer
    controller: ControllerKind
    settings: Mapping[str, float]
    sensors: SensorParameters
    gait_sensors: GaitSensors
    period: float
    step: float
    assumed: Mapping[str, str]
    file: str
    overrides: tuple[str, ...]
    supply_lines: SupplyLines | None = None
    thermal: Thermal | None = None
    course: WalkingCourse | None = None
    wearer_origin: str = "the paper's subject"
    bottle: BottleSupply | None = None
    sensor_settings: SensorSettings | None = None
    converter: Mapping[str, float] | None = None
    links: Graph = field(default_factory=dict, compare=False)

    @property
    def graph(self) -> Graph:
        """All links, those of the device first."""
        return {**self.device.links, **self.links}

    @property
    def has_ideal_sensors(self) -> bool:
        """True where nothing but the bandwidth of the force sensors stands between foot and controller."""
        noise = self.sensors[:4]
        gait = self.gait_sensors
        failing = any(fault.time < NEVER for fault in gait if isinstance(fault, Fault))
        _, *rest = (value for value in gait if not isinstance(value, Fault))
        return not (any(noise) or any(rest) or failing)
