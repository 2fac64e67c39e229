"""How large an error may be: a share of the full range, or a number with a unit, for one channel or for all."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from ppafo.errors import DataError, UnitError, nearest_name, one_line
from ppafo.units import parse_quantity, split_quantity
from ppafo.validation.compared import COMPARED

ACCEPTABLE_SHARE = 0.10
"""RMS error over full range that the paper calls acceptable (page with figure 7)."""

_SHARE_UNITS = ("%", "percent")
_EXAMPLES = "write for example 'angle=10%', 'pressure_1=3.7 psi_d' or '5%' for all channels"


@dataclass(frozen=True, slots=True)
class Limit:
    """Largest RMS error: a share of the full range [-], or an error in the SI unit of the channel."""

    value: float
    is_share: bool

    def share_of(self, full_range: float) -> float:
        """The limit as a share [-] of a full range in the SI unit of the channel."""
        return self.value if self.is_share else self.value / full_range


@dataclass(frozen=True, slots=True)
class Thresholds:
    """The limit of every channel that has one of its own, and that of the others."""

    others: Limit
    channels: Mapping[str, Limit]

    def limit(self, channel: str) -> Limit:
        """The limit that holds for a channel."""
        return self.channels.get(channel, self.others)


def parse_thresholds(texts: Iterable[str] = ()) -> Thresholds:
    """Return the thresholds of texts such as ``angle=10%``, ``pressure_1=3.7 psi_d`` or ``5%``; later ones win."""
    others = Limit(ACCEPTABLE_SHARE, is_share=True)
    channels: dict[str, Limit] = {}
    for text in texts:
        name, separator, value = text.rpartition("=")
        if separator:
            channel = _channel(name.strip(), text)
            channels[channel] = _limit(value, text, COMPARED[channel].unit)
        else:
            others = _limit(value, text, "")
    return Thresholds(others, channels)


def _channel(name: str, text: str) -> str:
    if name not in COMPARED:
        hint = nearest_name(name, COMPARED)
        known = ", ".join(COMPARED)
        raise DataError(
            f"threshold '{one_line(text)}': there is no channel '{one_line(name)}'{hint}; there are {known}"
        )
    return name


def _limit(value: str, text: str, unit: str) -> Limit:
    try:
        is_share = split_quantity(value)[1] in _SHARE_UNITS
        number = parse_quantity(value, "" if is_share else unit)
    except UnitError as error:
        raise DataError(f"threshold '{one_line(text)}': {error}; {_EXAMPLES}") from error
    if not unit and not is_share:
        raise DataError(f"threshold '{one_line(text)}': a limit for all channels is a share of the full range in %")
    if number <= 0.0:
        raise DataError(f"threshold '{one_line(text)}': must be above 0; {_EXAMPLES}")
    return Limit(number, is_share)
