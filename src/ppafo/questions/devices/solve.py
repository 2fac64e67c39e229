"""From several devices to their kind: the values that each was identified with, pooled number by number."""

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from itertools import combinations
from pathlib import Path

from ppafo.errors import DataError, IdentificationError, ParameterError
from ppafo.identification.devices import LEAST_DEVICES, devices_apart, spread_of_devices
from ppafo.identification.estimate import interval_factor
from ppafo.identification.new_set import fitting_unit
from ppafo.identification.problem import ProblemFile, load_problem
from ppafo.parameters.loading import load_parameter_set
from ppafo.parameters.parameter_set import CONFIDENCE, Entry, ParameterSet, atmospheric_pressure
from ppafo.progress import Progress, Report, report_nothing
from ppafo.questions.devices.answer import NEXT, DeviceSpread, DeviceValue, PooledNumber
from ppafo.questions.identify.answer import kind_of_all
from ppafo.questions.identify.solve import solve_problem
from ppafo.signals import RecordingKind
from ppafo.storage.files import read_bytes
from ppafo.units import to_si

_OF_A_DEVICE = ("identified", "fitted")
_KIND = re.compile(r'"recordings_are": "(synthetic|simulated|measured)"')
_HASH = re.compile(r"sha256:([0-9a-f]{64})")


def pool_devices(
    devices: Sequence[str | Path],
    problem: str | Path | None = None,
    confidence: float = 0.95,
    progress: Report = report_nothing,
) -> DeviceSpread:
    """Return what devices of one kind have in common and how they spread, for each number that three of them have.

    A device is an identified parameter set or a folder with one, or with a ``problem`` a folder of recordings, which is
    identified first. IdentificationError for fewer than three devices, for one that is named twice or that shares a
    recording with another, and where no number was identified of three; else errors are those of ``identify``.
    """
    if not 0.0 < confidence < 1.0:
        raise IdentificationError(f"--confidence {confidence:g}: must lie between 0 and 1")
    paths = [Path(one) for one in devices]
    for one, other in combinations(paths, 2):
        if one.resolve() == other.resolve():
            raise IdentificationError(f"{other}: the same device is named twice")
    if len(paths) < LEAST_DEVICES:
        raise IdentificationError(
            f"at least {LEAST_DEVICES} devices are needed to see how their kind spreads; {len(paths)} given"
        )
    known = _sets_of(paths, problem, progress)
    sets = [one for one, _ in known]
    for path, parameter_set in zip(paths, sets, strict=True):
        if parameter_set.name == NEXT:
            raise IdentificationError(f"{path}: is what this command made of other devices, and no device itself")
    names = _names(paths)
    own = dict(zip(names, (_own_values(one) for one in sets), strict=True))
    _refuse_shared_recordings(own)
    inherited = _drop_inherited(own)
    counts = Counter(path for one in own.values() for path in one)
    pooled = tuple(
        _pool(path, own, dict(zip(names, sets, strict=True)), confidence)
        for path, count in counts.items()
        if count >= LEAST_DEVICES
    )
    if not pooled:
        found = "; ".join(f"{name}: {', '.join(one) or 'none'}" for name, one in own.items())
        raise IdentificationError(f"no parameter was identified on at least {LEAST_DEVICES} devices ({found})")
    fewer = tuple(path for path, count in counts.items() if count < LEAST_DEVICES)
    kind = kind_of_all([kind for _, kind in known])
    return DeviceSpread(tuple(names), pooled, fewer, inherited, confidence, sets[0], kind)


def _sets_of(
    paths: Sequence[Path], problem: str | Path | None, progress: Report
) -> list[tuple[ParameterSet, RecordingKind]]:
    """Return the set of each device, and what kind of recordings it comes from."""
    if problem is None:
        return [_set_of(path) for path in paths]
    file = Path(problem)
    declared = _with_set_beside(load_problem(file), file.parent)
    found: list[tuple[ParameterSet, RecordingKind]] = []
    for number, path in enumerate(paths):
        if not path.is_dir():
            raise DataError(f"{path}: with --problem a device is a folder of recordings")
        progress(Progress("devices", number, len(paths), noun="devices"))
        solved = solve_problem(declared, path, str(path))
        found.append((solved.new_set.parameter_set, solved.kind))
    return found


def _with_set_beside(problem: ProblemFile, folder: Path) -> ProblemFile:
    """Return a problem whose recordings begin elsewhere and whose set is still found from its own folder."""
    beside = folder / problem.device.set
    if beside.suffix != ".toml":
        return problem
    return problem.model_copy(update={"device": problem.device.model_copy(update={"set": str(beside.resolve())})})


def _set_of(path: Path) -> tuple[ParameterSet, RecordingKind]:
    if not path.is_dir():
        return load_parameter_set(path), _recorded_kind(path.parent)
    sets = []
    for file in sorted(path.glob("*.toml")):
        try:
            sets.append(load_parameter_set(file))
        except ParameterError:
            continue
    if len(sets) != 1:
        remedy = "identify it first, or give the problem file with --problem" if not sets else "name the file itself"
        raise DataError(f"{path}: the folder has {len(sets) or 'no'} parameter set{'s' * (len(sets) != 1)}; {remedy}")
    return sets[0], _recorded_kind(path)


def _recorded_kind(folder: Path) -> RecordingKind:
    """Return the kind of recordings that an answer of ``identify`` names: a set alone does not say it."""
    file = folder / "identify.json"
    if not file.is_file():
        return "measured"
    kinds = _KIND.findall(read_bytes(file).decode(errors="replace"))
    return kind_of_all(kinds)


def _names(paths: Sequence[Path]) -> list[str]:
    """Return a short name of each device: as much of its path as sets it apart from all others."""
    for count in range(1, max(len(path.parts) for path in paths) + 1):
        names = ["/".join(path.with_suffix("").parts[-count:]) for path in paths]
        if len(set(names)) == len(names):
            return names
    return [str(path) for path in paths]


def _own_values(parameter_set: ParameterSet) -> dict[str, Entry]:
    return {
        path: entry
        for path, entry in parameter_set.numbers.items()
        if entry.origin in _OF_A_DEVICE and entry.uncertainty and path in parameter_set.declarations()
    }


def _drop_inherited(own: Mapping[str, dict[str, Entry]]) -> tuple[str, ...]:
    """Take out what several sets have alike, which comes from the set they all began with; return its paths."""
    alike: dict[str, set[str]] = {}
    for (first, one), (second, other) in combinations(own.items(), 2):
        for path in one.keys() & other.keys():
            if (one[path].value, one[path].source) == (other[path].value, other[path].source):
                alike.setdefault(path, set()).update((first, second))
    for path, names in alike.items():
        for name in names:
            del own[name][path]
    return tuple(sorted(alike))


def _refuse_shared_recordings(own: Mapping[str, Mapping[str, Entry]]) -> None:
    hashes = {
        name: {found for one in entries.values() for found in _HASH.findall(one.source)}
        for name, entries in own.items()
    }
    for (first, one), (second, other) in combinations(hashes.items(), 2):
        if one & other:
            raise IdentificationError(f"{second}: was identified from a recording of {first}: it would count twice")


def _pool(
    path: str, own: Mapping[str, Mapping[str, Entry]], sets: Mapping[str, ParameterSet], confidence: float
) -> PooledNumber:
    """Return mean and spread of one number: of its logarithm where no interval of a device reaches zero."""
    factor = interval_factor(CONFIDENCE)
    values = []
    for name, entries in own.items():
        entry = entries.get(path)
        if entry is None:
            continue
        quantity = sets[name].declarations()[path]
        unit, atmosphere = fitting_unit(entry.unit, quantity), atmospheric_pressure(sets[name])
        value, above = (
            to_si(number, entry.unit, unit, atmosphere)
            for number in (entry.value, entry.value + (entry.uncertainty or 0.0))
        )
        values.append(DeviceValue(name, value, abs(above - value), entry.origin == "identified"))
    is_logarithmic = quantity.minimum >= 0.0 and all(one.half_width < one.value for one in values)
    if is_logarithmic:
        numbers = [math.log(one.value) for one in values]
        errors = [one.half_width / (factor * one.value) for one in values]
    else:
        numbers, errors = [one.value for one in values], [one.half_width / factor for one in values]
    pooled = spread_of_devices(numbers, errors, confidence)
    apart = tuple(values[place].device for place in devices_apart(numbers, errors))
    limits = (quantity.minimum, quantity.maximum)
    return PooledNumber(path, unit, tuple(values), is_logarithmic, pooled, apart, limits)
