"""MATLAB files (4 to 7 by SciPy, 7.3 by h5py): variables, and columns selected by a map. No code is run.

A field of a structure is named ``a.b``, a field in an array of structures ``a(2).b``, a column of a matrix ``M(:,3)``
and a row ``M(3,:)``. In a structure with ``data`` and ``colheaders``, as made by ``importdata``, each column is also
available under its label. The format of objects (timeseries, timetable, table, datetime) is not published; messages
name them.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import DataError, Faults
from ppafo.signals.recording import TIME, Floats
from ppafo.storage.column_map import ColumnMap, MappedTable, in_map, shown_names
from ppafo.storage.files import read_bytes
from ppafo.storage.netcdf import own_items
from ppafo.storage.trial_reading import check_can_be_read
from ppafo.wording import nearest_name, one_line

MATLAB_SUFFIX = ".mat"
_HDF5 = b"\x89HDF\r\n\x1a\n"
_HDF5_AT = 512
"""Byte offset of the HDF5 content, after the header of MATLAB."""
_MOST_COLUMNS = 300
"""Largest number of columns, or of rows, of a matrix that become variables of their own."""
_DEEPEST = 8
"""Largest nesting depth of structures read."""
_MOST_ELEMENTS = 300
"""Largest number of elements read from an array of structures or a cell array."""
_OF_DAMAGE = (
    OSError,
    ValueError,
    TypeError,
    LookupError,
    RuntimeError,
    ArithmeticError,
    AttributeError,
    NameError,
    EOFError,
)
"""Exceptions from the libraries for damaged files."""
_LABELS = ("colheaders", "labels", "names")
"""Fields of a structure that may contain the column names of its field ``data``."""


@dataclass(slots=True, eq=False)
class _MatlabFile:
    """Content of a MATLAB file.

    ``columns``: numeric vectors by name. ``texts``: text arrays by name. ``words``: all texts in the file. ``objects``:
    name and class of each object.
    """

    columns: dict[str, Floats] = field(default_factory=dict)
    texts: dict[str, list[str]] = field(default_factory=dict)
    words: list[str] = field(default_factory=list)
    objects: list[tuple[str, str]] = field(default_factory=list)

    def advice_on_objects(self) -> str:
        """Return the remedy, appended to messages, to save objects as arrays; empty without objects."""
        named = ", ".join(f"{name} ({kind})" if kind else name for name, kind in self.objects)
        return f"; only MATLAB reads the objects {named}: save their numbers there as plain arrays" if named else ""


def read_matlab(path: str | Path) -> _MatlabFile:
    """Read the variables of a ``.mat`` file of any version. Raises DataError for an invalid file."""
    is_hdf5 = read_bytes(path)[_HDF5_AT : _HDF5_AT + len(_HDF5)] == _HDF5
    # A damaged file can end a library of C code; another process tries it first.
    check_can_be_read(Path(path), open_matlab, "h5py" if is_hdf5 else "scipy.io")
    return open_matlab(path)


def open_matlab(path: str | Path) -> _MatlabFile:
    """Read the variables of a ``.mat`` file without a trial process; a damaged file may crash this process."""
    content = read_bytes(path)
    contents = _MatlabFile()
    try:
        if content[_HDF5_AT : _HDF5_AT + len(_HDF5)] == _HDF5:
            import h5py

            with h5py.File(path, "r") as file:
                for name, node in own_items(file):
                    if not name.startswith("#"):
                        _add(name, _tree_of_hdf5(node, file, 0), 0, contents)
        else:
            _read_older(path, contents)
    except (DataError, *_OF_DAMAGE) as error:
        raise DataError(f"{path}: cannot be read as a .mat file: {one_line(error)}") from error
    if not contents.columns and not contents.texts:
        raise DataError(f"{path}: has no numeric variable{contents.advice_on_objects()}")
    return contents


class _Object(NamedTuple):
    """MATLAB object, with its class if the file states it."""

    kind: str = ""


Tree = dict[str, Any] | list[Any] | NDArray[Any] | str | _Object
"""Variable as plain data: structure, cell array or array of structures, numbers, text, or object."""


def _read_older(path: str | Path, contents: _MatlabFile) -> None:
    """Add the variables of a file of version 4 to 7 to ``contents``."""
    import zlib

    from scipy.io import loadmat
    from scipy.io.matlab import MatReadError

    try:
        variables = loadmat(str(path), struct_as_record=False)
    except (MatReadError, zlib.error) as error:
        raise ValueError(one_line(error)) from error
    for name, value in variables.items():
        # Data that MATLAB keeps for its objects has no name of its own.
        if name in ("__function_workspace__", "None"):
            # An object says name and class in its first fields.
            names = getattr(getattr(value, "dtype", None), "names", None) or ()
            if {"s0", "s2"} <= set(names) and value.size == 1:
                words = [
                    one_line(word.decode("ascii", "replace") if isinstance(word, bytes) else word)
                    for word in value.ravel()[0]
                ]
                contents.objects.append((words[0], words[2]))
            elif not contents.objects:
                contents.objects.append(("a variable", ""))
        elif not name.startswith("__"):
            _add(name, _tree_of(value), 0, contents)


def _tree_of(value: Any) -> Tree:
    """Convert a variable read by SciPy to plain data."""
    from scipy.io.matlab import mat_struct

    if isinstance(value, mat_struct):
        return {name: _tree_of(getattr(value, name)) for name in value._fieldnames}
    if isinstance(value, str):
        return value.strip()
    if not isinstance(value, np.ndarray) or value.dtype.names:
        return _Object()
    if value.dtype == object:
        items = [_tree_of(element) for element in value.ravel(order="F")[:_MOST_ELEMENTS]]
        return items[0] if len(items) == 1 and isinstance(items[0], dict) else items
    if value.dtype.kind in "US":
        texts = [str(text).strip() for text in value.ravel()]
        return texts[0] if len(texts) == 1 else list(texts)
    return value


def _tree_of_hdf5(node: Any, file: Any, depth: int) -> Tree:
    """Convert a variable read by h5py to plain data; arrays are transposed with respect to HDF5."""
    import h5py

    stated = node.attrs.get("MATLAB_class", b"")
    kind = stated.decode("ascii", "replace") if isinstance(stated, bytes) else str(stated)
    if node.attrs.get("MATLAB_empty", 0) or depth > _DEEPEST:
        return []
    if node.attrs.get("MATLAB_object_decode", 0):
        return _Object(kind)
    if isinstance(node, h5py.Group):
        fields = {name: _tree_of_hdf5(field, file, depth + 1) for name, field in own_items(node)}
        # Of an array of structures each field has the values of all.
        is_array = fields and all(
            isinstance(field, h5py.Dataset) and field.dtype == h5py.ref_dtype and not field.attrs.get("MATLAB_class")
            for field in node.values()
        )
        if is_array:
            lists = {name: field for name, field in fields.items() if isinstance(field, list)}
            size = min(map(len, lists.values()), default=0)
            return [{name: field[index] for name, field in lists.items()} for index in range(size)]
        return fields
    if node.dtype == h5py.ref_dtype:
        references = node[()].ravel()[:_MOST_ELEMENTS]
        return [_tree_of_hdf5(file[reference], file, depth + 1) for reference in references if reference]
    array = np.asarray(node[()]).T
    return "".join(map(chr, array.ravel().tolist())).strip() if kind == "char" else array


def _add(name: str, tree: Tree, depth: int, contents: _MatlabFile) -> None:
    """Add a variable and its nested variables, with dotted names, to ``contents``."""
    if depth > _DEEPEST:
        return
    if isinstance(tree, dict):
        for key, inner in tree.items():
            _add(f"{name}.{key}", inner, depth + 1, contents)
        labels = next((contents.texts[f"{name}.{key}"] for key in _LABELS if f"{name}.{key}" in contents.texts), [])
        for number, label in enumerate(labels, start=1):
            column = contents.columns.get(f"{name}.data(:,{number})")
            if column is not None and f"{name}.data(:,{len(labels) + 1})" not in contents.columns and label:
                contents.columns.setdefault(label, column)
    elif isinstance(tree, list):
        if tree and all(isinstance(text, str) for text in tree):
            contents.texts[name] = tree
        for number, inner in enumerate(tree, start=1):
            if isinstance(inner, dict):
                _add(f"{name}({number})", inner, depth + 1, contents)
        contents.words += [text for text in tree if isinstance(text, str)]
    elif isinstance(tree, str):
        contents.texts[name] = [tree]
        contents.words.append(tree)
    elif isinstance(tree, _Object):
        contents.objects.append((name, tree.kind))
    else:
        _add_numbers(name, tree, contents)


def _add_numbers(name: str, array: NDArray[Any], contents: _MatlabFile) -> None:
    """Add a vector, or the columns and rows of a matrix up to a limit, to ``contents``."""
    if array.dtype.kind not in "iufb" or array.size == 0:
        return
    numbers = np.squeeze(np.asarray(array, dtype=np.float64))
    if numbers.ndim <= 1:
        contents.columns[name] = np.atleast_1d(numbers)
    elif numbers.ndim == 2:
        for lines, index in ((numbers.T, ":,{}"), (numbers, "{},:")):
            if len(lines) <= _MOST_COLUMNS:
                contents.columns |= {f"{name}({index.format(k)})": line for k, line in enumerate(lines, start=1)}


def read_mapped_matlab(file: _MatlabFile, columns: ColumnMap, map_name: str) -> MappedTable:
    """Read the columns of a MATLAB file that a map selects, in the units of the file.

    Raises DataError with the key of a channel whose variable is absent or unusable, and with the map if it has a name.
    """
    with in_map(map_name):
        faults = Faults()
        named = {}
        for name, mapped in columns.channels.items():
            with faults:
                if mapped.column is not None:
                    named[name] = _variable(f"channels.{name}.column", mapped.column, file, is_text=name == TIME)
        faults.raise_all()
        date = columns.channels[TIME].date
        clock = file.texts.get(named.get(TIME, ""))
        dates = (
            file.texts.get(_variable(f"channels.{TIME}.date", date, file, is_text=True)) if date is not None else None
        )
        numbers = {name: file.columns[each] for name, each in named.items() if name != TIME or clock is None}
        lengths = {name: values.size for name, values in numbers.items()} | ({TIME: len(clock)} if clock else {})
        if len(set(lengths.values())) != 1:
            listed = ", ".join(f"channels.{name} has {length}" for name, length in lengths.items())
            raise DataError(f"all channels need columns of the same length: {listed or 'no channel has a column'}")
        size = next(iter(lengths.values()))
        for name, values in numbers.items():
            gaps = np.flatnonzero(~np.isfinite(values))
            if gaps.size:
                first = int(gaps[0])
                raise DataError(f"channels.{name}.column: sample {first + 1} is {values[first]}, not a finite number")
    return MappedTable(
        size=size, numbers=numbers, clock=clock, dates=dates, rows=range(1, size + 1), noun="sample", kind="measured"
    )


def _variable(key: str, column: int | str, file: _MatlabFile, is_text: bool) -> str:
    """Return the variable that a map names at ``key``; a number selects a column of the file's only matrix."""
    if isinstance(column, int):
        matrices = sorted({name.partition("(")[0] for name in file.columns if "(:," in name and "." not in name})
        if len(matrices) != 1:
            raise DataError(
                f"{key} = {column}: give the name of a variable instead; the file has {shown_names(file.columns)}"
            )
        column = f"{matrices[0]}(:,{column})"
    name = re.sub(r"\s+", "", column) if "(" in column else column
    known = (*file.columns, *(file.texts if is_text else ()))
    if name not in known:
        raise DataError(
            f"{key} = {column!r}: the file has no such variable{nearest_name(name, known)}; available: "
            f"{shown_names(known)}{file.advice_on_objects()}"
        )
    return name
