"""Catalogues of kinds: kinds of this package, and kinds that other packages offer, found when they are requested.

A catalogue names the place of a kind of this package, ``module:KIND``, which is loaded when the kind is looked up: a
run loads the valve and the controller that it has, and no other. A guest, a package that no other imports, is reached
by such a name alone; where its folder is not installed its kinds are not listed. Another package offers a kind as an
entry point of the catalogue's group; an object of a module that the person named is ``my_module:KIND``. Nothing is
looked for before a name is requested that is not here.
"""

import importlib.util
import logging
import sys
from collections.abc import Callable, Iterator, Mapping, MutableMapping
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from ppafo.errors import KindError
from ppafo.plugins import OBJECT, is_working_folder, object_of, without_working_folder
from ppafo.wording import one_line

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

logger = logging.getLogger("ppafo")

Kind = TypeVar("Kind")
"""Entry of a catalogue: it has a ``name``, or is another package's function, named by its entry point."""


class Kinds(MutableMapping[str, Kind], Generic[Kind]):
    """Kinds by name. Looking a name up loads its kind, also from another package; names are known without loading.

    ``group`` is the group of entry points, ``word`` what messages call a kind, ``kind_type`` what each of them is.
    ``own`` are the kinds of this package by name, in their order: kinds, or where each is, as ``module:KIND``.
    """

    def __init__(self, group: str, word: str, kind_type: type[Any], own: Mapping[str, Kind | str]) -> None:
        self.group = group
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

    def __getitem__(self, name: str) -> Kind:
        """Return a kind; KeyError where there is none, KindError where it is there and cannot be used."""
        if name in self._absent:
            raise KindError(f"{self.word} '{name}' is part of {self._absent[name]}, which is not installed")
        if name not in self._kinds:
            found = kind_at(self._places[name]) if name in self._places else self._find(name)
            if found is None:
                raise KeyError(name)
            self._kinds[name] = found
        return self._kinds[name]

    def __setitem__(self, name: str, kind: Kind) -> None:
        """Add a kind for as long as the program runs."""
        self._kinds[name] = kind

    def __delitem__(self, name: str) -> None:
        """Forget a kind."""
        del self._kinds[name]

    def __iter__(self) -> Iterator[str]:
        """Names of the kinds of this package, then of loaded kinds of other packages."""
        return iter((*self._own, *(name for name in self._kinds if name not in self._own)))

    def __len__(self) -> int:
        """Return how many names are known."""
        return len(self._own.keys() | self._kinds.keys())

    def loaded(self) -> dict[str, Kind]:
        """Return the loaded kinds by name: kinds of this package first, in their order."""
        return {name: self._kinds[name] for name in self if name in self._kinds}

    def loaded_or_own(self) -> dict[str, Kind]:
        """Return the kinds that are loaded; where nothing named one, all of this package."""
        if not self._kinds:
            self.load_own()
        return self.loaded()

    def is_own(self, name: str) -> bool:
        """Tell whether a name belongs to a kind of this package."""
        return name in self._own

    def load_own(self) -> None:
        """Load every kind of this package."""
        self._kinds |= {name: kind_at(location) for name, location in self._places.items() if name not in self._kinds}

    def load_all(self) -> tuple[str, ...]:
        """Load every kind that is installed; return one line for each that cannot be used, and log it."""
        self.load_own()
        problems = []
        for point in _entry_points(self.group, _installed_path()):
            try:
                if point.name in self._own:
                    name = f"{self.word} '{one_line(point.name)}' of {_package(point)}"
                    raise KindError(f"{name} has the name of one of ppafo's own; it needs another name")
                if point.name not in self._kinds:
                    self._kinds[point.name] = self._load(point)
            except KindError as error:
                logger.warning("ppafo: %s", error)
                problems.append(str(error))
        return tuple(problems)

    def _find(self, name: str) -> Kind | None:
        if not name:
            return None
        if OBJECT.fullmatch(name):
            return self._checked(lambda: object_of(name), f"{self.word} '{one_line(name)}'", "")
        points = [point for point in _entry_points(self.group, _installed_path()) if point.name == name]
        # One entry found twice on the search path is no conflict.
        if len({(point.value, _package(point)) for point in points}) > 1:
            packages = ", ".join(sorted({_package(point) for point in points}))
            raise KindError(f"{self.word} '{one_line(name)}' is offered by several packages: {packages}")
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
        """Return what is loaded where it is a kind, of a name that was given; KindError where it is none."""
        try:
            kind: Kind = load()
        except KindError as error:
            raise KindError(f"{where}: {one_line(error)}") from error
        except Exception as error:  # what another package does when it is imported is anybody's guess
            raise KindError(f"{where} cannot be loaded: {type(error).__name__}: {one_line(error)}") from error
        if not isinstance(kind, self._kind_type):
            is_a = f"is of type {type(kind).__name__}, not {self._kind_type.__name__}"
            raise KindError(f"{where} {is_a}")
        name = getattr(kind, "name", called)
        if called and name != called:
            raise KindError(f"{where} calls itself '{one_line(name)}'; entry point and kind need one name")
        return kind


def package_of(location: str) -> str:
    """Return the package of a place, ``ppafo.page`` of ``ppafo.page.workbench:live_part``."""
    return ".".join(location.partition(":")[0].split(".")[:2])


def is_installed(location: str) -> bool:
    """Tell whether the package of a place is there."""
    return _is_there(package_of(location))


@lru_cache(maxsize=64)
def _is_there(package: str) -> bool:
    # Catalogues ask for each of their kinds, and a package is looked for once; a folder without modules is none.
    if package in sys.modules:
        return True
    found = importlib.util.find_spec(package)
    return found is not None and found.origin is not None


def declared_kinds(group: str) -> dict[str, str]:
    """Return the kinds of a catalogue, as ``module:KIND`` by name, that folders of this package declare for it.

    A catalogue cannot name what is built on it. So a folder says in its ``kinds.toml`` what it offers, as another
    package does by entry points: without the folder the kind is not known, and nothing else changes.
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
    """Return what stands at ``module:NAME``, a place in this package."""
    module, _, name = location.partition(":")
    return getattr(importlib.import_module(module), name)


def _installed_path() -> tuple[str, ...]:
    return tuple(folder for folder in sys.path if not is_working_folder(folder))


@lru_cache(maxsize=32)
def _entry_points(group: str, _path: tuple[str, ...]) -> tuple["EntryPoint", ...]:
    """Entry points of a group for a search path, in the order of their names."""
    from importlib.metadata import entry_points

    # The path is part of the key, as it may grow while the program runs. What lies in the working folder is no package
    # that somebody installed, but a file of whoever made the folder.
    found = [
        point
        for point in entry_points(group=group)
        if not (point.dist is not None and is_working_folder(str(point.dist.locate_file(""))))
    ]
    return tuple(sorted(found, key=lambda point: (point.name, point.value)))


def _package(point: "EntryPoint") -> str:
    distribution: Any = point.dist
    return f"'{point.module}'" if distribution is None else f"package '{one_line(distribution.name)}'"
