"""The kind of several devices: what is common, how they spread, and the set of the next one."""

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.answers import Answer, Column, Figure, Section, Table
from ppafo.answers.display_units import typeset_unit
from ppafo.answers.style import BLACK, BLUE, GREY, VERMILION, house_style, mark_kind
from ppafo.identification.devices import Spread, coefficient_of_variation
from ppafo.identification.estimate import half_width_for
from ppafo.identification.new_set import in_set_unit
from ppafo.live.words import label_of
from ppafo.parameters.loading import list_sets, parameter_set_toml
from ppafo.parameters.parameter_set import CONFIDENCE, ParameterSet
from ppafo.questions.question import Solved
from ppafo.signals import RecordingKind
from ppafo.version import __version__

if TYPE_CHECKING:
    import matplotlib.figure
    from matplotlib.axes import Axes

NEXT = "next-device"


@dataclass(frozen=True, slots=True)
class DeviceValue:
    """What one device was identified with: its name, the value and half its 95 % interval [SI].

    ``is_identified`` is false of a value that is weak or holds for its model only.
    """

    device: str
    value: float
    half_width: float
    is_identified: bool


@dataclass(frozen=True, slots=True)
class PooledNumber:
    """One number of several devices, in ``unit`` (SI text); ``pooled`` is of its logarithm where ``is_logarithmic``.

    ``apart`` are devices that the others do not expect; ``limits`` what the number may be at all.
    """

    path: str
    unit: str
    values: tuple[DeviceValue, ...]
    is_logarithmic: bool
    pooled: Spread
    apart: tuple[str, ...]
    limits: tuple[float, float]

    def number(self, at: float) -> float:
        """Return a number of the scale that was pooled as a value [SI]."""
        return math.exp(at) if self.is_logarithmic else at

    @property
    def mean(self) -> float:
        """Mean of the kind [SI], geometric where the logarithm was pooled."""
        return self.number(self.pooled.mean)

    @property
    def next_device(self) -> tuple[float, float]:
        """Interval of the next device [SI], within what the number may be."""
        low, high = self.pooled.next_device
        return max(self.number(low), self.limits[0]), min(self.number(high), self.limits[1])

    @property
    def mean_interval(self) -> tuple[float, float]:
        """Interval of the mean [SI]."""
        low, high = self.pooled.mean_interval
        return self.number(low), self.number(high)

    def spread(self, deviation: float) -> float:
        """Return a standard deviation: over the mean [-] where the logarithm was pooled, else in SI."""
        return coefficient_of_variation(deviation) if self.is_logarithmic else deviation


@dataclass(frozen=True, repr=False)
class DeviceSpread(Solved):
    """Several devices of one kind, number by number.

    ``fewer`` are numbers that fewer than three devices have, ``inherited`` those that came with the set that they
    started from. ``first`` is the set of the first device, whose units are shown; ``kind`` that of the recordings.
    """

    devices: tuple[str, ...]
    numbers: tuple[PooledNumber, ...]
    fewer: tuple[str, ...]
    inherited: tuple[str, ...]
    confidence: float
    first: ParameterSet
    kind: RecordingKind = "measured"

    @cached_property
    def next_set(self) -> ParameterSet:
        """The set of the first device with the mean of each number, and what the next device may differ by."""
        numbers = dict(self.first.numbers)
        for one in self.numbers:
            low, value, high = (self.shown(one, at) for at in (one.next_device[0], one.mean, one.next_device[1]))
            half = half_width_for(CONFIDENCE, max(high - value, value - low), self.confidence)
            numbers[one.path] = numbers[one.path].model_copy(
                update={
                    "value": value,
                    "uncertainty": half,
                    "origin": "fitted",
                    "source": f"{len(one.values)} devices: {', '.join(item.device for item in one.values)}",
                    "note": f"mean of the kind; the uncertainty is that of the next device, {_interval(low, high)} "
                    f"with {100.0 * self.confidence:g} % confidence, for a study with kind 'stated'",
                }
            )
        return replace(
            self.first,
            file=f"{NEXT}.toml",
            name=NEXT,
            title=f"The next device after {len(self.devices)} of its kind",
            parent=self.first.parent if self.first.parent in list_sets() else "",
            numbers=numbers,
        )

    def shown(self, one: PooledNumber, value: float) -> float:
        """Return a value of a number [SI] in the unit of the first device."""
        return in_set_unit(value, one.path, one.unit, self.first)[0]

    def unit(self, one: PooledNumber) -> str:
        """Return the unit in which a number is shown."""
        return in_set_unit(one.mean, one.path, one.unit, self.first)[1]


def answer_of(found: DeviceSpread) -> Answer:
    """Return the answer: mean, spread and next device of each number, what is common, and who is apart."""
    confidence = f"{100.0 * found.confidence:g} %"
    head = ("", "devices", "mean", f"{confidence} interval", "spread", f"{confidence} interval", "the next device")
    rows = tuple(_row(found, one) for one in found.numbers)
    remarks = [f"{path}: fewer than three devices have a value of their own: no spread" for path in found.fewer]
    remarks += [
        f"{path}: several sets have the same value from the same source: not their own" for path in found.inherited
    ]
    for one in found.numbers:
        weak = [item.device for item in one.values if not item.is_identified]
        missing = [name for name in found.devices if name not in [item.device for item in one.values]]
        if missing:
            remarks.append(f"{one.path}: no value of its own: {', '.join(missing)}; the mean is that of the others")
        if weak:
            remarks.append(f"{one.path}: weak, or valid for its model only: {', '.join(weak)}")
    caption = "Each device with its 95 % interval, the mean with its interval, and where the next device lies."
    return Answer(
        name="devices",
        kicker="Devices of one kind",
        title=f"What {len(found.devices)} devices have in common, and how they spread",
        lead=tuple(_sentence(found, one) for one in found.numbers),
        sections=(
            Section(
                "Number by number",
                table=Table(tuple(Column(title) for title in head), rows),
                remarks=tuple(f"remark: {remark}" for remark in remarks),
                figure=Figure("devices", caption, lambda: draw(found)),
            ),
        ),
        data=_data(found),
        kind=found.kind,
        files={f"{NEXT}.toml": lambda: parameter_set_toml(found.next_set).encode()},
    )


def _interval(low: float, high: float, width: float | None = None) -> str:
    digits = _digits(low, high if width is None else low + width)
    return f"{low:#.{digits}g} to {high:#.{digits}g}"


def _digits(low: float, high: float) -> int:
    """Return the digits that distinguish the ends of an interval, three at least."""
    size, width = max(abs(low), abs(high)), abs(high - low)
    return 3 if width == 0.0 else min(max(3, math.ceil(math.log10(size / width)) + 2), 9)


def _row(found: DeviceSpread, one: PooledNumber) -> tuple[str, ...]:
    mean, low, high = (found.shown(one, at) for at in (one.mean, *one.mean_interval))
    following = [found.shown(one, at) for at in one.next_device]
    unit = found.unit(one)
    spreads = [_spread_text(found, one, at) for at in (one.pooled.spread, *one.pooled.spread_interval)]
    return (
        one.path,
        str(len(one.values)),
        f"{mean:#.{_digits(low, high)}g} {unit}".rstrip(),
        _interval(low, high),
        spreads[0],
        f"{spreads[1].split(' ')[0]} to {spreads[2]}",
        f"{_interval(following[0], following[1])} {unit}".rstrip(),
    )


def _spread_text(found: DeviceSpread, one: PooledNumber, deviation: float) -> str:
    if one.is_logarithmic:
        return f"{100.0 * one.spread(deviation):.2g} %"
    here = found.shown(one, one.mean)
    return f"{abs(found.shown(one, one.mean + deviation) - here):.2g} {found.unit(one)}".rstrip()


def _sentence(found: DeviceSpread, one: PooledNumber) -> str:
    """Return in words whether devices differ in a number, where the next one lies, and which device is apart."""
    pooled, count = one.pooled, len(one.values)
    limit = _spread_text(found, one, pooled.spread_interval[1])
    if pooled.is_common:
        said = (
            f"no difference between {count} devices shows (chance {pooled.chance:.2g}); they spread by at most {limit}"
        )
    else:
        low = _spread_text(found, one, pooled.spread_interval[0]).split(" ")[0]
        said = f"{count} devices spread by {_spread_text(found, one, pooled.spread)} ({low} to {limit})"
    following = [found.shown(one, at) for at in one.next_device]
    text = f"{one.path}: {said}; the next device: {_interval(*following)} {found.unit(one)}".rstrip()
    if not one.apart:
        return text
    names = ", ".join(one.apart)
    return f"{text}; {names} {'is an outlier: check it' if len(one.apart) == 1 else 'are outliers: check them'} first"


def _data(found: DeviceSpread) -> dict[str, Any]:
    return {
        "format": "ppafo devices",
        "schema_version": 1,
        "devices": list(found.devices),
        "confidence": found.confidence,
        "numbers": [
            {
                "path": one.path,
                "unit": one.unit,
                "scale": "log" if one.is_logarithmic else "linear",
                "values": [
                    {
                        "device": item.device,
                        "value": item.value,
                        "low": item.value - item.half_width,
                        "high": item.value + item.half_width,
                        "is_identified": item.is_identified,
                    }
                    for item in one.values
                ],
                "mean": one.mean,
                "mean_interval": list(one.mean_interval),
                "spread": one.spread(one.pooled.spread),
                "spread_interval": [one.spread(at) for at in one.pooled.spread_interval],
                "spread_is": "fraction of the mean" if one.is_logarithmic else "in unit",
                "next_device": list(one.next_device),
                "chance_if_all_alike": one.pooled.chance,
                "shows_no_difference": one.pooled.is_common,
                "apart": list(one.apart),
            }
            for one in found.numbers
        ],
        "fewer_than_three": list(found.fewer),
        "inherited": list(found.inherited),
        "next_set": f"{NEXT}.toml",
        "versions": {"ppafo": __version__},
    }


_COLUMNS, _WIDTH, _ROW, _NAMES, _GAP, _TOP, _BOTTOM = 3, 2.6, 0.24, 1.1, 0.35, 0.55, 0.35
"""Panels beside each other; inches of a panel, of a device, of names, between panels, above and below."""


def draw(found: DeviceSpread) -> "matplotlib.figure.Figure":
    """Return a panel for each number: devices with their intervals, the mean, the next device."""
    import matplotlib.figure

    columns = min(_COLUMNS, len(found.numbers))
    rows = -(-len(found.numbers) // columns)
    panel = _ROW * (len(found.devices) + 2)
    # Names are as wide as their letters.
    names = max(_NAMES, 0.085 * max(len(name) for name in found.devices) + 0.2)
    width = names + columns * (_WIDTH + _GAP)
    height = rows * (panel + _TOP + _BOTTOM)
    with house_style():
        figure = matplotlib.figure.Figure(figsize=(width, height))
        for index, one in enumerate(found.numbers):
            row, column = divmod(index, columns)
            left = names + column * (_WIDTH + _GAP)
            bottom = height - (row + 1) * (panel + _TOP + _BOTTOM) + _BOTTOM
            axes = figure.add_axes((left / width, bottom / height, _WIDTH / width, panel / height))
            _draw_number(axes, found, one, is_first=column == 0)
        mark_kind(figure, found.kind)
        return figure


def _draw_number(axes: "Axes", found: DeviceSpread, one: PooledNumber, is_first: bool) -> None:
    places = {name: place for place, name in enumerate(found.devices)}
    for item in one.values:
        low, at, high = (found.shown(one, item.value + sign * item.half_width) for sign in (-1.0, 0.0, 1.0))
        colour = VERMILION if item.device in one.apart else BLACK
        axes.plot([low, high], [places[item.device]] * 2, color=colour, linewidth=1.2)
        axes.plot([at], [places[item.device]], "o", color=colour, markersize=4)
    count = len(found.devices)
    mean = [found.shown(one, at) for at in one.mean_interval]
    following = [found.shown(one, at) for at in one.next_device]
    axes.axvspan(*following, color=BLUE, alpha=0.08, linewidth=0.0)
    axes.plot(mean, [count] * 2, color=BLUE, linewidth=2.5)
    axes.plot([found.shown(one, one.mean)], [count], "D", color=BLUE, markersize=5)
    axes.plot(following, [count + 1] * 2, color=BLUE, linewidth=1.2)
    axes.set_yticks(np.arange(count + 2), [*found.devices, "mean", "next device"] if is_first else [""] * (count + 2))
    axes.set_ylim(count + 1.6, -0.6)
    axes.axhline(count - 0.5, color=GREY, linewidth=0.6)
    axes.grid(visible=False, axis="y")
    unit = found.unit(one)
    group, _, name = one.path.rpartition(".")
    # Two valves may have a number of the same name.
    owner = f", {group.removeprefix('valves.')}" if group.startswith("valves.") else ""
    label = label_of(f"valve.{name}" if owner else one.path)
    axes.set_title(f"{label}{owner}" + (f" ({typeset_unit(unit)})" if unit not in ("", "-") else ""), fontsize=9.5)
    axes.locator_params(axis="x", nbins=5)
    axes.ticklabel_format(axis="x", useOffset=False)
