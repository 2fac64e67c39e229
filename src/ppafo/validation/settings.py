"""Settings of a validation in SI units: motion, initial values, delay limit and error limits."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from ppafo.errors import DataError, UnitError, refused_as
from ppafo.parameters.device import Device
from ppafo.simulation.scenario import Leg
from ppafo.units import parse_quantity
from ppafo.validation.compared import ANGLE, PRESSURE_1, PRESSURE_2, Thresholds, parse_thresholds
from ppafo.validation.replay import MOTIONS, Motion
from ppafo.wording import argument_text, known_names, nearest_name, one_line

DEFAULT_LIMIT = 0.02
"""Default limit of the estimated delay [s]; sensors, filters and valves lag less."""
LARGEST_DELAY = 1.0
"""Largest delay limit that a user may set [s]."""
_UNITS = {ANGLE: "rad", PRESSURE_1: "Pa_a", PRESSURE_2: "Pa_a"}
"""Unit of an initial value by channel."""
_EXAMPLES = {ANGLE: "angle=75 deg", PRESSURE_1: "pressure_1=0 psi_g", PRESSURE_2: "pressure_2=50 psi_g"}


@dataclass(frozen=True, slots=True)
class ReplaySettings:
    """Settings of the replay and of the acceptance limits.

    ``motion`` is ``free`` for a vane that moves as the model demands, ``measured`` for the recorded angle as prescribed
    motion, ``locked`` for a vane fixed at its initial angle, or ``leg`` for a vane with the foot of ``leg`` (default:
    the fixture of figure 7). With a ``volume`` [m^3] chamber 1 is a fixed volume that the valve fills and vents,
    without a vane. ``initial`` values [SI] by channel override the first samples. ``longest_delay`` [s] limits the
    estimated delay.
    """

    motion: Motion = "free"
    initial: Mapping[str, float] = field(default_factory=dict)
    longest_delay: float = DEFAULT_LIMIT
    thresholds: Thresholds = field(default_factory=parse_thresholds)
    volume: float | None = None
    leg: Leg | None = None


def replay_settings(
    device: Device,
    motion: str,
    volume: float | None,
    initial: Sequence[str],
    thresholds: Sequence[str],
    longest_delay: float,
) -> ReplaySettings:
    """Check the arguments of a validation and return its settings. Raises DataError for contradictions."""
    if volume is not None and not volume > 0.0:
        raise DataError(f"volume = {volume:g} m^3: must be above 0")
    if not 0.0 <= longest_delay <= LARGEST_DELAY:
        raise DataError(f"longest delay = {longest_delay:g} s: must be from 0 to {LARGEST_DELAY:g} s")
    chosen = next((known for known in MOTIONS if known == motion), None)
    if chosen is None:
        hint = nearest_name(motion, MOTIONS)
        raise DataError(f"motion '{one_line(motion)}': must be one of {', '.join(MOTIONS)}{hint}")
    if volume is not None and chosen != "free":
        raise DataError(f"motion '{chosen}': a fixed volume has no moving vane; give motion or volume, not both")
    states = parse_initial(initial, device.supply.atmospheric_pressure)
    return ReplaySettings(chosen, states, longest_delay, parse_thresholds(thresholds), volume)


def parse_initial(texts: Sequence[str], atmosphere: float) -> dict[str, float]:
    """Parse initial values [SI] by channel, from texts such as ``pressure_1=0 psi_g``.

    Gauge pressures are relative to ``atmosphere`` [Pa absolute]. Raises DataError for an unknown channel, unit or form.
    """
    values = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.partition("="))
        if not equals:
            raise DataError(
                f"initial value '{one_line(text)}' is not of the form CHANNEL=VALUE, for example '{_EXAMPLES[ANGLE]}'"
            )
        if name not in _UNITS:
            raise DataError(
                f"initial value '{one_line(text)}': there is no channel '{one_line(name)}'{known_names(name, _UNITS)}"
            )
        with refused_as(DataError, f"initial value '{one_line(text)}'", UnitError):
            values[name] = parse_quantity(value, _UNITS[name], atmosphere)
    return values


def initial_remedies() -> dict[str, str]:
    """Return by channel the remedy for an initial value that was not recorded."""
    return {name: f"give its initial value, {argument_text('initial', example)}" for name, example in _EXAMPLES.items()}
