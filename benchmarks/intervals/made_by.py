"""Which code made a finished fit: fits of two versions are not counted together as if they were of one."""

import hashlib
from collections import Counter
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path

import ppafo.identification
from ppafo.errors import IdentificationError
from ppafo.version import __version__


@cache
def code_now() -> str:
    """Return the version of the package and the hash of the text of its identification, in words."""
    folder = Path(ppafo.identification.__file__).parent
    digest = hashlib.sha256()
    for path in sorted(folder.rglob("*.py")):
        digest.update(f"{path.relative_to(folder).as_posix()}\n".encode() + path.read_bytes())
    return f"ppafo {__version__}, identification {digest.hexdigest()[:12]}"


def check_code(file: Path, codes: Sequence[str], missing: int, warn: Callable[[str], None]) -> None:
    """Refuse to add ``missing`` fits to those of other code; ``codes`` are of the fits there, empty where unknown.

    Where none is missing, and for fits that do not say what made them, ``warn`` is told. IdentificationError.
    """
    now, counts = code_now(), Counter(codes)
    unknown = counts.pop("", 0)
    others = "; ".join(f"fits by {code} ({count})" for code, count in counts.items() if code != now)
    if others and missing:
        raise IdentificationError(
            f"{file}: has {others}, this is {now}; {missing} more would be counted with them: choose another folder, "
            "or go on with the code that began this one"
        )
    if others:
        warn(f"{file}: has {others}, this is {now}")
    if unknown:
        warn(f"{file}: which code made them is not said of {unknown} of {len(codes)} fits; they are counted")


def whole_lines(file: Path) -> list[str]:
    """Return the lines of a study's file, none where there is no file; a last line that was cut off is cut away.

    What is added next then begins a line of its own.
    """
    if not file.exists():
        return []
    content = file.read_bytes()
    whole = content[: content.rfind(b"\n") + 1]
    if whole != content:
        file.write_bytes(whole)
    return whole.decode("utf-8").splitlines()
