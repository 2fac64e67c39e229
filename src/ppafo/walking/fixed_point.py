"""The integer form of a walk's controller: its whole numbers, from settings in SI units."""

from ppafo.control.fixed.walking_law import GaitConverter, gait_converter
from ppafo.control.fixed.walking_numbers import FIXED_WALKS
from ppafo.control.kind import ControllerKind
from ppafo.errors import ScenarioError
from ppafo.walking.configuration import Configuration


def controller_of(configuration: Configuration) -> tuple[ControllerKind, dict[str, float]]:
    """The controller of a walk for the lanes, and its settings in SI units or the numbers of its integer form."""
    if configuration.converter is None:
        return configuration.controller, dict(configuration.settings)
    converter = converter_of_walk(configuration)
    return FIXED_WALKS[configuration.controller.name].kind, converter._asdict() | numbers_of_walk(configuration)


def converter_of_walk(configuration: Configuration) -> GaitConverter:
    """The converter of a walk whose controller computes with whole numbers."""
    assert configuration.converter is not None, "whole numbers are read by a converter"
    return gait_converter(*configuration.converter.values())


def numbers_of_walk(configuration: Configuration) -> dict[str, float]:
    """The whole numbers of a walk's controller by name, in floats."""
    law = FIXED_WALKS[configuration.controller.name]
    return law.prepare(configuration.settings, configuration.period, converter_of_walk(configuration))


def check_fixed_walk(configuration: Configuration) -> None:
    """Raise ScenarioError for what an integer controller of a walk cannot hold; nothing for one that has floats."""
    given = configuration.converter
    if given is None:
        return
    bits = given["converter_bits"]
    if bits % 1.0 != 0.0:
        raise ScenarioError(f"{configuration.file}: controller.converter_bits = {bits:g}: must be whole")
    numbers = numbers_of_walk(configuration)
    for item in FIXED_WALKS[configuration.controller.name].number_quantities:
        if not item.minimum <= numbers[item.name] <= item.maximum:
            raise ScenarioError(
                f"{configuration.file}: controller on whole numbers: {item.name} ({item.summary}) would be "
                f"{numbers[item.name]:.0f}, beyond {item.minimum:.0f} to {item.maximum:.0f}: take another range of the "
                "converter, a slower controller.rate, or another setting"
            )
