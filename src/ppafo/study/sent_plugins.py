"""Modules of the person on the workers of a cluster: sent with each task, and written where a worker lacks them."""

import atexit
import hashlib
import sys
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from ppafo.errors import KindError
from ppafo.plugins import Plugin, add_plugin, named_plugins
from ppafo.storage.files import temporary_folder


@dataclass(frozen=True, slots=True)
class SentPlugin:
    """A module that was named, and the content of the files that it is made of, by their names in its folder."""

    plugin: Plugin
    files: tuple[tuple[str, bytes], ...]

    @property
    def digest(self) -> str:
        """Hash of the version of the module."""
        return hashlib.sha256(repr(self.files).encode()).hexdigest()


def plugins_to_send() -> tuple[SentPlugin, ...]:
    """Return what was named in this process, with every file of its folder that was loaded."""
    return tuple(SentPlugin(plugin, _files_of(plugin)) for plugin in named_plugins())


def _files_of(plugin: Plugin) -> tuple[tuple[str, bytes], ...]:
    """Return name and content of every file of a module's folder that this process has loaded."""
    if not plugin.folder:
        return ()
    loaded = {getattr(module, "__file__", None) for module in [*sys.modules.values()]}
    paths = sorted(Path(file) for file in loaded if file and Path(file).is_relative_to(plugin.folder))
    return tuple((path.relative_to(plugin.folder).as_posix(), path.read_bytes()) for path in paths if path.is_file())


_taken: dict[str, str] = {}
"""The version of each module that this process has."""


def take_plugins(sent: Iterable[SentPlugin]) -> None:
    """Name what was sent. KindError where this process runs another version of it already."""
    for plugin in sent:
        module = plugin.plugin.module
        if _taken.setdefault(module, plugin.digest) != plugin.digest:
            raise KindError(f"plugin '{module}': a worker has loaded an earlier version of it; restart the workers")
        folder = Path(plugin.plugin.folder)
        is_here = all(_has(folder / name, content) for name, content in plugin.files)
        add_plugin(plugin.plugin if is_here else Plugin(module, _written(plugin)))


def _has(path: Path, content: bytes) -> bool:
    """Tell whether a file with this content is there."""
    return path.is_file() and path.read_bytes() == content


@lru_cache(maxsize=32)
def _written(sent: SentPlugin) -> str:
    """Write files into a temporary folder of this process, and return that."""
    folder = temporary_folder("ppafo-plugins", dict(sent.files))
    atexit.register(folder.cleanup)
    return folder.name
