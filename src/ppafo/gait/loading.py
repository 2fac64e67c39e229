"""From a name or a file to a gait."""

from importlib import resources
from pathlib import Path

from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import DataError
from ppafo.gait.document import gait_of
from ppafo.gait.gait import Gait
from ppafo.gait.plausible.stride import check_gait

NORMATIVE = "falisse2019-subject1"
"""The gait that is taken where none is named."""

_FILE = TomlKind("gait", "gait", resources.files("ppafo") / "gait" / "normative", DataError)


def list_gaits() -> tuple[str, ...]:
    """Return the names of the gaits that come with the package."""
    return _FILE.names()


def load_gait(name_or_path: str | Path = NORMATIVE) -> Gait:
    """Return a gait by its name in the package or by the path of a gait file (TOML), in SI units.

    DataError where it cannot be used.
    """
    return parse_gait(_FILE.read(name_or_path), str(name_or_path))


def parse_gait(content: bytes, file: str) -> Gait:
    """Return the gait in the bytes of a gait file; ``file`` is what messages call it. DataError where it cannot be."""
    gait = gait_of(_FILE.parse(content, label(file)), label(file))
    check_gait(gait, label(file))
    return gait
