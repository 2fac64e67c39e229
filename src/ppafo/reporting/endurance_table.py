"""Several gas uses on one bottle, side by side."""

from collections.abc import Mapping, Sequence

from ppafo.constants import GRAMS_PER_KILOGRAM, PASCALS_PER_PSI
from ppafo.reporting.endurance_figure import minutes_text
from ppafo.reporting.text_table import text_table
from ppafo.studies.endurance import Discharge, Endurance, Reuse
from ppafo.studies.endurance.reuse import GIVEN
from ppafo.units import from_si


def endurance_table(made: Mapping[str, Endurance]) -> list[str]:
    """Return a line for each gas use, by name; with what reuse of the exhaust saves where it was asked for."""
    first = next(iter(made.values()))
    rows = [[name, *_cells(one)] for name, one in made.items()]
    return [first.bottle.title, "", *text_table(_head(first), rows), *_origins(made)]


def _head(one: Endurance) -> Sequence[str]:
    course = ("min", "steps", "ended")
    if one.reuse is None:
        return ("gas use", "g a step", *course)
    return ("gas use", "g a step", "min", "steps", "g saved", "min with", "steps with", "ended")


def _cells(one: Endurance) -> list[str]:
    if one.reuse is None or one.without_reuse is None:
        return [_grams(one.draw.mass_per_step), *_course(one.discharge), one.discharge.ending.kind]
    saved = one.reuse.balance.returned_mass
    before = [_grams(one.draw.mass_per_step + saved), *_course(one.without_reuse)]
    return [*before, _grams(saved), *_course(one.discharge), one.discharge.ending.kind]


def _course(course: Discharge) -> list[str]:
    return [minutes_text(course.walking_time), f"{course.steps:.0f}"]


def _origins(made: Mapping[str, Endurance]) -> list[str]:
    """Return where the chambers' pressures and volumes come from, for each gas use."""
    lines = []
    for name, one in made.items():
        if one.reuse is not None:
            lines.append(f"{name}: {chambers_sentence(one.reuse)}")
    return ["", *lines] if lines else []


def chambers_sentence(reused: Reuse) -> str:
    """Return what the chambers hold when they vent and when they are filled, and where the numbers come from."""
    cycle = reused.cycle
    exhaust = f"exhaust at {_psi(cycle.exhaust_pressure)} in {_volume(cycle.exhaust_volume)}"
    fill = f"filled to {_psi(cycle.fill_pressure)} in {_volume(cycle.fill_volume)}"
    return f"{exhaust}, {fill}, {_origin(reused)}"


def _origin(reused: Reuse) -> str:
    """Return where the values of the chambers come from, once where it is the same for all."""
    origins = {name: text for name, text in reused.origins.items() if name != "reservoir_volume"}
    if len(set(origins.values())) == 1:
        return next(iter(origins.values()))
    given = ", ".join(name for name, text in origins.items() if text == GIVEN)
    return f"{next(text for text in origins.values() if text != GIVEN)}; {given} {GIVEN}"


def _grams(kilograms: float) -> str:
    return f"{kilograms * GRAMS_PER_KILOGRAM:.3g}"


def _psi(pressure: float) -> str:
    return f"{pressure / PASCALS_PER_PSI:.1f} psi absolute"


def _volume(volume: float) -> str:
    return f"{from_si(volume, 'cm^3', 'm^3'):.1f} cm^3"
