"""Recording: time and named channels with units, and the catalogue of known channels.

Measured and simulated data have the same form.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.errors import DataError, PpafoError, UnitError, refused_as
from ppafo.units import carried, from_si
from ppafo.wording import count_of, known_names, nearest_name, one_line

if TYPE_CHECKING:
    import pandas  # type: ignore[import-untyped]
    from matplotlib.figure import Figure

TIME = "time"
TIME_UNIT = "s"
PLAIN_NUMBER = "-"

Between = Literal["hold", "linear"]
"""Interpolation of a channel between samples: previous value, or linear."""
BETWEEN: tuple[Between, ...] = get_args(Between)


_SAME_UNIT = {"1": PLAIN_NUMBER, "Pa_a": "Pa"}
"""Unit as a channel writes it, by another spelling of it."""


@dataclass(frozen=True, slots=True)
class ChannelKind:
    """Known channel: SI unit and meaning; ``is_held`` for zero-order hold between samples, else linear.

    A recording may declare another interpolation for its channel.
    """

    unit: str
    summary: str
    is_held: bool = False


CHANNELS: dict[str, ChannelKind] = {
    "angle": ChannelKind("rad", "ankle angle, growing in plantarflexion"),
    "angular_velocity": ChannelKind("rad/s", "ankle angular velocity"),
    "pressure_1": ChannelKind("Pa", "absolute pressure in chamber 1, whose volume grows with the angle"),
    "pressure_2": ChannelKind("Pa", "absolute pressure in chamber 2"),
    "torque": ChannelKind("N m", "actuator torque, positive in plantarflexion"),
    "reference": ChannelKind("N m", "reference torque of the controller"),
    "reference_angle": ChannelKind("rad", "reference angle of the controller"),
    "reference_pressure_1": ChannelKind("Pa", "reference absolute pressure in chamber 1"),
    "reference_pressure_2": ChannelKind("Pa", "reference absolute pressure in chamber 2"),
    "reference_pressure_difference": ChannelKind("Pa_d", "reference pressure difference, chamber 1 minus chamber 2"),
    "command": ChannelKind(PLAIN_NUMBER, "command to the valve, from -1 to 1; 2 vents both chambers", is_held=True),
    "supplied_mass": ChannelKind(
        "kg", "gas taken from the supply since the start; negative for flow into a vacuum supply"
    ),
    "vented_mass": ChannelKind("kg", "gas vented to the atmosphere since the start"),
    "leaked_mass": ChannelKind(
        "kg", "gas exchanged between the chambers since the start, in either direction, by leak or valve"
    ),
    "external_torque": ChannelKind("N m", "torque on the wearer, T_ex of equation (1)"),
    "shank_angle": ChannelKind("rad", "shank angle from the vertical, positive with the ankle in front of the knee"),
    "foot_angle": ChannelKind("rad", "foot angle from the horizontal, positive with the toes up"),
    "measured_foot_angle": ChannelKind(
        "rad", "foot angle of the measured gait at the same instant, from the horizontal"
    ),
    "toe_difference": ChannelKind("m", "toe height relative to the measured gait at the same instant"),
    "healthy_angle": ChannelKind("rad", "ankle angle of the prescribed gait, growing in plantarflexion"),
    "device_power": ChannelKind("W", "power from the device to the wearer, T_ex times angular velocity"),
    "swing_knee_torque": ChannelKind(
        "N m", "inertial torque T_1 of shank and foot in swing, equation (11); 0 on the ground"
    ),
    "contact": ChannelKind(PLAIN_NUMBER, "foot contact: 0 none, 1 heel, 2 flat, 3 toes", is_held=True),
    "controller_phase": ChannelKind(
        PLAIN_NUMBER,
        "gait phase detected by the controller: 0 swing, 1 landing, 2 mid-stance, 3 push-off",
        is_held=True,
    ),
    "heel_force": ChannelKind("N", "force under the heel, after the lag of the sensor"),
    "toe_force": ChannelKind("N", "force under the toes, after the lag of the sensor"),
    "dorsiflexor_moment": ChannelKind("N m", "moment of the dorsiflexor muscles, 0 or more"),
    "toe_height": ChannelKind(
        "m", "toe height above ground; ground is at the toes of the healthy gait with a flat foot at the same instant"
    ),
    "mass_1": ChannelKind("kg", "gas in chamber 1"),
    "mass_2": ChannelKind("kg", "gas in chamber 2"),
    "temperature_1": ChannelKind("K", "gas temperature in chamber 1, for gas models with an energy balance"),
    "temperature_2": ChannelKind("K", "gas temperature in chamber 2, for gas models with an energy balance"),
    "gas_energy": ChannelKind(
        "J", "internal energy of the gas in both chambers, for gas models with an energy balance"
    ),
    "supplied_enthalpy": ChannelKind("J", "net enthalpy taken from the supply since the start"),
    "vented_enthalpy": ChannelKind("J", "enthalpy vented to the atmosphere since the start"),
    "wall_heat": ChannelKind("J", "heat from the walls to the gas since the start"),
    "gas_work": ChannelKind("J", "work of the gas in both chambers since the start, pressure times change of volume"),
    "bottle_mass": ChannelKind("kg", "gas in the bottle, liquid and vapour"),
    "liquid_mass": ChannelKind("kg", "liquid in the bottle"),
    "bottle_temperature": ChannelKind("K", "temperature of the fluid in the bottle"),
    "wall_temperature": ChannelKind("K", "temperature of the wall of the bottle"),
    "bottle_pressure": ChannelKind("Pa", "absolute pressure in the bottle"),
    "line_pressure_1": ChannelKind("Pa", "absolute pressure in the line behind the bottle's regulator"),
    "line_pressure_2": ChannelKind("Pa", "absolute pressure in the dorsiflexion line, behind the second regulator"),
    "regulated_mass": ChannelKind("kg", "gas passed by the bottle's regulator since the start"),
    "supply_pressure": ChannelKind("Pa", "absolute pressure at the inlet of the valve"),
    "dorsiflexion_pressure": ChannelKind("Pa", "absolute pressure at the inlet of the valve for chamber 2"),
    "pressure_difference": ChannelKind("Pa_d", "pressure difference, chamber 1 minus chamber 2"),
    "upstream_pressure": ChannelKind("Pa", "absolute upstream pressure"),
    "downstream_pressure": ChannelKind("Pa", "absolute downstream pressure"),
    "force": ChannelKind("N", "force of a linear actuator on a scale, positive where chamber 1 pushes"),
    "mass_flow": ChannelKind("kg/s", "gas flow through the part on the bench, positive into chamber 1"),
    "direction": ChannelKind(PLAIN_NUMBER, "direction of the pressure: 1 rising, -1 falling", is_held=True),
    "repetition": ChannelKind(PLAIN_NUMBER, "index of the repetition", is_held=True),
}
"""Known channels. To add one: one line here. A recording may also have channels that are not listed."""
OF_SECOND_CHAMBER = frozenset(
    {
        "pressure_2",
        "mass_2",
        "temperature_2",
        "leaked_mass",
        "pressure_difference",
        "line_pressure_2",
        "dorsiflexion_pressure",
    }
)
"""Channels absent from runs of an actuator with one chamber."""


Floats = NDArray[np.float64]

RecordingKind = Literal["measured", "simulated", "synthetic"]
"""Origin of a recording: sensors, simulation of a model, or the simulated test bench."""

_NAME = re.compile(r"[A-Za-z]\w*", re.ASCII)
_KINDS: tuple[RecordingKind, ...] = get_args(RecordingKind)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Channel:
    """Values of a channel, read-only, with the SI unit as text: ``rad``, ``Pa`` (absolute), ``N m``, ``-``.

    ``between`` is the interpolation between two samples, ``hold`` or ``linear``; None means the default by name, such
    as ``hold`` for a command. ``stated`` is the unit in the source file, which messages about the file use.
    """

    values: Floats
    unit: str
    between: Between | None = None
    stated: str = ""

    def __post_init__(self) -> None:
        # Frozen: what is checked once stays true, and a channel can belong to several recordings.
        object.__setattr__(self, "values", _read_only(self.values, self.unit))
        if self.between is not None and self.between not in BETWEEN:
            hint = nearest_name(str(self.between), BETWEEN)
            raise DataError(f"between = {self.between!r} must be {' or '.join(map(repr, BETWEEN))}{hint}")

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Channel)
            and (self.unit, self.between) == (other.unit, other.between)
            and np.array_equal(self.values, other.values)
        )

    __hash__ = None  # type: ignore[assignment]  # arrays have no hash

    def __repr__(self) -> str:
        return f"Channel of {len(self.values)} values in {self.unit}"

    def __reduce__(self) -> tuple[Callable[..., "Channel"], tuple[Any, ...]]:
        """Reduce to a constructor call for copy and pickle, so that values stay read-only."""
        return Channel, (self.values, self.unit, self.between, self.stated)


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Recording:
    """Recording: channels over a common, strictly increasing time [s]; all values are finite.

    ``label`` names the recording; ``kind`` is its origin (measured, simulated, synthetic), which figures and files
    state for data that are not measured.
    """

    label: str
    time: Floats
    channels: Mapping[str, Channel]
    kind: RecordingKind = "measured"

    def __post_init__(self) -> None:
        # Copies: the caller goes on with an array and a dict of its own.
        object.__setattr__(self, "time", _read_only(self.time, TIME_UNIT))
        if not isinstance(self.channels, Mapping):
            raise DataError(f"{self.label}: channels must be a dictionary of Channel by name")
        object.__setattr__(self, "channels", MappingProxyType(dict(self.channels)))
        if not self.label or not self.label.isprintable():
            raise DataError(f"the label of a recording must be one line of text, not {self.label!r}")
        recording_kind(self.kind)
        for name, channel in self.channels.items():
            if not isinstance(channel, Channel):
                raise DataError(f"{self.label}: '{name}' must be a Channel, such as Channel(values, 'N m')")
        if self.time.size == 0:
            raise DataError(f"{self.label}: has no samples")
        _check_finite(self, "time", self.time)
        stalled = np.flatnonzero(self.time[1:] <= self.time[:-1])
        if stalled.size:
            index = int(stalled[0]) + 1
            raise DataError(
                f"{self.label}: time must increase from sample to sample, but {self.time[index]:g} s (sample "
                f"{index + 1}) follows {self.time[index - 1]:g} s"
            )
        for name in self.channels:
            _check_channel(self, name)

    def __eq__(self, other: object) -> bool:
        return (
            isinstance(other, Recording)
            and (self.label, self.kind) == (other.label, other.kind)
            and np.array_equal(self.time, other.time)
            and dict(self.channels) == dict(other.channels)
        )

    __hash__ = None  # type: ignore[assignment]  # arrays have no hash

    def __repr__(self) -> str:
        """Return label, kind, number of samples, time span and channels with their units."""
        samples = count_of(len(self), "sample")
        channels = ", ".join(f"{name} [{channel.unit}]" for name, channel in self.channels.items())
        span = f"from {self.time[0]:g} s to {self.time[-1]:g} s"
        return f"Recording '{self.label}', {self.kind}, {samples} {span}\n  channels: {channels or 'none'}"

    def __reduce__(self) -> tuple[Callable[..., "Recording"], tuple[Any, ...]]:
        """Reduce to a constructor call for copy and pickle, because a read-only mapping cannot be pickled."""
        return Recording, (self.label, self.time, dict(self.channels), self.kind)

    def __getitem__(self, name: str) -> Floats:
        """Return the values of a channel in its SI unit, read-only."""
        return self._channel(name).values

    def in_unit(self, name: str, unit: str, atmosphere: float = STANDARD_ATMOSPHERE) -> Floats:
        """Return the values of a channel in a unit, such as ``psi_g``, relative to ``atmosphere`` [Pa absolute].

        Raises DataError for an unknown channel, and UnitError for a unit that does not fit the channel.
        """
        channel = self._channel(name)
        # Channels write Pa for a level and - for a plain number.
        si_unit = {"Pa": "Pa_a", "-": ""}.get(channel.unit, channel.unit)
        # Units are affine, so that two values decide all.
        with refused_as(UnitError, f"channel '{name}' in '{unit}'", UnitError):
            zero, one = (from_si(number, unit, si_unit, atmosphere) for number in (0.0, 1.0))
        scale = one - zero
        converted: Floats = channel.values if (zero, one) == (0.0, 1.0) else zero + scale * channel.values
        return converted

    def values_of(self, channel: str | tuple[str, str], atmosphere: float = STANDARD_ATMOSPHERE) -> Floats:
        """Return the values of a channel, in SI (``"torque"``) or in a given unit (``("pressure_1", "psi_g")``).

        ``"time"`` are the times of the samples [s]. Gauge pressures are relative to ``atmosphere`` [Pa absolute].
        Raises DataError for an unknown channel, and UnitError for a unit that does not fit the channel.
        """
        if channel == TIME:
            return self.time
        return self[channel] if isinstance(channel, str) else self.in_unit(*channel, atmosphere)

    def _ipython_key_completions_(self) -> list[str]:
        """Return the channel names, for completion between brackets in notebooks."""
        return list(self.names)

    def __contains__(self, name: object) -> bool:
        return name in self.channels

    def __len__(self) -> int:
        """Return the number of samples."""
        return len(self.time)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the channels, in order."""
        return tuple(self.channels)

    @property
    def duration(self) -> float:
        """Time from the first to the last sample [s]."""
        return float(self.time[-1] - self.time[0])

    def unit(self, name: str) -> str:
        """Return the SI unit of a channel; ``-`` for a plain number."""
        return self._channel(name).unit

    def is_held(self, name: str) -> bool:
        """Return whether a channel keeps its value until the next sample (zero-order hold)."""
        between = self._channel(name).between
        return (name in CHANNELS and CHANNELS[name].is_held) if between is None else between == "hold"

    def with_channel(self, name: str, values: ArrayLike, unit: str) -> "Recording":
        """Return a copy with a channel added or replaced; a replaced channel keeps its interpolation."""
        between = self.channels[name].between if name in self.channels else None
        channel = Channel(_read_only(values, unit), unit, between)
        return replace(self, channels={**self.channels, name: channel})

    def between(self, start: float, end: float) -> "Recording":
        """Return a copy with the samples from ``start`` to ``end`` [s]; times are not shifted."""
        # Times stay: where a recording is cut must not move what happens in it.
        inside = (self.time >= start) & (self.time <= end)
        if not inside.any():
            raise DataError(f"{self.label}: there is no sample between {start:g} s and {end:g} s; {_span(self)}")
        kept = {name: replace(channel, values=channel.values[inside]) for name, channel in self.channels.items()}
        return replace(self, time=self.time[inside], channels=kept)

    def resample(self, times: ArrayLike) -> "Recording":
        """Return a copy at other times [s] within the time span; each channel is held or linear as declared."""
        wanted = _read_only(times, TIME_UNIT)
        if wanted.size and (wanted.min() < self.time[0] or wanted.max() > self.time[-1]):
            raise DataError(
                f"{self.label}: cannot be resampled from {wanted.min():g} s to {wanted.max():g} s; {_span(self)}"
            )
        moved = {name: between_samples(self, name, wanted) for name in self.channels}
        channels = {name: replace(channel, values=moved[name]) for name, channel in self.channels.items()}
        return replace(self, time=wanted, channels=channels)

    def to_dataframe(
        self, units: Mapping[str, str] | None = None, atmosphere: float = STANDARD_ATMOSPHERE
    ) -> "pandas.DataFrame":
        """Return the channels as columns indexed by time [s], in SI or in ``units``, such as ``{"angle": "deg"}``.

        The units stand in ``attrs["units"]`` by column (pandas copies the attributes of a table to each column, and
        not to a number of it such as ``.iloc[-1]``) and are not written by ``to_csv``; ``recording.csv`` of a saved
        result has them in its header. Gauge pressures are relative to ``atmosphere`` [Pa absolute]. Raises DataError
        for an unknown channel, and UnitError for a unit that does not fit the channel.
        """
        from pandas import DataFrame, Index

        shown = {**{name: channel.unit for name, channel in self.channels.items()}, **(units or {})}
        columns = {
            name: self.in_unit(name, unit, atmosphere) if name in (units or {}) else self[name]
            for name, unit in shown.items()
        }
        frame = DataFrame(columns, Index(self.time, name=TIME))
        frame.attrs = {"title": self.label, "kind": self.kind, "units": shown}
        return frame

    def plot(self, units: Mapping[str, str] | None = None) -> "Figure":
        """Draw a panel for each channel over time [s], in units as in ``to_dataframe``."""
        from matplotlib.figure import Figure

        if not self.channels:
            raise DataError(f"{self.label}: has no channels to draw")
        table = self.to_dataframe(units)
        figure = Figure((5.4, 1.2 + 1.2 * len(self.names)), layout="constrained")
        panels = figure.subplots(len(self.names), sharex=True, squeeze=False)[:, 0]
        for name, panel in zip(self.names, panels, strict=True):
            panel.plot(self.time, table[name], drawstyle="steps-post" if self.is_held(name) else "default")
            panel.set_title(f"{name} [{table.attrs['units'][name]}]", loc="left")
        panels[0].figure.suptitle(self.label if self.kind == "measured" else f"{self.label} ({self.kind})")
        panels[-1].set_xlabel("time [s]")
        return figure

    def _channel(self, name: str) -> Channel:
        if name not in self.channels:
            raise DataError(f"{self.label}: there is no channel '{name}'{known_names(name, self.names)}")
        return self.channels[name]


def recording_kind(name: str) -> RecordingKind:
    """Check the name of a recording kind and return it. Raises DataError for an unknown name."""
    for kind in _KINDS:
        if kind == name:
            return kind
    raise DataError(f"{name!r} is not a kind of recording{known_names(name, _KINDS)}")


def between_samples(recording: Recording, name: str, times: Floats, start: float = 0.0) -> Floats:
    """Return a channel [SI] at times [s] relative to ``start``, interpolated as declared: zero-order hold or linear.

    Before the first and after the last sample the value is constant.
    """
    values = recording[name]
    own_times = recording.time - start
    if recording.is_held(name):
        # The last sample at or before each time: a command holds from the instant at which it was given.
        return values[np.maximum(np.searchsorted(own_times, times, side="right") - 1, 0)]
    return np.interp(times, own_times, values)


def _check_channel(recording: Recording, name: str) -> None:
    channel = recording.channels[name]
    if _NAME.fullmatch(name) is None or name == TIME:
        raise DataError(
            f"{recording.label}: {name!r} is not a channel name; use a letter, then letters, digits or _, but not "
            f"'{TIME}'"
        )
    if not channel.unit.strip() or not channel.unit.isprintable() or set(channel.unit) & set("[]"):
        raise DataError(f"{recording.label}: channel '{name}' has no usable unit: {channel.unit!r}; give '-' for none")
    if len(channel.values) != len(recording.time):
        counts = f"{len(channel.values)} values for {len(recording.time)} times"
        raise DataError(f"{recording.label}: channel '{name}' has {counts}")
    _check_finite(recording, f"channel '{name}'", channel.values)
    # Functions of a recording take its numbers as they are: a known name says the unit as well.
    if name in CHANNELS and channel.unit != CHANNELS[name].unit:
        raise DataError(
            f"{recording.label}: channel '{name}' must be in '{CHANNELS[name].unit}', not in '{channel.unit}'"
        )


def _check_finite(recording: Recording, name: str, values: Floats) -> None:
    finite = np.isfinite(values)
    if not finite.all():
        index = int(np.argmin(finite))
        raise DataError(f"{recording.label}: {name} is {values[index]} at sample {index + 1}, not a finite number")


def _read_only(values: ArrayLike, unit: str) -> Floats:
    """Return a copy of numbers in a unit. Raises DataError for others, and for numbers that carry another unit."""
    try:
        numbers, own = carried(values) or (values, unit)
        given = numbers if isinstance(numbers, np.ma.MaskedArray) else np.asarray(numbers)
        # NumPy makes numbers of times and texts, and of complex ones their real part. A masked value is none, whatever
        # number stands behind the mask.
        has_numbers = given.dtype.kind in "biufO"
        copy = np.ma.filled(given.astype(np.float64), np.nan) if has_numbers else np.zeros(0)
    except PpafoError:
        raise
    except Exception as error:  # a foreign object may raise anything
        raise DataError(f"the values of a channel must be numbers: {one_line(error)}") from error
    if _SAME_UNIT.get(own, own) != _SAME_UNIT.get(unit, unit):
        raise DataError(f"the values of a channel in '{unit}' carry the unit '{own}': convert them before")
    if not has_numbers:
        raise DataError(f"the values of a channel must be numbers, not {given.dtype}")
    if copy.ndim != 1:
        raise DataError(f"the values of a channel must be one-dimensional, not an array of {copy.ndim} dimensions")
    copy.setflags(write=False)
    return np.asarray(copy)


def _span(recording: Recording) -> str:
    return f"{recording.label} goes from {recording.time[0]:g} s to {recording.time[-1]:g} s"
