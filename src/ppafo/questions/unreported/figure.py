"""The figure on what the paper left unsaid: what was allowed, what is left, and where 15 percent come from."""

import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Protocol

import numpy as np

from ppafo.answers.style import BLACK, BLUE, GREY, VERMILION, house_style, mark_kind
from ppafo.questions.unreported.settings import (
    ATTITUDE,
    DEAD_VOLUME,
    DELAY,
    DISCHARGE,
    DORSIFLEXION,
    HOLD,
    LEVEL,
    MASS_CENTRE,
    ON_OFF_RATE,
    PID_RATE,
    PROPORTIONAL,
    QUIET,
    SETTINGS,
    SOLENOID,
    START,
    STEP_RUN,
    SUPPLY,
    VOLTS,
    VOLUME,
    Draws,
    Floats,
    Metrics,
    Setting,
    agreement_with,
    demand_over_ceiling,
    effective,
    improvement,
    in_si,
    saving,
)
from ppafo.simulation.loading import load_scenario

if TYPE_CHECKING:
    import matplotlib.figure
    from matplotlib.axes import Axes

_SIZE = (9.8, 11.6)
_COLUMNS = 4
_GRID = 240
"""Points of a smoothed density."""
_SHOWN_DOTS = 4000
_TICKS, _NEAR_TICKS = (0.3, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0), (15.0, 20.0, 30.0, 50.0)
_PRINTED_REGION = (12.0, 18.0)
"""Improvement in percent that counts as the printed 15."""
_REGION_GRID, _NEAR = 60, 0.07
"""Points of the region either way, and how far around each completions count, as a fraction of the range."""
_FRACTIONS, _SHADES = (0.05, 0.1, 0.2), ("#e3f0f8", "#c3dff0", "#9fcbe6")
"""Fractions of completions from which on the region takes each shade."""


class Weighed(Protocol):
    """Completions with their weights: draws by setting, metrics by valve, how many are spread evenly."""

    @property
    def draws(self) -> Draws:
        """Values of every setting, by name (draws,)."""

    @property
    def metrics(self) -> Metrics:
        """Metrics by valve and name (draws,)."""

    @property
    def weights(self) -> Floats:
        """Weights that add up to 1 (draws,)."""

    @property
    def even(self) -> int:
        """How many of the first completions are spread evenly."""

    @property
    def effective(self) -> float:
        """Effective sample size [-]."""


def draw_settings(
    family: Weighed, verdicts: Sequence[str], fractions: Mapping[str, Sequence[float]]
) -> "matplotlib.figure.Figure":
    """Return a panel for each setting, one of the two main results, and one of the level over the supply pressure.

    ``verdicts`` are those of the settings, in their order; ``fractions`` what is left of each choice, by setting.
    """
    import matplotlib.figure

    with house_style():
        figure = matplotlib.figure.Figure(figsize=_SIZE)
        rows = -(-(len(SETTINGS) + 2) // _COLUMNS)
        figure.subplots_adjust(left=0.045, right=0.98, top=0.91, bottom=0.06, hspace=0.7, wspace=0.26)
        grid = figure.add_gridspec(rows, _COLUMNS)
        panels = [figure.add_subplot(grid[divmod(place, _COLUMNS)]) for place in range(len(SETTINGS))]
        shipped = shipped_values()
        for axes, setting, verdict in zip(panels, SETTINGS, verdicts, strict=False):
            axes.set_title(f"{setting.name}{f' ({_unit(setting.unit)})' if setting.unit else ''}", fontsize=9.5)
            axes.set_xlabel(verdict, fontsize=9, color=BLUE if verdict == "implied" else GREY)
            axes.set_yticks([])
            if setting.choices:
                _draw_choices(axes, setting, fractions[setting.name], shipped[setting.name])
            else:
                _draw_number(axes, setting, family, shipped[setting.name])
        _draw_results(figure.add_subplot(grid[-1, : _COLUMNS // 2]), family)
        _draw_region(figure.add_subplot(grid[-1, _COLUMNS // 2 :]), family, shipped)
        figure.text(
            0.012,
            0.987,
            f"What the paper left unsaid (effective sample size {family.effective:.0f})\n"
            "grey: allowed; blue: left by what is reported; black: the scenarios of the package",
            va="top",
            fontsize=11,
            linespacing=1.4,
        )
        mark_kind(figure, "simulated")
        return figure


def shipped_values() -> dict[str, float]:
    """Return the value of each setting, in its shown unit, in the experiments that come with the package."""
    solenoid, proportional = (load_scenario(f"torque-task-{valve}") for valve in (SOLENOID, PROPORTIONAL))
    leg = load_scenario("step-response", STEP_RUN).motion.leg  # type: ignore[union-attr]  # the vane is free
    assert leg is not None, "the step response has a leg"
    device, reference = solenoid.device, solenoid.reference.settings
    held = solenoid.motion.profile.settings["level"]  # type: ignore[union-attr]  # the ankle is held
    return {
        LEVEL: reference["level"],
        "ramp time": reference["ramp_time"],
        HOLD: solenoid.duration - reference["ramp_time"],
        "angle": _shown(held, "deg"),
        VOLUME: _shown(device.actuator.volume_per_angle, "cm^3/rad"),
        DEAD_VOLUME: _shown(device.actuator.dead_volume_1, "cm^3"),
        SUPPLY: _shown(device.supply.pressure, "psi_g"),
        DORSIFLEXION: _shown(device.supply.dorsiflexion_pressure, "psi_g"),
        START: reference["start_level"],
        DELAY: _shown(device.valve.settings["opening_delay"], "ms"),
        ATTITUDE: _shown(leg.shank.settings["level"], "deg"),
        MASS_CENTRE: _shown(leg.foot_mass_centre, "cm"),
        DISCHARGE: 0.0,
        VOLTS: 1.0,
        PID_RATE: 1.0 / proportional.control.period,
        ON_OFF_RATE: 1.0 / solenoid.control.period,
    }


def _shown(value: float, unit: str) -> float:
    """Return a value in SI in a shown unit."""
    zero, one = in_si(np.array([0.0, 1.0]), unit)
    return float((value - zero) / (one - zero))


def _unit(unit: str) -> str:
    return unit.replace("psi_g", "psig").replace("^3", "³")


def _draw_choices(axes: "Axes", setting: Setting, fractions: Sequence[float], shipped: float) -> None:
    places = np.arange(len(setting.choices))
    axes.bar(places, np.full(places.size, 1.0 / places.size), width=0.85, color=GREY, alpha=0.3)
    axes.bar(places, fractions, width=0.5, color=BLUE)
    axes.plot(
        int(np.argmin(np.abs(np.array(setting.choices) - shipped))), 0.0, "^", color=BLACK, clip_on=False, zorder=5
    )
    names = setting.words or [f"{choice:g}" for choice in setting.choices]
    axes.set_xticks(places, [_short(name) for name in names], fontsize=7.5)


def _draw_number(axes: "Axes", setting: Setting, family: Weighed, shipped: float) -> None:
    """Draw the density that is left, smoothed, over the even one."""
    scale = np.log10 if setting.is_logarithmic else np.asarray
    low, high = float(scale(setting.low)), float(scale(setting.high))
    grid = np.linspace(low, high, _GRID)
    axes.fill_between([low, high], [1.0 / (high - low)] * 2, color=GREY, alpha=0.3, linewidth=0.0)
    has_weight = family.weights > 0.0
    if np.any(has_weight):
        left = smoothed_density(scale(family.draws[setting.name][has_weight]), family.weights[has_weight], grid)
        axes.fill_between(grid, left, color=BLUE, alpha=0.35, linewidth=0.0)
        axes.plot(grid, left, color=BLUE, linewidth=1.4)
    axes.axvline(float(scale(min(max(shipped, setting.low), setting.high))), color=BLACK, linewidth=1.2)
    axes.set_ylim(bottom=0.0)
    if setting.is_logarithmic:
        named = _TICKS if setting.high > 5.0 * setting.low else _NEAR_TICKS
        ticks = np.array([tick for tick in named if setting.low <= tick <= setting.high])
        axes.set_xticks(np.log10(ticks), [f"{tick:g}" for tick in ticks])


def smoothed_density(values: Floats, weights: Floats, grid: Floats) -> Floats:
    """Return a density on an even grid from weighted values, reflected at the ends of the grid, where the values end.

    Bells of a width by Scott's rule, around the cells of the grid: no slower for many values.
    """
    share, places = weights / weights.sum(), np.rint((values - grid[0]) / (grid[1] - grid[0])).astype(np.intp)
    width = effective(share) ** -0.2 * math.sqrt(float(share @ (values - share @ values) ** 2))
    if width == 0.0:
        return np.zeros(grid.size)
    width = max(width, grid[1] - grid[0])
    cells = np.bincount(places, weights=share, minlength=grid.size)
    mirrors = (grid, 2.0 * grid[0] - grid, 2.0 * grid[-1] - grid)
    bells = sum(np.exp(-0.5 * ((grid[:, None] - centres) / width) ** 2) for centres in mirrors)
    return np.asarray(bells @ cells / (width * math.sqrt(2.0 * math.pi)))


def _short(words: str) -> str:
    """Return the words on two lines."""
    parts = words.split()
    half = math.ceil(len(parts) / 2)
    return "\n".join(filter(None, (" ".join(parts[:half]), " ".join(parts[half:]))))


def _draw_results(axes: "Axes", family: Weighed) -> None:
    better, less = improvement(family.metrics), saving(family.metrics)
    even = slice(0, min(family.even, _SHOWN_DOTS))
    axes.plot(less[even], better[even], ".", markersize=1.5, color=GREY, alpha=0.5)
    likely = np.argsort(-family.weights)[: _SHOWN_DOTS // 8]
    likely = likely[family.weights[likely] > 0.0]
    axes.plot(less[likely], better[likely], ".", markersize=2.0, color=BLUE)
    axes.plot([63.0], [15.0], "+", markersize=11, markeredgewidth=1.6, color=VERMILION)
    axes.set_xlim(-20.0, 100.0)
    axes.set_ylim(-60.0, 60.0)
    axes.set_title("improvement (%) over saving (%)", fontsize=9.5)
    axes.set_xlabel("+ the paper", fontsize=9, color=VERMILION)


def _draw_region(axes: "Axes", family: Weighed, shipped: Mapping[str, float]) -> None:
    """Draw where the improvement is about the printed one, under the printed readings, and what the supply holds.

    Completions in which the proportional valve oscillates on the ramp are left out, as in the answer's last remark.
    """
    low, high = _PRINTED_REGION
    quiet = agreement_with(QUIET, family.metrics) > 0.0
    shown = quiet & (np.arange(family.draws[LEVEL].size) < family.even)
    for name in (VOLTS, DISCHARGE, ON_OFF_RATE):
        shown &= np.isclose(family.draws[name], shipped[name])
    better, pressure, level = (
        values[shown] for values in (improvement(family.metrics), family.draws[SUPPLY], family.draws[LEVEL])
    )
    printed = (better >= low) & (better <= high)
    if printed.any():
        # The fraction of completions near each point whose improvement is about the printed one.
        ranges = [
            (setting.low, setting.high) for name in (SUPPLY, LEVEL) for setting in SETTINGS if setting.name == name
        ]
        across, up = (np.linspace(*ends, _REGION_GRID) for ends in ranges)
        apart = [
            (grid[:, None] - values) / (_NEAR * (end - start))
            for grid, values, (start, end) in zip((across, up), (pressure, level), ranges, strict=True)
        ]
        bells = np.exp(-0.5 * (apart[0][None, :] ** 2 + apart[1][:, None] ** 2))
        fractions = bells @ printed / bells.sum(axis=2)
        axes.contourf(across, up, fractions, _FRACTIONS, colors=_SHADES, extend="max")
    axes.plot(pressure[~printed], level[~printed], ".", markersize=1.6, color=GREY, alpha=0.6)
    axes.plot(pressure[printed], level[printed], "o", markersize=3.6, color=BLUE, markeredgewidth=0.0)
    ends = np.array([45.0, 60.0])
    axes.plot(ends, 1.0 / demand_over_ceiling({LEVEL: np.ones(2), SUPPLY: ends}), "--", color=BLACK, linewidth=1.2)
    axes.plot([shipped[SUPPLY]], [shipped[LEVEL]], "^", color=BLACK, markersize=6)
    axes.set_title("reference level (N m) over source pressure (psig)", fontsize=9.5)
    shades = ", ".join(f"{100 * fraction:.0f}" for fraction in _FRACTIONS)
    axes.set_xlabel(
        f"blue dots: {low:g} to {high:g} % better; shaded: more than {shades} % of the completions\n"
        "dashed: what the supply holds; triangle: the scenario of the package",
        fontsize=8.0,
        color=GREY,
    )
