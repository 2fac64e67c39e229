"""Whether a folder is this user's alone: what is loaded from it is run."""

import contextlib
import os
import stat
from pathlib import Path

from ppafo.errors import reason

WRITTEN_BY_OTHERS = stat.S_IWGRP | stat.S_IWOTH


def refusal(folder: Path | None) -> str:
    """Return why programs are neither read from nor kept in a folder, as the end of a sentence; empty where they are.

    The folder is made if need be. It must be this user's own and no link, and nobody else may write it or put another
    in its place.
    """
    if folder is None:
        return "this user has no home folder"
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with contextlib.suppress(FileExistsError):
            folder.mkdir(mode=0o700)
        found = folder.lstat()
        above = [place.stat() for place in Path(os.path.realpath(folder)).parents]
    except (OSError, ValueError) as error:
        return f"{folder} cannot be made: {reason(error)}"
    whose = _why_not_private(folder, found, above)
    if whose or os.access(folder, os.W_OK | os.X_OK):
        return whose
    return f"{folder} cannot be written"


def _why_not_private(folder: Path, found: os.stat_result, above: list[os.stat_result]) -> str:
    if not stat.S_ISDIR(found.st_mode):
        return f"{folder} is {'a link' if stat.S_ISLNK(found.st_mode) else 'not a folder'}"
    if not hasattr(os, "geteuid"):
        return ""
    if found.st_uid != os.geteuid():
        return f"{folder} belongs to another user"
    if found.st_mode & WRITTEN_BY_OTHERS:
        return f"others can write into {folder}; 'ppafo cache --clear' and 'chmod 700' make it safe"
    is_exchanged = any(_can_be_exchanged(place) for place in above)
    return f"others can put another folder in the place of {folder}" if is_exchanged else ""


def _can_be_exchanged(place: os.stat_result) -> bool:
    """Tell whether another user can rename what lies in a folder."""
    is_theirs = place.st_uid not in (0, os.geteuid())
    return is_theirs or bool(place.st_mode & stat.S_IWOTH and not place.st_mode & stat.S_ISVTX)
