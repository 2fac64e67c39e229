"""Report of the device for a wearer, or of the alternatives if no device meets the requirements."""

from functools import partial

from ppafo.analyses.design.wearer.electrical import electrical_sentences
from ppafo.analyses.design.wearer.requirements import (
    BODY_MASS_INDEX,
    CLEARANCE,
    MASS,
    TOES,
    TORQUE,
    WALKS,
    DesignRequirements,
    SizedDevice,
    WearerSizing,
)
from ppafo.analyses.design.wearer.strides import of_wearer
from ppafo.analyses.parts.sections import part_titles, parts_to_check
from ppafo.report import finding
from ppafo.report.finding import Finding, columns_of, facts
from ppafo.report.kind import Kind
from ppafo.simulation.gains import gains_of
from ppafo.units.reference import with_condition
from ppafo.units.shown import written_text
from ppafo.walking.bottle.course import duration_text
from ppafo.walking.figures.bottle import bottle_figure
from ppafo.walking.motion import walk_of
from ppafo.walking.planning import law_of
from ppafo.walking.wearer import who_walks
from ppafo.wording import argument_text, override_text

_HEAD = ("valve", "actuator", ("push-off peak", TORQUE), ("lowest toes", CLEARANCE))
_CAPTION = "The walk of the suggestion on its bottle for the requested {wished}; the bottle lasts {lasts}."
_NONE = "No device in the catalogue meets these requirements"
_INSTEAD = "Alternatives (examples), on the largest bottle (a design takes the lightest that lasts):"
_READING = (
    "Every pair of valve and actuator in the catalogue is simulated for a few strides at this pressure. Pairs with at "
    "least 95 % of the torque in the mean stride and the toes above the ground are simulated on bottles, lightest "
    "first, until a bottle lasts; that walk is shown. Dead volumes, friction and sensors come from the walk file; the "
    "dorsiflexion chamber is supplied with 90 % of the gauge pressure.",
    "Valve power is the mean power of the coils, or of the spool in proportion to its stroke; driver losses are "
    "neglected.",
)


def finding_of(sizing: WearerSizing) -> Finding[WearerSizing]:
    """Return a sizing for a wearer as a finding: device with its walk, or alternatives; not passed without device."""
    requirements, device = sizing.requirements, sizing.device
    # Flows as the user's catalogue states those of its valves.
    units = [part.figures["nominal_flow"].unit for part in sizing.own_valves if "nominal_flow" in part.figures]
    flow = Kind("", "kg/s", "mass flow", ".3g", given=with_condition(units[0], "ANR", sizing.gas) if units else "")
    rows = [
        (tried.valve.name, tried.actuator.name, tried.torque, tried.toes, tried.flow, tried.mass)
        for tried in sorted(sizing.tried, key=lambda tried: -tried.torque)
    ]
    remarks = ["toes below 0 would drag"] if any(tried.toes < 0.0 for tried in sizing.tried) else []
    if device is None and not any(requirements.is_reached_by(tried.torque) for tried in sizing.tried):
        torque, supply = written_text(requirements.torque, "N m"), written_text(requirements.pressure, "Pa_a")
        numbers = (f"supply.pressure={supply}", *(f"controller.{name}_torque={torque}" for name in ("peak", "largest")))
        cylinder = override_text(["device.set=cylinder-lever", *of_wearer(requirements), *numbers])
        remarks.append(f"only vanes are sized; a cylinder walks with: ppafo walk proportional {cylinder}")
    table = finding.Section(
        "Parts that were tried in a walk",
        columns_of((*_HEAD, ("gas", flow), ("mass of both", MASS)), rows),
        remarks=remarks,
        left=2,
        is_detail=device is not None,
    )
    stature = f"{requirements.height:.4g} m"
    if requirements.stature is None:
        stature += f" (assumed: a body mass index of {BODY_MASS_INDEX:g} kg/m^2; give {argument_text('stature')})"
    sentences = [f"a wearer of {requirements.mass:.4g} kg and {stature}; {requirements.text()}"]
    if requirements.toes is None and requirements.clearance < TOES:
        sentences.append(
            f"the lowest height of the toes in the healthy gait itself is {CLEARANCE.text(sizing.healthy_toes)}"
        )
    sections = (
        (finding.Section(remarks=(f"{_NONE}{_on_bottle(sizing)}. {_INSTEAD}", *sizing.instead)), table)
        if device is None
        else (*_sections(requirements, device), table, part_titles(sizing.parts))
    )
    walked = (part for tried in sizing.tried for part in (tried.valve, tried.actuator))
    return Finding(
        name="design",
        kicker="From a wearer to a device",
        title="The device",
        said=sentences,
        parts=(
            *sections,
            *parts_to_check(sizing.doubtful, sizing.parts or walked),
            finding.Section("How to read it", said=_READING, is_detail=True),
        ),
        found=sizing,
        passed=device is not None,
    )


def _on_bottle(sizing: WearerSizing) -> str:
    """Return a clause on the lightest pair that lacks only a bottle for the required time; empty without one."""
    requirements = sizing.requirements
    able = [pair for pair in sizing.tried if pair.has(requirements)]
    if not able:
        return ""
    pair = min(able, key=lambda pair: pair.mass)
    return (
        f": {pair.valve.name} with {pair.actuator.name} has the torque and the toes, but on no bottle for "
        f"{requirements.seconds / 60.0:.4g} min"
    )


def _sections(requirements: DesignRequirements, device: SizedDevice) -> tuple[finding.Section, ...]:
    walked = device.walked
    share = device.torque / requirements.torque
    # A device is granted from 95 % of the request on, so how far it fell short is said.
    short = f" ({100.0 * share:.3g} % of the request)" if share < 0.9995 else ""
    duration, lasts = duration_text(requirements.seconds), duration_text(device.life.discharge.walking_time)
    last = TORQUE.text(float(walked.peak_torques[-1]))
    rows = (
        ("controller", f"{walked.scenario.controller.kind}, walk '{WALKS[device.tried.valve.kind]}'"),
        ("lasts", f"{lasts}, of {duration}"),
        ("then", device.life.discharge.ending.message),
        ("push-off", f"{TORQUE.text(device.torque)} at the peak of the mean stride{short}, {last} in the last"),
        ("lowest toes", f"{CLEARANCE.text(device.toes)} over the ground in mid-swing"),
        ("gas", f"{Kind('', 'kg', 'gas mass', '.3g').text(walked.metrics['gas'].value)} a stride"),
        ("mass", f"{MASS.text(sum(device.masses.values()), '.0f')}, without shell, straps and hoses"),
    )
    gains = gains_of(walked.scenario, law_of(walked.scenario))
    remarks = [
        *([] if gains is None else [gains.sentence]),
        *electrical_sentences(device.electrical),
        who_walks(walk_of(walked.scenario).wearer, walk_of(walked.scenario).gait, "as requested"),
    ]
    caption, draw = _CAPTION.format(wished=duration, lasts=lasts), partial(bottle_figure, walked)
    masses = {name: MASS.text(mass, ".0f") for name, mass in device.masses.items()}
    # The content as its catalogue states it.
    if (content := device.bottle.figures.get("content")) is not None:
        gas = walked.scenario.device.gas.species
        masses[f"bottle {device.bottle.name}, full"] += f", of these {content.value:g} {content.unit} of {gas}"
    return (
        finding.Section("The walk on its bottle", facts(rows), remarks=remarks, code=device.command),
        finding.Section("Masses", facts(masses.items())),
        finding.Section("The bottle over the walk", name="bottle", caption=caption, draw=draw, is_detail=True),
    )
