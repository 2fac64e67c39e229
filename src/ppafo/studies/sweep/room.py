"""How much disk a study takes, worked out before it starts."""

from ppafo.errors import StudyError
from ppafo.storage.places import Place
from ppafo.studies.sweep.bands import BINS
from ppafo.studies.sweep.chunks import chunk_count, most_samples
from ppafo.studies.sweep.study import Study

ASKED_ABOVE = 10_000_000_000
"""Bytes above which a study is only started with ``--yes``."""

_FIXED_BYTES_OF_ROW = 3
_BYTES_OF_NUMBER, _BYTES_OF_SAMPLE, _BYTES_OF_COUNT = 8, 4, 6
_BYTES_OF_FILE = 12_000


def estimated_bytes(study: Study) -> int:
    """Return an upper estimate of the bytes on disk: as if nothing could be compressed."""
    outputs, samples = study.outputs, most_samples(study)
    numbers = 2 + len(study.paths) + len(outputs.metrics)
    row = _FIXED_BYTES_OF_ROW + _BYTES_OF_NUMBER * numbers + _BYTES_OF_SAMPLE * samples * len(outputs.trajectories)
    counts = _BYTES_OF_COUNT * samples * len(outputs.bands) * BINS // 2
    return study.runs * row + chunk_count(study) * (counts + _BYTES_OF_FILE)


def check_room(study: Study, place: Place, agreed: bool) -> None:
    """Refuse a study that does not fit onto the disk, or that takes much of it and was not agreed to with ``--yes``."""
    needed, free = estimated_bytes(study), place.free_bytes()
    told = f"{study.runs:,} runs of '{study.name}' take about {_told(needed)}"
    if free is not None and needed > free:
        raise StudyError(
            f"{place.address}: {told}, but only {_told(free)} are free: take fewer runs, metrics or trajectories"
        )
    if needed > ASKED_ABOVE and not agreed:
        raise StudyError(f"{place.address}: {told}; give --yes to start it all the same")


def _told(size: int) -> str:
    for unit, scale in (("TB", 1e12), ("GB", 1e9), ("MB", 1e6)):
        if size >= scale:
            return f"{size / scale:.3g} {unit}"
    return f"{size / 1e3:.3g} kB"
