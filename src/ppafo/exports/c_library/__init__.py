"""A scenario as a library in C99, with an example and make files."""

import itertools
from collections.abc import Sequence

from ppafo.engine.program import Program
from ppafo.engine.run import batch_of
from ppafo.exports.c_library.files import Library, library_files
from ppafo.exports.c_library.preparation import Preparation, relations_of, settings_of
from ppafo.exports.c_library.program import exported
from ppafo.metrics.catalog import METRICS
from ppafo.model.valves.catalog import VALVES
from ppafo.parameters.device import Orifice, SonicOrifice
from ppafo.simulation.plan import plan_run
from ppafo.simulation.scenario import PrescribedMotion, Scenario

_ARRAYS = {
    "given": "SETTINGS",
    "prepared->parameters": "PARAMETERS",
    "prepared->states": "STATES",
    "prepared->counts": "COUNTS",
}
"""What the function from settings to the numbers of a run is handed, and how many there are of each."""


def c_library(scenario: Scenario) -> dict[str, bytes]:
    """Files of a library in C by name. ProgramError for what cannot be translated, with file and line."""
    return library_files(scenario_library(scenario))


def scenario_library(scenario: Scenario) -> Library:
    """A library whose settings are all numbers of a scenario."""
    program = exported(batch_of(plan_run(scenario)).program)
    settings = settings_of(scenario)
    given = [f"given[SETTING_{item.name.upper()}] = settings->{item.name};" for item in settings]
    arrays = ", ".join(f"array_of({name}, {count}, 0, 0)" for name, count in _ARRAYS.items())
    return Library(
        title=scenario.name,
        description=" ".join(scenario.description.split()),
        program=program,
        settings=settings,
        relations=relations_of(scenario),
        preparation=("double given[SETTINGS];", *given, f"prepare({arrays});"),
        other_program=_other_program(scenario, program.program),
        words=_words(scenario),
        further=lambda collector: Preparation(scenario, program.program, collector).text(),
    )


def _words(scenario: Scenario) -> dict[str, str]:
    """What the page of the library says of this scenario."""
    supply, motion = scenario.device.supply, scenario.motion
    moves = f"prescribed, `{motion.profile.kind}`" if isinstance(motion, PrescribedMotion) else "free"
    forms = {
        "valve": scenario.device.valve.orifice,
        "leak": scenario.device.actuator.leak,
    }
    lines = "with lines behind the regulators" if scenario.supply_lines else "constant supply pressures"
    fixed = [
        f"the valve, `{scenario.device.valve.kind}`, and the controller, `{scenario.control.kind}`",
        f"the reference, `{scenario.reference.kind}`, and the motion, {moves}",
        *(f"the form of the {name}, `{_form(orifice)}`" for name, orifice in forms.items()),
        f"the gas, `{'isothermal' if scenario.thermal is None else 'thermal'}`; {lines}, which "
        f"{'take' if supply.relieving else 'do not take'} gas back from a chamber above them",
    ]
    zero = [f"`valve_{name}`" for name in _choosing(scenario) if not scenario.device.valve.settings[name] > 0.0]
    flawless = [] if any(scenario.sensors.flaws) else ["all of `sensors_` but the seed"]
    left_out = [kind.name for kind in METRICS.values() if kind.traced]
    return {
        "fixed": "\n".join(f"- {item};" for item in fixed),
        "at_zero": f"here 0 are {', '.join([*zero, *flawless]) or 'none'}",
        "left_out": ", ".join(f"`{name}`" for name in left_out),
    }


def _form(orifice: Orifice | SonicOrifice) -> str:
    return "sonic_conductance, critical_ratio" if isinstance(orifice, SonicOrifice) else "area, discharge_coefficient"


def _other_program(scenario: Scenario, program: Program) -> tuple[str, ...]:
    """Conditions in C under which the settings ask for another program than this one."""
    given = scenario.device.valve.settings
    found = [_differs([f"valve_{name}"], given[name] > 0.0) for name in _choosing(scenario)]
    flaws = ["angle_noise", "pressure_noise", "angle_resolution", "pressure_resolution"]
    bandwidths = ["angle_bandwidth", "pressure_bandwidth"]
    found += [
        _differs(["sensors_delay"], program.late_signals),
        _differs([f"sensors_{name}" for name in (*flaws, *bandwidths)], not program.ideal_sensors),
        _differs([f"sensors_{name}" for name in bandwidths], program.slow_sensors),
    ]
    interval = "prepared->counts[COUNT_INTERVAL]"
    found.append(f"({interval} != (double)(int64_t){interval}) != {_truth(program.samples_inside)}")
    return tuple(found)


def _choosing(scenario: Scenario) -> list[str]:
    """Settings of the valve that choose its functions by being 0 or not."""
    kind = VALVES[scenario.device.valve.kind]
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


def _differs(names: Sequence[str], is_above: bool) -> str:
    """True where not the same is above 0 as in the scenario."""
    return f"({' || '.join(f'settings->{name} > 0.0' for name in names)}) != {_truth(is_above)}"


def _truth(value: bool) -> str:
    return "true" if value else "false"
