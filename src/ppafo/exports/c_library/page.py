"""What the page of an exported library says of the scenario or walk that it was made from."""

import itertools
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from ppafo.exports.c_library.files import c_identifier
from ppafo.metrics.catalog import METRICS
from ppafo.model.valves.catalog import VALVES
from ppafo.parameters.device import Device, Orifice, SonicOrifice
from ppafo.parameters.effects import effects_of
from ppafo.parameters.graph import Graph
from ppafo.simulation.scenario import PrescribedMotion, Scenario

if TYPE_CHECKING:
    from ppafo.walking.configuration import Configuration
    from ppafo.walking.sensor_settings import FaultSettings

_METRICS_OF_SCENARIO = """\
They are those of a study (`ppafo sweep`), to the bit. In `ppafo simulate` the same are computed from the recording,
whose sums are rounded in another order: they agree to about 15 digits. Not here, since they need the whole course of a
channel: {left_out}."""
_METRICS_OF_WALK = """\
They are means over the strides with help, from the third on, and counts; on a course counts alone. In `ppafo walk` the
same are computed from the recording, whose sums are rounded in another order: they agree to about 15 digits. Not here,
since they need the mean stride or the healthy one: `healthy_positive_work`, `push_off_share`, `lowest_toes`,
`angle_difference`, `dorsiflexor_moment`; nor safety events and the segments of a course."""
_FOLLOWS = """\
- As in ppafo, these follow others as long as they have their default, also where that is given: {followers}."""
_TRAPS_OF_WALK = """\
- `sensors_angle_bandwidth` and `sensors_pressure_bandwidth` 0 are sensors that follow at once.
- `run_duration` is what `ppafo walk` calls `--minutes`, here in seconds and up to 10^6.
- `..._bad_setting` looks at ranges and at contradictions of two settings. A walk file is also refused where a setting
  contradicts the gait, or several others at once."""


def words_of(scenario: Scenario, links: Graph) -> dict[str, str]:
    """What the page of the library says of this scenario, in which settings follow others by ``links``."""
    motion = scenario.motion
    moves = f"prescribed, `{motion.profile.kind}`" if isinstance(motion, PrescribedMotion) else "free"
    fixed = [
        f"the valve, `{scenario.device.valve.kind}`, and the controller, `{scenario.control.kind}`",
        f"the reference, `{scenario.reference.kind}`, and the motion, {moves}",
        *_fixed_of_device(scenario.device, scenario.thermal is not None, scenario.supply_lines is not None),
        _at_zero(scenario.device, scenario.sensors.flaws),
        "whether `run_output_interval` is a whole number of steps of the engine",
    ]
    left_out = [kind.name for kind in METRICS.values() if kind.traced]
    return {
        "fixed": _listed(fixed),
        "precomputed": "nothing",
        "traps": _followers(links),
        "metrics_said": _METRICS_OF_SCENARIO.format(left_out=", ".join(f"`{name}`" for name in left_out)),
    }


def _followers(links: Graph) -> str:
    """The line on what follows what."""
    pairs = {path: dict.fromkeys(source for link in found for source in link.sources) for path, found in links.items()}
    said = (
        f"`{c_identifier(path)}` ({', '.join(f'`{c_identifier(source)}`' for source in sources)})"
        for path, sources in pairs.items()
    )
    return _FOLLOWS.format(followers=", ".join(said) or "none")


def words_of_walk(
    configuration: "Configuration", links: Graph, failing: "Mapping[str, FaultSettings]"
) -> dict[str, str]:
    """What the page of the library says of this walk: settings follow others by ``links``, some sensors ``failing``."""
    faults = [f"{sensor} `{item.kind}`" for sensor, item in failing.items()]
    course = configuration.course
    way = "stride after equal stride" if course is None else f"the course `{course.name}`, which stays as it is"
    fixed = [
        f"the gait, `{configuration.gait.name}`: its series, its events and its stride of "
        f"{configuration.gait.stride_time:.4g} s are numbers in the source",
        f"how it is walked: {way}",
        f"the valve, `{configuration.device.valve.kind}`, and the controller, `{configuration.controller.name}`",
        *_fixed_of_device(
            configuration.device, configuration.thermal is not None, configuration.supply_lines is not None
        ),
        f"which sensors fail, and how: {', '.join(faults) or 'none'}; and whether one is late",
        _at_zero(configuration.device, () if configuration.has_ideal_sensors else (1.0,)),
    ]
    return {
        "fixed": _listed(fixed),
        "precomputed": "the gait alone" if course is None else "the gait and its course alone",
        "traps": f"{_followers(links)}\n{_TRAPS_OF_WALK}",
        "metrics_said": _METRICS_OF_WALK,
    }


def _fixed_of_device(device: Device, is_thermal: bool, has_lines: bool) -> list[str]:
    """What no setting of a device changes."""
    forms = {"valve": device.valve.orifice, "leak": device.actuator.leak}
    lines = "with lines behind the regulators" if has_lines else "constant supply pressures"
    effects = ", ".join(f"`{effect.name}`" for effect in effects_of(device))
    return [
        *(f"the form of the {name}, `{_form(orifice)}`" for name, orifice in forms.items()),
        f"the gas, `{'thermal' if is_thermal else 'isothermal'}`; {lines}, which "
        f"{'take' if device.supply.relieving else 'do not take'} gas back from a chamber above them",
        *([f"the effects, {effects}, none of which can be switched off"] if effects else []),
    ]


def _at_zero(device: Device, flaws: Sequence[float]) -> str:
    """Which settings that choose functions are 0."""
    zero = [f"`valve_{name}`" for name in choosing(device) if not device.valve.settings[name] > 0.0]
    flawless = [] if any(flaws) else ["what makes a sensor of `sensors_` less than ideal"]
    here = ", ".join([*zero, *flawless]) or "none"
    return f"which of the settings of the valve and of the sensors are 0: here 0 are {here}"


def _listed(items: Sequence[str]) -> str:
    return "\n".join(f"- {item}{'.' if item is items[-1] else ';'}" for item in items)


def _form(orifice: Orifice | SonicOrifice) -> str:
    return "sonic_conductance, critical_ratio" if isinstance(orifice, SonicOrifice) else "area, discharge_coefficient"


def choosing(device: Device) -> list[str]:
    """Settings of the valve that choose its functions by being 0 or not."""
    kind = VALVES[device.valve.kind]
    names = [item.name for item in kind.quantities]
    chosen = {}
    for pattern in itertools.product((0.0, 0.01), repeat=len(names)):
        model = kind.choose(dict(zip(names, pattern, strict=True)))
        chosen[pattern] = model, model.command_delay(dict(zip(names, pattern, strict=True))) > 0.0
    return [
        name
        for place, name in enumerate(names)
        if any(chosen[pattern] != chosen[*pattern[:place], 0.0, *pattern[place + 1 :]] for pattern in chosen)
    ]
