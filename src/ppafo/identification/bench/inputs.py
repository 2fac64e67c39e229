"""What a recording must have before a procedure touches it; every refusal names the file and the remedy."""

from collections.abc import Iterable

import numpy as np

from ppafo.errors import IdentificationError, nearest_name
from ppafo.identification.source import Source
from ppafo.signals import CHANNELS, Recording, RecordingKind
from ppafo.signals.recording import Floats

_SHARE_THAT_IS_CLIPPED = 0.05
_FEWEST_CLIPPED = 4
_SHARE_THAT_MOVES = 0.02
_KINDS: tuple[RecordingKind, ...] = ("synthetic", "simulated", "measured")


def check_sources(sources: tuple[Source, ...], procedure: str, channels: Iterable[str], fewest: int) -> None:
    """Refuse recordings that lack a channel or have fewer samples than the procedure needs."""
    if not sources:
        raise IdentificationError(f"{procedure}: no recording was given")
    for source in sources:
        for name in channels:
            _check_channel(source, procedure, name)
        if len(source.recording) < fewest:
            raise IdentificationError(
                f"{source.name}: {procedure} needs at least {fewest} samples, it has {len(source.recording)}"
            )


def check_moves(source: Source, procedure: str, name: str) -> None:
    """Refuse a channel that never changes: nothing can be learnt from it."""
    values = source.recording[name]
    if values.max() == values.min():
        raise IdentificationError(
            f"{source.name}: {procedure}: channel '{name}' is {values[0]:g} {source.recording.unit(name)} throughout; "
            f"the sensor is stuck, or nothing was done"
        )


def check_not_clipped(source: Source, procedure: str, name: str, driver: str) -> None:
    """Refuse a channel that stays exactly at its largest value while what drives it moves: a saturated sensor."""
    values, driving = source.recording[name], source.recording[driver]
    first, last = _longest_run(values == values.max())
    count = last - first + 1
    moves = float(np.ptp(driving[first : last + 1])) > _SHARE_THAT_MOVES * float(np.abs(driving).max())
    if moves and count >= max(_FEWEST_CLIPPED, _SHARE_THAT_IS_CLIPPED * values.size):
        raise IdentificationError(
            f"{source.name}: {procedure}: channel '{name}' stays at {values.max():g} {source.recording.unit(name)} for "
            f"{count} samples, up to sample {last + 1}, while '{driver}' moves: the sensor is saturated; "
            f"leave those samples out"
        )


def window(recording: Recording, start: float | None, end: float | None) -> Recording:
    """Return the part of a recording between two times [s]; None is its own start or end."""
    if start is None and end is None:
        return recording
    first = float(recording.time[0]) if start is None else start
    last = float(recording.time[-1]) if end is None else end
    return recording.between(first, last)


def kind_of(sources: tuple[Source, ...]) -> RecordingKind:
    """Return the kind of the whole: one synthetic recording makes the result synthetic."""
    kinds = {source.recording.kind for source in sources}
    return next(kind for kind in _KINDS if kind in kinds)


def pooled(sources: tuple[Source, ...], name: str) -> Floats:
    """Return a channel of all recordings, one after the other."""
    return np.concatenate([source.recording[name] for source in sources])


def _check_channel(source: Source, procedure: str, name: str) -> None:
    if name in source.recording:
        return
    known = CHANNELS[name]
    hint = nearest_name(name, source.recording.names)
    raise IdentificationError(
        f"{source.name}: {procedure} needs a channel '{name} [{known.unit}]', {known.summary}{hint}; "
        f"the file has {', '.join(source.recording.names) or 'only time'}; a column map can name it"
    )


def _longest_run(flags: "np.ndarray[tuple[int], np.dtype[np.bool_]]") -> tuple[int, int]:
    """Return the first and the last index of the longest run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate(([0], flags.astype(np.int8), [0]))))
    starts, ends = edges[::2], edges[1::2]
    longest = int(np.argmax(ends - starts))
    return int(starts[longest]), int(ends[longest] - 1)
