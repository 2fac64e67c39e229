"""README paragraphs of an exported library on its scenario or walk."""

from collections.abc import Sequence

from ppafo.exports.c_library.library import c_identifier
from ppafo.exports.c_library.settings import choosing, numbers_of_second_chamber
from ppafo.metrics import METRICS
from ppafo.parameters.device import SonicOrifice
from ppafo.parameters.effects import effects_of
from ppafo.parameters.graph import ATMOSPHERE_PATH, Graph
from ppafo.simulation.motion_kind import WALK
from ppafo.simulation.scenario import Scenario, vane_motion

_METRICS_OF_SCENARIO = """\
They equal the metrics of a study (`ppafo sweep`) to the bit. In `ppafo simulate` the same are computed from the
recording, whose sums are rounded in another order: they agree to about 15 digits. Not here, since they need all samples
of a channel: {left_out}."""
_METRICS_OF_WALK = """\
They are means over the strides from the third on, and counts. In `ppafo walk` the same are computed from the recording,
whose sums are rounded in another order: they agree to about 15 digits. Not here, since they need the mean stride or the
healthy one: `healthy_positive_work`, `push_off_share`, `lowest_toes`, `angle_difference`, `dorsiflexor_moment`."""
_OF_TIMES = "whether `run_output_interval` is a whole number of steps of the engine, and whether the supply is suction"
_FOLLOWS = """\
- As in ppafo, these settings depend on others while they equal their default, even if it is given: {followers}."""
_TRAPS_OF_WALK = """\
- `sensors_angle_bandwidth` and `sensors_pressure_bandwidth` 0 are sensors without lag.
- `run_duration` is what `ppafo walk` calls `--minutes`, here in seconds and up to 10^6."""


def words_of(scenario: Scenario, links: Graph) -> dict[str, str]:
    """Return README texts on a scenario or a walk; ``links`` has the parameters that follow others."""
    kind, device = scenario.motion.motion_kind, scenario.device
    laws = f"the valve, `{device.valve.kind}`, and the controller, `{scenario.controller.kind}`"
    zero = [f"`valve_{name}`" for name in choosing(device) if not device.valve.settings[name] > 0.0]
    flawless = [] if any(kind.flaws(scenario)) else ["the sensor errors of `sensors_`"]
    selecting = f"which settings of valve and sensors are 0 (here {', '.join([*zero, *flawless]) or 'none'})"
    of_both = [*_fixed_of_device(scenario), selecting]
    # A missing chamber has the pressure of the atmosphere; its other numbers are constants and omitted.
    absent, followed = numbers_of_second_chamber(scenario), list[str]()
    for path, follows in links.items():
        paths = [each for link in follows for each in link.sources if each not in absent or "pressure" in each]
        paths = [ATMOSPHERE_PATH if each in absent else each for each in paths]
        sources = dict.fromkeys(f"`{c_identifier(each)}`" for each in paths)
        followed.append(f"`{c_identifier(path)}` ({', '.join(sources)})")
    followers = _FOLLOWS.format(followers=", ".join(followed) or "none")
    if kind.layout != WALK:
        moved = vane_motion(scenario)
        profile = moved.profile if moved.leg is None else moved.leg.shank
        along = "" if profile is None else f" along `{profile.kind}`"
        motion = f"the reference, `{scenario.reference.kind}`, and the motion, `{kind.name}`{along}"
        left_out = ", ".join(f"`{kind.name}`" for kind in METRICS.values() if kind.traced)
        return {
            "fixed": _listed([laws, motion, *of_both, _OF_TIMES]),
            "precomputed": "nothing",
            "traps": followers,
            "metrics_said": _METRICS_OF_SCENARIO.format(left_out=left_out),
        }
    from ppafo.walking.motion import walk_of

    gait = walk_of(scenario).gait
    series = f"its series, its events and its stride of {gait.stride_time:.4g} s are numbers in the source"
    return {
        "fixed": _listed([f"the gait, `{gait.name}`: {series}", "the walk: equal strides", laws, *of_both]),
        "precomputed": "the gait alone",
        "traps": f"{followers}\n{_TRAPS_OF_WALK}",
        "metrics_said": _METRICS_OF_WALK,
    }


def _fixed_of_device(scenario: Scenario) -> list[str]:
    """Return README lines on device properties that no setting changes."""
    device = scenario.device
    forms = {"valve": device.valve.orifice}
    if not device.actuator.has_one_chamber:
        forms["leak"] = device.actuator.leak
    lines = "with lines behind the regulators" if scenario.supply_lines is not None else "constant supply pressures"
    effects = ", ".join(f"`{effect.name}`" for effect in effects_of(device) if effect.switch)
    gas = "thermal" if scenario.gas_model is not None else "isothermal"
    verb = "let" if device.supply.takes_back else "do not let"
    return [
        *(
            f"the form of the {name}, `sonic_conductance, critical_ratio`"
            if isinstance(orifice, SonicOrifice)
            else f"the form of the {name}, `area, discharge_coefficient`"
            for name, orifice in forms.items()
        ),
        f"the gas, `{gas}`; {lines}, which {verb} gas flow back from a chamber at higher pressure",
        *([f"the effects, {effects}, none of which can be switched off"] if effects else []),
    ]


def _listed(items: Sequence[str]) -> str:
    return "\n".join(f"- {line}{'.' if line is items[-1] else ';'}" for line in items)
