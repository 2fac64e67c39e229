"""Short walks with a valve and an actuator at constant supply: torque, toe clearance and gas flow.

A torque controller is given the lowest request with which the device provides the required torque. If the toes would
not clear the ground, the foot is lifted earlier and with more torque.
"""

from ppafo.analyses.design.wearer.requirements import WALKS, DesignRequirements, WalkedDevice
from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.model.catalog import VALVES
from ppafo.parameters.declaration import ACTUATOR, ORIFICE, SPECIES_PATH
from ppafo.parameters.parts import Part
from ppafo.units.shown import written_text
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import walk_of
from ppafo.walking.walk import walk

_REQUESTS = (1.0, 1.3, 1.7)
"""Ratios of requested to required torque, tried in turn, because the torque lags behind its reference."""
_ABOVE = 1.1
"""Ratio of torque limit to required torque: above its limit, a pair of on/off valves vents the chamber."""
_MINUTES = 0.15
"""Minutes of the walks compared at constant supply: a few strides after the transient."""
_DORSIFLEXION = 0.9
"""Gauge pressure of dorsiflexion divided by plantarflexion, for walks with regulators: 45 of 50 psi."""
_EARLY_LIFT = ("controller.swing_peak_time=0.73", "controller.swing_rise_time=0.1", "controller.swing_fall_time=0.2")
"""Overrides for an earlier foot lift from toe-off, used if toes do not clear the ground with the walk's own lift."""
_OF_ACTUATOR = ("torque_constant", "displacement_per_radian")
"""Catalogue figures of an actuator that a walk adopts."""
_PROPORTIONAL = "proportional"
"""Valve type that a torque controller needs; solenoid valves only limit the torque."""


def of_wearer(requirements: DesignRequirements) -> tuple[str, ...]:
    """Return the overrides of a walk for the wearer of the requirements, and for the wearer's gait if it is given."""
    wearer = (f"wearer.body_mass={requirements.mass:.6g} kg", f"wearer.stature={requirements.height:.6g} m")
    return wearer if requirements.gait is None else (*wearer, f"gait={requirements.gait}")


def few_strides(requirements: DesignRequirements, valve: Part, actuator: Part) -> list[WalkedDevice]:
    """Return strides of a pair of parts that meet the required torque and toe clearance, else the nearest strides.

    Nearest are the strides with the most torque, and the strides with the highest toes and enough torque: one or two
    results, none if no walk provides help.
    """
    settings = load_walk(WALKS[valve.kind]).controller.settings
    common = _common_overrides(requirements, valve, actuator)
    strides: list[WalkedDevice] = []
    is_followed = valve.kind == _PROPORTIONAL
    own_limit = float(settings["largest_torque"])
    # No request above what the supply pressure can hold with this actuator; those that are equal then are one.
    static_torque = actuator.values["torque_constant"] * (requirements.pressure - STANDARD_ATMOSPHERE)
    requests = [_ABOVE * requirements.torque]
    if is_followed:
        requests = list(dict.fromkeys(min(factor * requirements.torque, static_torque) for factor in _REQUESTS))
    for request in requests:
        # Requests and limits as their overrides have them, with four digits.
        rounded = float(f"{request:.4g}")
        text = written_text(rounded, "N m")
        limit = (f"controller.largest_torque={text}",) if request > own_limit else ()
        peak: tuple[str, ...] = ()
        lifts: list[tuple[str, ...]] = [()]
        if is_followed:
            # The lift in the swing: the walk's own, then one that begins at toe-off, with all torque.
            torque = float(f"{min(_DORSIFLEXION * static_torque, max(rounded, own_limit)):.4g}")
            peak = (f"controller.peak_torque={text}",)
            lifts = [(), (f"controller.swing_peak_torque={written_text(torque, 'N m')}", *_EARLY_LIFT)]
        for lift in lifts:
            overrides = (*common, *peak, *limit, *lift)
            result = walk(load_walk(WALKS[valve.kind], overrides), minutes=_MINUTES)
            # Strides without help say nothing, nor do those of a torque loop that oscillates.
            if not (result.status.is_completed and result.averages) or result.tracking:
                break
            flow = result.metrics["gas"].value / walk_of(result.scenario).gait.stride_time
            mean_peak, toes = float(result.averages["torque"].mean.max()), result.metrics["lowest_toes"].value
            tried = WalkedDevice(valve, actuator, overrides, mean_peak, flow, toes)
            # A request that has all of the torque goes before one that all but reaches it.
            if tried.torque >= requirements.torque and tried.has(requirements):
                return [tried]
            strides.append(tried)
            # Another lift gives no more torque.
            if tried.torque < requirements.torque:
                break
    if not strides:
        return []
    strongest = max(strides, key=lambda tried: tried.torque)
    highest = max(strides, key=lambda tried: (min(tried.torque, requirements.torque), tried.toes))
    return [strongest] if highest is strongest else [strongest, highest]


def _common_overrides(requirements: DesignRequirements, valve: Part, actuator: Part) -> tuple[str, ...]:
    """Return the overrides common to all walks with a pair: wearer, supply, figures of the parts."""
    dorsiflexion = STANDARD_ATMOSPHERE + _DORSIFLEXION * (requirements.pressure - STANDARD_ATMOSPHERE)
    units = {quantity.name: quantity.unit for quantity in (*ORIFICE, *VALVES[valve.kind].quantities, *ACTUATOR)}
    numbers = {**valve.model_numbers, **{f"actuator.{name}": actuator.values[name] for name in _OF_ACTUATOR}}
    return (
        *of_wearer(requirements),
        *((f"{SPECIES_PATH}={requirements.gas}",) if requirements.gas else ()),
        f"supply.pressure={written_text(requirements.pressure, 'Pa_a')}",
        f"supply.dorsiflexion_pressure={written_text(dorsiflexion, 'Pa_a')}",
        *(f"{path}={written_text(number, units[path.partition('.')[2]])}" for path, number in numbers.items()),
    )
