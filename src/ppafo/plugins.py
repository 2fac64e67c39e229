"""Plug-ins: user modules that files may refer to as ``module:OBJECT``, once the user has named them.

Files may come from other people and must not run code. A word in a file therefore finds an object only if the user
named its module: on the command line, as ``plugins`` of a call in Python, or by importing the module.
"""

import importlib
import importlib.machinery
import os
import re
import site
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any

from ppafo.errors import KindError
from ppafo.wording import nearest_name, one_line

Plugins = Iterable[str | Path]
"""Plug-ins as files (``laws.py``) or module names (``my_laws.hysteresis``)."""

VARIABLE = "PPAFO_PLUGINS"
"""Environment variable that passes the names of plug-ins to child processes."""

_NAME = r"[^\W\d]\w*(?:\.[^\W\d]\w*)*"
_MODULE = re.compile(_NAME)
OBJECT = re.compile(rf"{_NAME}:[^\W\d]\w*")
_OBJECT_IN_TEXT = re.compile(rf"(?<![\w.:/])({_NAME}):[^\W\d]\w*(?![\w.:/])")
_SUFFIX = ".py"
_PACKAGE = "__init__.py"


@dataclass(frozen=True, slots=True)
class _Plugin:
    """Plug-in by module name, with its folder; without folder on the usual search path."""

    module: str
    folder: str = ""


_named: dict[str, _Plugin] = {}


def name_plugins(plugins: Plugins | str | Path) -> None:
    """Allow files to refer to objects of plug-ins, which are not yet imported. Raises KindError if missing."""
    for plugin in (plugins,) if isinstance(plugins, str | Path) else plugins:
        for found in _found(plugin):
            add_plugin(found)


def name_modules_in(text: str) -> None:
    """Allow the modules of all words ``module:OBJECT`` in a text typed by the user, such as a ``--set`` value."""
    for module in _OBJECT_IN_TEXT.findall(text):
        add_plugin(_of_module(module))


def add_plugin(plugin: _Plugin) -> None:
    """Allow a plug-in. Raises KindError if another folder has a module of the same name."""
    earlier = {item.module: item for item in named_plugins()}.get(plugin.module)
    if earlier is not None and earlier.folder and plugin.folder and earlier.folder != plugin.folder:
        raise KindError(f"plugin '{plugin.module}': is in {earlier.folder} and in {plugin.folder}; rename one of them")
    if earlier is None or plugin.folder:
        _named[plugin.module] = plugin
    os.environ[VARIABLE] = os.pathsep.join(f"{item.module}={item.folder}" for item in _named.values())


def named_plugins() -> tuple[_Plugin, ...]:
    """Return the plug-ins named so far, in this process or its parent."""
    for text in filter(None, os.environ.get(VARIABLE, "").split(os.pathsep)):
        module, _, folder = text.partition("=")
        _named.setdefault(module, _Plugin(module, folder))
    return tuple(_named.values())


def _found(plugin: str | Path) -> tuple[_Plugin, ...]:
    """Return the plug-in of a path or module name, under all its names. Raises KindError if absent."""
    text = str(plugin)
    path = Path(text).absolute()
    if (path / _PACKAGE).is_file():
        return (_of_path(path),)
    if path.suffix == _SUFFIX and path.is_file():
        found = _of_path(path)
        # From here it has the names of its folders before its own, though none of them says that it is a package.
        dotted = ".".join(Path(text).with_suffix("").parts)
        is_another = dotted != found.module and _MODULE.fullmatch(dotted) is not None
        return (found, _Plugin(dotted, str(Path.cwd()))) if is_another else (found,)
    module = text.partition(":")[0]
    if path.suffix == _SUFFIX or not _MODULE.fullmatch(module):
        raise KindError(f"plugin '{one_line(text)}': file not found; give a .py file, or the name of a module")
    named = _of_module(module)
    if not named.folder and not _is_installed(module.partition(".")[0]):
        raise KindError(f"plugin '{one_line(text)}': module not found; give the path of its .py file")
    return (named,)


def _of_path(path: Path) -> _Plugin:
    """Return the plug-in of a file, with the names of enclosing packages."""
    parts = [path.stem]
    folder = path.parent
    while (folder / _PACKAGE).is_file():
        parts.insert(0, folder.name)
        folder = folder.parent
    return _Plugin(".".join(parts), str(folder))


def _of_module(module: str) -> _Plugin:
    """Return the plug-in of a module name; from the working folder only if not installed."""
    top = module.partition(".")[0]
    here = str(Path.cwd())
    if _is_installed(top) or importlib.machinery.PathFinder.find_spec(top, [here]) is None:
        return _Plugin(module)
    return _Plugin(module, here)


def _is_installed(top: str) -> bool:
    """Return whether a module is found without the working folder."""
    if top in sys.modules or top in sys.builtin_module_names:
        return True
    with without_working_folder():
        return importlib.machinery.PathFinder.find_spec(top) is not None


def object_of(word: str) -> Any:
    """Return the object of a word ``module:OBJECT``. Raises KindError unless the user named its module."""
    module, _, name = word.partition(":")
    named = {plugin.module: plugin for plugin in named_plugins()}
    # A package that is named includes its modules.
    parents = [module[:end] for end, character in enumerate(module) if character == "."]
    plugin = next((named[known] for known in (module, *reversed(parents)) if known in named), None)
    if plugin is None and module not in sys.modules:
        raise KindError(
            f"module '{module}' is not loaded, because a file alone must not run code; if you trust the module, add "
            f"--plugin {_remedy(module)} (in Python plugins=['{_remedy(module)}'])"
        )
    loaded = sys.modules[module] if plugin is None else _imported(module, plugin.folder)
    if plugin is None and name not in vars(loaded):
        # Not asked by getattr, which may call a function of the module.
        raise AttributeError(f"module '{module}' has no attribute '{name}'")
    return getattr(loaded, name)


def nearest_kind(name: str, allowed: Iterable[str], kind_type: type = object) -> str:
    """Return a hint as ``nearest_name`` does, also of components in modules that the user named: ``module:OBJECT``."""
    words = list(allowed)
    for word, item in named_kinds(kind_type):
        words.append(word)
        if item.name == name:
            return f", did you mean '{word}'?"
    return nearest_name(name, words)


def named_kinds(kind_type: type) -> Iterator[tuple[str, Any]]:
    """Yield the components in modules that the user named, with their words ``module:OBJECT``."""
    for plugin in named_plugins():
        try:
            module = _imported(plugin.module, plugin.folder)
        except (
            Exception,
            SystemExit,
        ):  # a broken module, whatever it raises, is refused where one of its objects is named
            continue
        for key, item in vars(module).items():
            own_name = getattr(item, "name", None) if type(item).__module__.startswith("ppafo.") else None
            if isinstance(own_name, str) and isinstance(item, kind_type):
                yield f"{plugin.module}:{key}", item


def plugin_words(text: str) -> list[str]:
    """Return the words ``--plugin FILE`` of the plug-ins whose objects a text names."""
    named = {plugin.module for plugin in named_plugins()}
    modules = dict.fromkeys(module for module in _OBJECT_IN_TEXT.findall(text) if module in named)
    return [word for module in modules for word in ("--plugin", _remedy(module))]


def _remedy(module: str) -> str:
    """Return the argument that allows a module: its path if in the working folder."""
    file = Path(*module.split(".")).with_suffix(_SUFFIX)
    if not file.is_file():
        return module if Path(module.partition(".")[0]).is_dir() else f"PATH/{file.as_posix()}"
    return file.as_posix() if _of_path(file.absolute()).module == module else module


def _imported(module: str, folder: str) -> Any:
    # The folder is searched last, so that it hides no other module.
    is_added = folder not in ("", *sys.path)
    if is_added:
        sys.path.append(folder)
        importlib.invalidate_caches()
    try:
        loaded = importlib.import_module(module)
    finally:
        if is_added:
            sys.path.remove(folder)
    files = [*getattr(loaded, "__path__", ()), getattr(loaded, "__file__", None) or ""]
    if folder and not any(Path(file).is_relative_to(folder) for file in files):
        raise KindError(
            f"module '{module}' of {folder} has the same name as another module ({files[-1]}); rename the module in "
            f"{folder}"
        )
    return loaded


@contextmanager
def without_working_folder() -> Iterator[None]:
    """Remove the working folder from Python's search path in a ``with`` block."""
    before = sys.path[:]
    sys.path[:] = [folder for folder in before if not is_working_folder(folder)]
    try:
        yield
    finally:
        sys.path[:] = before


def is_working_folder(folder: str | Path) -> bool:
    """Return whether an entry of Python's search path is the working folder, with possibly untrusted files.

    False for the source folder of an editable installation, even if the command runs in it.
    """
    try:
        is_here = os.path.samefile(folder or ".", ".")  # noqa: PTH121
    except OSError:  # the search path has folders that are not there
        return False
    return is_here and Path.cwd().resolve() not in _pth_folders(*site.getsitepackages(), site.getusersitepackages())


# Python reads path files when it starts, and every lookup of a kind in a notebook asks for them.
@lru_cache(maxsize=4)
def _pth_folders(*packages: str) -> frozenset[Path]:
    """Return the folders that ``.pth`` files in package folders add to the search path."""
    folders = set()
    for file in (file for folder in packages for file in Path(folder).glob("*.pth")):
        lines = file.read_text(encoding="utf-8", errors="replace").splitlines()
        folders |= {(file.parent / line.strip()).resolve() for line in lines if not line.startswith(("import", "#"))}
    # An empty line stands for the folder of packages itself.
    return frozenset(folders - {Path(folder).resolve() for folder in packages})
