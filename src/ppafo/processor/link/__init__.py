"""Integer controller in C for the protocol of ``ppafo hil``: controller side of the link."""

import shlex

from ppafo.errors import ScenarioError
from ppafo.exports import filled, template
from ppafo.exports.hil.wire import MICROSECONDS
from ppafo.processor.firmware import firmware, fixed_point_controller
from ppafo.simulation.scenario import Scenario
from ppafo.version import __version__

_OF_FIRMWARE = ("controller.c", "controller.h", "parameters.h", "LICENSE")
_TEMPLATES = ("Makefile", "README.md", "host.c", "link.c", "link.h", "plant.h")


def example_controller(scenario: Scenario) -> dict[str, bytes]:
    """Return the files of a linked controller by name. Raises ScenarioError without an integer form."""
    fixed = fixed_point_controller(scenario)
    of_firmware = firmware(scenario)
    period = round(scenario.controller.period * MICROSECONDS)
    if abs(period / MICROSECONDS - scenario.controller.period) > 1.0e-9 * scenario.controller.period:
        raise ScenarioError(
            f"{scenario.name}: controller.period = {scenario.controller.period:.9g} s: must be a whole number of "
            "microseconds"
        )
    source = scenario.origin.file or scenario.name
    settings = (word for override in scenario.origin.overrides for word in ("--set", override))
    words = {
        "title": scenario.name,
        "kind": fixed.law.kind.name,
        "version": __version__,
        "period": str(period),
        "pressure_step": repr(fixed.steps.pressure_step),
        "torque_step": repr(fixed.steps.torque_step),
        "top": repr(fixed.limits.top),
        "middle": repr(fixed.limits.middle),
        "next": shlex.join(["ppafo", "hil", source, *settings, "--port", "udp:127.0.0.1:5000", "--out", "out/hil"]),
    }
    files = {name: filled(template(__name__, name), words).encode() for name in _TEMPLATES}
    return dict(sorted({**files, **{name: of_firmware[name] for name in _OF_FIRMWARE}}.items()))
