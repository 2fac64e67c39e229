"""Catalogues of components (kinds): valves, controllers, effects, ... of this package and of plug-ins.

A catalogue gives the location of each kind of this package as ``module:KIND`` and loads a kind when it is looked up: a
run loads only its own valve and controller. A subpackage that no other one imports is reached only through such a
location; if its folder is not installed, its kinds are not listed. Another package offers a kind as an entry point of
the catalogue's group; an object of a module named by the user is ``my_module:KIND``. Other packages are searched only
for a name that is unknown here.
"""

import dataclasses
import importlib.util
import logging
import sys
import traceback
from collections.abc import Callable, Iterator, Mapping, MutableMapping
from functools import lru_cache, partial
from types import CodeType, FunctionType
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from ppafo.errors import Faults, KindError, PpafoError
from ppafo.plugins import OBJECT, is_working_folder, named_kinds, object_of, without_working_folder
from ppafo.wording import one_line, place

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

logger = logging.getLogger("ppafo")

Kind = TypeVar("Kind")
"""Entry of a catalogue: component with a ``name``, or function of another package."""
_CHECK = "ppafo.engine.trials:check_kind"
"""Check of a component of another package, imported with the first of them."""
_CATALOGUES: list["Kinds[Any]"] = []


class Kinds(MutableMapping[str, Kind], Generic[Kind]):
    """Catalogue of components (kinds) by name, each imported at its first use.

    ``group`` is the group of entry points, ``word`` the name of a kind in messages, ``kind_type`` the class of the
    kinds. ``own`` maps the names of this package's kinds, in order, to kinds or to their locations, ``module:KIND``.
    ``of_modules`` is False for kinds that are never found in a module named by the user.
    """

    def __init__(
        self, group: str, word: str, kind_type: type[Any], own: Mapping[str, Kind | str], of_modules: bool = True
    ) -> None:
        self.group = group
        self._of_modules = of_modules
        self.word = word
        self._kind_type = kind_type
        self._places = {name: kind for name, kind in own.items() if isinstance(kind, str)}
        self._kinds = {name: kind for name, kind in own.items() if not isinstance(kind, str)}
        self._own = dict.fromkeys(own)
        self._absent = {
            name: package_of(location) for name, location in self._places.items() if not is_installed(location)
        }
        for name in self._absent:
            del self._own[name], self._places[name]
        _CATALOGUES.append(self)

    def __getitem__(self, name: str) -> Kind:
        """Return a component by name. Raises KeyError for an unknown name, KindError for an unusable component."""
        if name in self._absent:
            raise KindError(f"{self.word} '{name}' is part of {self._absent[name]}, which is not installed")
        if name not in self._kinds:
            found = kind_at(self._places[name]) if name in self._places else self._find(name)
            if found is None:
                raise KeyError(name)
            self._kinds[name] = found
        return self._kinds[name]

    def __setitem__(self, name: str, kind: Kind) -> None:
        """Add a component for the lifetime of the process."""
        self._kinds[name] = kind

    def __delitem__(self, name: str) -> None:
        """Remove a component from the catalogue."""
        del self._kinds[name]

    def __iter__(self) -> Iterator[str]:
        """Iterate over component names: of this package, then of other packages."""
        return iter((*self._own, *(name for name in self._kinds if name not in self._own)))

    def __len__(self) -> int:
        """Return the number of component names."""
        return len(self._own.keys() | self._kinds.keys())

    def loaded(self) -> dict[str, Kind]:
        """Return the loaded components by name, first those of this package."""
        return {name: self._kinds[name] for name in self if name in self._kinds}

    def is_own(self, name: str) -> bool:
        """Return whether a name is a component of this package."""
        return name in self._own

    def load_own(self) -> None:
        """Load every component of this package."""
        self._kinds |= {name: kind_at(location) for name, location in self._places.items() if name not in self._kinds}

    def load_all(self) -> tuple[str, ...]:
        """Load every component that is installed or in a module of the user; return and log a line for each problem."""
        self.load_own()
        # A module may be named in two ways, and its components are loaded once.
        loaded = {getattr(kind, "name", name) for name, kind in self._kinds.items()}
        named = named_kinds(self._kind_type) if self._of_modules else ()
        wrong = Faults()
        for word, kind in named:
            if kind.name not in loaded:
                with wrong:
                    self._kinds[word] = self._checked(partial(object_of, word), f"{self.word} '{one_line(word)}'", "")
        for point in _entry_points(self.group, _installed_path()):
            with wrong:
                if point.name in self._own:
                    name = f"{self.word} '{one_line(point.name)}' of {_package(point)}"
                    raise KindError(f"{name}: ppafo already has a kind with this name; rename the kind in its package")
                if point.name not in self._kinds:
                    self._kinds[point.name] = self._load(point)
        for error in wrong:
            logger.warning("ppafo: %s", error)
        return tuple(map(str, wrong))

    def _find(self, name: str) -> Kind | None:
        if not name:
            return None
        if OBJECT.fullmatch(name):
            return self._checked(lambda: object_of(name), f"{self.word} '{one_line(name)}'", "")
        points = [point for point in _entry_points(self.group, _installed_path()) if point.name == name]
        # One entry found twice on the search path is no conflict.
        if len({(point.value, _package(point)) for point in points}) > 1:
            packages = ", ".join(sorted({_package(point) for point in points}))
            raise KindError(
                f"{self.word} '{one_line(name)}' is defined by several packages: {packages}; uninstall all but one of "
                "them"
            )
        # All are loaded, so that a message can name what there is.
        if not points:
            self.load_all()
            return None
        return self._load(points[0])

    def _load(self, point: "EntryPoint") -> Kind:
        def load() -> Any:
            with without_working_folder():
                return point.load()

        return self._checked(load, f"{self.word} '{one_line(point.name)}' of {_package(point)}", point.name)

    def _checked(self, load: Callable[[], Any], where: str, called: str) -> Kind:
        """Load a component and check it and its name ``called``. Raises KindError if it is unusable."""
        try:
            kind: Kind = load()
            if dataclasses.is_dataclass(kind):
                kind_at(_CHECK)(kind)
        except KindError as error:
            raise KindError(f"{where}: {one_line(error)}") from error
        except (Exception, SystemExit) as error:  # what another package does when it is imported is anybody's guess
            raise KindError(f"{where} cannot be loaded: {type(error).__name__}: {one_line(error)}") from error
        if not isinstance(kind, self._kind_type):
            is_a = f"is of type {type(kind).__name__}, not {self._kind_type.__name__}"
            raise KindError(f"{where} {is_a}")
        name = getattr(kind, "name", called)
        if called and name != called:
            raise KindError(
                f"{where}: the kind of this entry point is named '{one_line(name)}'; give both the same name"
            )
        return kind


def package_of(location: str) -> str:
    """Return the package of a location: ``ppafo.page`` for ``ppafo.page.commands:workbench``."""
    return ".".join(location.partition(":")[0].split(".")[:2])


def is_installed(location: str) -> bool:
    """Return whether the package of a location is installed."""
    return _is_there(package_of(location))


@lru_cache(maxsize=64)
def _is_there(package: str) -> bool:
    # Catalogues ask for each of their kinds, and a package is looked for once; a folder without modules is none.
    if package in sys.modules:
        return True
    found = importlib.util.find_spec(package)
    return found is not None and found.origin is not None


def declared_kinds(group: str) -> dict[str, str]:
    """Return the components that subpackages add to a catalogue, as ``module:KIND`` by name.

    A catalogue cannot name kinds of packages that depend on it. A subpackage therefore declares its kinds in its
    ``kinds.toml``, like the entry points of another package: without the subpackage the kind is unknown, and nothing
    else changes.
    """
    import tomllib
    from importlib import resources

    found: dict[str, str] = {}
    for folder in sorted(resources.files("ppafo").iterdir(), key=lambda folder: folder.name):
        file = folder / "kinds.toml"
        if file.is_file():
            found |= tomllib.loads(file.read_text(encoding="utf-8")).get(group, {})
    return found


def kind_at(location: str) -> Any:
    """Import the object at a location ``module:NAME`` of this package."""
    module, _, name = location.partition(":")
    return getattr(importlib.import_module(module), name)


def _installed_path() -> tuple[str, ...]:
    """Return the search path without the working folder, whose files somebody else may have made."""
    return tuple(folder for folder in sys.path if not is_working_folder(folder))


@lru_cache(maxsize=32)
def _entry_points(group: str, path: tuple[str, ...]) -> tuple["EntryPoint", ...]:
    """Return the entry points of a group of the packages on a search path, sorted by name."""
    from importlib.metadata import distributions

    found: dict[tuple[str, str], EntryPoint] = {}
    for package in distributions(path=list(path)):
        for point in package.entry_points.select(group=group):
            # Of a package that lies on the path twice the first counts, as for imports.
            found.setdefault((package.name, point.name), point)
    return tuple(sorted(found.values(), key=lambda point: (point.name, point.value)))


def _package(point: "EntryPoint") -> str:
    distribution: Any = point.dist
    return f"'{point.module}'" if distribution is None else f"package '{one_line(distribution.name)}'"


def fault_of_user(error: Exception) -> str:
    """Return a line on the kind of another package behind an error; all that are loaded if it passed no file of one."""
    kinds = _kinds_by_code()
    steps = traceback.extract_tb(error.__traceback__)
    frames = [step for step in steps if step.filename in {code.co_filename for code in kinds}]
    # What this package says of itself is no such error.
    if not kinds or isinstance(error, PpafoError):
        return ""
    passed = {frame.name for frame in frames}
    codes = [code for code in kinds if code.co_name in passed] or list(kinds)
    functions = [f"{kinds[code]}: {code.co_name}({', '.join(code.co_varnames[: code.co_argcount])})" for code in codes]
    places = [(code.co_filename, code.co_firstlineno) for code in codes]
    places += [(frame.filename, frame.lineno or 0) for frame in frames]
    return f"{place(*places[-1])}: {' or '.join(functions)}: {type(error).__name__}: {error}"


def _kinds_by_code() -> dict[CodeType, str]:
    """Return the kinds of other packages and of the user's modules, as in messages, by the code of their functions."""
    kinds: dict[CodeType, str] = {}
    for catalogue in _CATALOGUES:
        for name, kind in catalogue.loaded().items():
            for part in () if catalogue.is_own(name) else (kind, getattr(kind, "model", None)):
                for item in (part, *(getattr(part, field) for field in getattr(part, "__dataclass_fields__", ()))):
                    if isinstance(item, FunctionType) and not item.__module__.startswith("ppafo."):
                        kinds[item.__code__] = f"{catalogue.word} '{one_line(name)}'"
    return kinds
