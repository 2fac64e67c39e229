"""From a name or a file to a parameter set; every mistake in a file is one clear line."""

import tomllib
from collections.abc import Iterable, Iterator
from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from ppafo.errors import ParameterError, UnitError, nearest_name
from ppafo.parameters.building import build_device
from ppafo.parameters.device import Device
from ppafo.parameters.overrides import apply_overrides
from ppafo.parameters.parameter_set import ParameterSet, chosen_valve
from ppafo.parameters.problems import first_problem
from ppafo.parameters.provenance import Entry, TextEntry
from ppafo.parameters.schema import PARAMETER_FILE
from ppafo.units import check_unit

_SETS = resources.files("ppafo.parameters") / "sets"
_SUFFIX = ".toml"


def list_sets() -> tuple[str, ...]:
    """Return the names of the parameter sets that come with the package."""
    names = (Path(item.name) for item in _SETS.iterdir())
    return tuple(sorted(name.stem for name in names if name.suffix == _SUFFIX))


def load_device(name_or_path: str | Path, valve: str | None = None, overrides: Iterable[str] = ()) -> Device:
    """Return the device of a parameter set with one of its valves (default: the set's own choice), in SI units.

    ``overrides`` are texts such as ``valve.area=12.6mm^2`` or ``supply.pressure=55 psi_g``.
    """
    parameter_set = apply_overrides(load_parameter_set(name_or_path), overrides, valve)
    return build_device(parameter_set, valve)


def load_parameter_set(name_or_path: str | Path) -> ParameterSet:
    """Return a parameter set by its name in the package or by the path of a TOML file."""
    name = str(name_or_path)
    if name in list_sets():
        return parse_parameter_set((_SETS / (name + _SUFFIX)).read_bytes(), name)
    path = Path(name_or_path)
    if path.suffix != _SUFFIX and not path.exists():
        known = ", ".join(list_sets())
        hint = nearest_name(name, list_sets())
        raise ParameterError(f"there is no parameter set '{name}'{hint}; known are {known}, or give a .toml file")
    try:
        content = path.read_bytes()
    except (OSError, ValueError) as error:
        reason = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
        raise ParameterError(f"{name}: cannot be read: {reason}") from error
    return parse_parameter_set(content, name)


def parse_parameter_set(content: bytes, file: str) -> ParameterSet:
    """Return the parameter set in the bytes of a TOML file; ``file`` is what messages call it."""
    document = _toml(content, file)
    try:
        parsed = PARAMETER_FILE.model_validate(document)
    except ValidationError as error:
        raise ParameterError(f"{file}: {first_problem(error, PARAMETER_FILE)}") from error
    parameter_set = _flattened(parsed, file)
    _check(parameter_set)
    return parameter_set


def _toml(content: bytes, file: str) -> dict[str, Any]:
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise ParameterError(f"{file}: is not a text file in UTF-8 (byte {error.start})") from error
    if not text.strip():
        raise ParameterError(f"{file}: is empty; 'ppafo schema parameters' prints what belongs in it")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ParameterError(f"{file}: is not valid TOML: {' '.join(str(error).split())}") from error
    except (RecursionError, ValueError) as error:
        raise ParameterError(f"{file}: is not usable TOML: nested too deeply or a number too long") from error


def _flattened(parsed: Any, file: str) -> ParameterSet:
    leaves = dict(_leaves(parsed, ""))
    return ParameterSet(
        file=file,
        name=parsed.name,
        title=parsed.title,
        citation=parsed.citation,
        notes=parsed.notes,
        completed_by=parsed.completed_by,
        default_valve=parsed.default_valve,
        valve_kinds={name: valve.kind for name, valve in parsed.valves.items()},
        numbers={path: leaf for path, leaf in leaves.items() if isinstance(leaf, Entry)},
        texts={path: leaf for path, leaf in leaves.items() if isinstance(leaf, TextEntry)},
        accepted={item.finding: item.reason for item in parsed.accepted},
    )


def _leaves(node: object, path: str) -> Iterator[tuple[str, object]]:
    """Yield every entry below a node with its dotted path."""
    if isinstance(node, Entry | TextEntry):
        yield path, node
        return
    children = dict(node) if isinstance(node, BaseModel | dict) else {}
    for name, child in children.items():
        yield from _leaves(child, f"{path}.{name}" if path else name)


def _check(parameter_set: ParameterSet) -> None:
    """Refuse units that do not exist and names of valves that the set does not have."""
    chosen_valve(parameter_set, None)
    declared = parameter_set.declared()
    for path, entry in parameter_set.numbers.items():
        if path not in declared:
            valve = path.split(".")[2]
            hint = nearest_name(valve, parameter_set.valve_kinds)
            raise ParameterError(f"{parameter_set.file}: {path}: there is no valve '{valve}'{hint}")
        try:
            check_unit(entry.unit)
        except UnitError as error:
            raise ParameterError(f"{parameter_set.file}: {path}.unit: {error}") from error
