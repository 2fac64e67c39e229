"""Checks that recordings suit a bench procedure; messages name the file and a remedy."""

from collections.abc import Iterable, Sequence

import numpy as np

from ppafo.errors import IdentificationError
from ppafo.identification.bench.wrong_readings import check_not_alone
from ppafo.identification.source import RecordingSource
from ppafo.signals import CHANNELS, Recording
from ppafo.signals.faults import longest_gap, plateaus
from ppafo.signals.recording import Floats
from ppafo.wording import nearest_name

_SHARE_THAT_IS_CLIPPED = 0.05
"""Fraction of samples at an extreme value [-] from which a sensor counts as saturated."""
_FEWEST_CLIPPED = 4
"""Least number of equal samples for saturation."""
_FRACTION_THAT_MOVES = 0.02
"""Least relative change of the driving quantity [-] for which a constant channel counts as saturated."""
_LARGEST_NUMBER = 1.0e12
"""Largest plausible magnitude of a measured value, in any SI unit."""


def check_sources(
    sources: tuple[RecordingSource, ...],
    procedure: str,
    channels: Sequence[str],
    fewest: int,
    moving: Iterable[str] = (),
    absolute: Iterable[str] = (),
) -> None:
    """Raise IdentificationError for recordings with a missing channel or too few samples.

    A ``moving`` channel must change, and an ``absolute`` pressure must be positive. The message names the recording.
    """
    if not sources:
        raise IdentificationError(f"{procedure}: no recording was given")
    for source in sources:
        recording = source.recording
        check_channels(source.name, procedure, channels, recording.names)
        for name, values in (("time", recording.time), *((name, recording[name]) for name in recording.names)):
            worst = int(np.argmax(np.abs(values)))
            if abs(values[worst]) > _LARGEST_NUMBER:
                raise IdentificationError(
                    f"{source.name}: {procedure}: '{name}' is {values[worst]:g} at sample {worst + 1}, beyond any "
                    f"sensor's range: the file is damaged there"
                )
        if len(recording) < fewest:
            raise IdentificationError(
                f"{source.name}: {procedure} needs at least {fewest} samples, not {len(recording)}"
            )
        for name in moving:
            check_moves(source, procedure, name)
        for name in absolute:
            # Gauge pressures, passed for absolute, are 0 or less where the other side is open.
            low = int(np.argmin(recording[name]))
            if recording[name][low] <= 0.0:
                raise IdentificationError(
                    f"{source.name}: {procedure}: '{name}' is {source.shown(name, recording[name][low])} at sample "
                    f"{low + 1}, which is impossible for an absolute pressure; give gauge pressures in psi_g, bar_g or "
                    "kPa_g"
                )
            check_not_alone(source, procedure, name)


def check_channels(where: str, procedure: str, needed: Sequence[str], read: Sequence[str]) -> None:
    """Raise IdentificationError with all channels that a procedure needs and a recording or column map lacks."""
    spare, asked, maps = [name for name in read if name not in needed], list[str](), list[str]()
    for name in needed:
        if name in read:
            continue
        known = CHANNELS[name]
        asked.append(f"a channel '{name} [{known.unit}]', {known.summary}{nearest_name(name, spare)}")
        unit, others = known.unit, ""
        if unit == "Pa":
            unit, others = "kPa_g", ', or { constant = "0 kPa_g" } at atmospheric pressure'
        elif name == "direction":
            others = ', or derive it: direction.of = "pressure_difference", with a threshold and a window'
        maps.append(f'{name} = {{ column = "HEADER", unit = "{unit}" }}{others}')
    if asked:
        raise IdentificationError(
            f"{where}: {procedure} needs {' and '.join(asked)}; channels read: {', '.join(read) or 'only time'}; a "
            f"column map must list every channel to be read: {'; '.join(maps)}"
        )


def check_moves(source: RecordingSource, procedure: str, name: str) -> None:
    """Raise IdentificationError, naming the recording, for a constant channel, which carries no information."""
    values = source.recording[name]
    if values.max() == values.min():
        raise IdentificationError(
            f"{source.name}: {procedure}: channel '{name}' is {source.shown(name, values[0])} throughout; "
            f"the sensor is stuck, or nothing moved"
        )


def check_not_clipped(
    source: RecordingSource,
    procedure: str,
    name: str,
    driver: str,
    driving: Floats,
    fraction: float = _FRACTION_THAT_MOVES,
) -> None:
    """Raise IdentificationError for a saturated sensor: a channel constant at an extreme value while its cause changes.

    ``driving`` are the values of the driving quantity ``driver``, which must change by ``fraction`` [-] of its largest
    value. The message names the recording and the channel.
    """
    values = source.recording[name]
    longest, _ = plateaus(values)
    # A reading that stays where nothing moves is right.
    moves = float(np.ptp(driving[longest.first : longest.last + 1])) > fraction * float(np.abs(driving).max())
    if moves and longest.count >= max(_FEWEST_CLIPPED, _SHARE_THAT_IS_CLIPPED * values.size):
        raise IdentificationError(
            f"{source.name}: {procedure}: channel '{name}' stays at {source.shown(name, values.max())} for "
            f"{longest.count} samples, up to sample {longest.last + 1}, while '{driver}' moves: the sensor is "
            f"saturated; leave those samples out"
        )


def check_no_gap(source: RecordingSource, procedure: str, part: Recording) -> int:
    """Return the number of samples before ``part`` of a recording. Raises IdentificationError for a gap in the part.

    The message gives the time of the gap.
    """
    skipped = int(np.searchsorted(source.recording.time, part.time[0]))
    if (gap := longest_gap(part.time)) is not None:
        index, duration = gap
        raise IdentificationError(
            f"{source.name}: {procedure}: gap of {duration:.4g} s after {part.time[index]:.6g} s (sample "
            f"{skipped + index + 1}); give a start or an end that excludes the gap"
        )
    return skipped
