"""Conditions on the settings of an exported library, as text in C."""

import itertools
import sys
from collections.abc import Sequence

from ppafo.exports.c_library.library import Condition, ExportParameter, Library
from ppafo.model.catalog import VALVES
from ppafo.model.declaration import Quantity
from ppafo.parameters.device import Device

_TIMES = ("run_output_interval", "run_step", "controller_period", "run_duration")
RULES_OF_TIMES: tuple[Condition, ...] = (
    ("is_whole(settings->run_duration / settings->run_output_interval)", "run_output_interval"),
    ("settings->run_duration / settings->run_step <= 1.0e8", "run_duration"),
    ("settings->run_duration / settings->run_output_interval <= 5.0e6", "run_duration"),
    ("settings->sensors_delay / settings->run_step <= 1.0e5", "sensors_delay"),
)
"""Rules of the times of a scenario (``simulation/clock.py``)."""


def conditions_of_program(library: Library) -> list[Condition]:
    """C conditions under which settings require another compiled program, each with the setting to report."""
    values = {setting.name: setting.value for setting in library.settings}
    conditions = []
    for names, is_above in library.switches:
        if is_above:
            # The setting that switches the program on is the one to name where all of them are 0.
            was_above = next(name for name in names if values[name] > 0.0)
            conditions.append((f"!({' || '.join(f'settings->{name} > 0.0' for name in names)})", was_above))
        else:
            conditions += [(f"settings->{name} > 0.0", name) for name in names]
    return [*conditions, *library.other_program]


def other_supply(device: Device) -> Condition:
    """C condition under which gas is drawn where the program feeds it or the reverse, and the setting to report."""
    plant = "prepared->parameters.plant"
    pressures = f"{plant}.supply_pressure", f"{plant}.dorsiflexion_pressure"
    below = " || ".join(f"{pressure} < {plant}.atmospheric_pressure" for pressure in pressures)
    return f"!({below})" if device.supply.is_vacuum else below, "supply_pressure"


def other_samples(settings: Sequence[ExportParameter], samples_inside: bool) -> list[Condition]:
    """C conditions under which samples begin or cease to lie between steps, each with the changed time to report."""
    interval = "prepared->counts.interval"
    moved = f"({interval} != (double)(int64_t){interval}) != {'true' if samples_inside else 'false'}"
    values = {setting.name: setting.value for setting in settings}
    changed = [(f"{moved} && settings->{name} != {values[name]!r}", name) for name in _TIMES]
    return [*changed, (moved, _TIMES[0])]


def limits_in_c(quantity: Quantity) -> tuple[float, float]:
    """Lowest and highest value of a setting, as representable by C literals."""
    # C can write no infinity as a literal; no setting is that large.
    return max(quantity.minimum, -sys.float_info.max), min(quantity.maximum, sys.float_info.max)


def choosing(device: Device) -> list[str]:
    """Settings of the valve for which zero or nonzero selects its functions."""
    kind = VALVES[device.valve.kind]
    names = [quantity.name for quantity in kind.quantities]
    chosen = {}
    # A valve may look only at which settings are 0, so both cases of each tell what chooses.
    for pattern in itertools.product((0.0, 0.01), repeat=len(names)):
        # The model and whether it has a dead time: both decide which program is composed.
        settings = kind.settings(*pattern)
        model = kind.choose(settings)
        chosen[pattern] = model, model.command_delay(settings) > 0.0
    return [
        name
        for index, name in enumerate(names)
        if any(chosen[pattern] != chosen[*pattern[:index], 0.0, *pattern[index + 1 :]] for pattern in chosen)
    ]
