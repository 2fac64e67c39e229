"""Cache folder of compiled programs, and protection against code that another user could put into it."""

import contextlib
import os
import stat
from collections.abc import Collection
from functools import cache
from pathlib import Path

from ppafo.wording import reason

CACHE_VARIABLE = "PPAFO_CACHE_DIR"
TEXTS = "made"
"""Folder of texts inside the folder of the programs."""
LOCK = ".lock-"
"""Beginning of the name of a lock file; the rest is the program's."""
NOTE = "not-working-"
"""Beginning of the name of a file that says why a compiler does not work on this computer."""
LEFT_OUT_FOR = 86400.0
"""Seconds after which a compiler that did not work is tried again: headers may have been installed."""
_WRITTEN_BY_OTHERS = stat.S_IWGRP | stat.S_IWOTH


def cache_folder() -> Path | None:
    """Return the folder of the programs: ``PPAFO_CACHE_DIR``, or the user's cache; None where the user has no home."""
    if os.environ.get(CACHE_VARIABLE):
        return Path(os.environ[CACHE_VARIABLE]).absolute()
    import platformdirs

    try:
        folder = Path(platformdirs.user_cache_dir("ppafo", appauthor=False)) / "programs"
    except RuntimeError:
        return None
    return folder if folder.is_absolute() else None


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
        status = folder.lstat()
        # Whoever can write in any folder above can rename this one and put his own in its place.
        above = [parent.stat() for parent in Path(os.path.realpath(folder)).parents]
    except (OSError, ValueError) as error:
        return f"{folder} cannot be made: {reason(error)}"
    has_users = hasattr(os, "geteuid")
    if not stat.S_ISDIR(status.st_mode):
        why_not = f"{folder} is {'a link' if stat.S_ISLNK(status.st_mode) else 'not a folder'}"
    elif has_users and status.st_uid != os.geteuid():
        why_not = f"{folder} belongs to another user"
    elif has_users and status.st_mode & _WRITTEN_BY_OTHERS:
        why_not = f"others can write into {folder}; 'ppafo doctor --clear' and 'chmod 700' make it safe"
    elif has_users and any(_can_be_exchanged(status_above) for status_above in above):
        why_not = f"others can put another folder in the place of {folder}"
    else:
        why_not = "" if os.access(folder, os.W_OK | os.X_OK) else f"{folder} cannot be written"
    return why_not


def _can_be_exchanged(folder_status: os.stat_result) -> bool:
    """Return whether another user can rename what lies in a folder."""
    if folder_status.st_uid not in (0, os.geteuid()):
        return True
    # A sticky folder such as /tmp lets each user rename only what is his own.
    writers = stat.S_IWOTH if _is_own_group(folder_status.st_gid) else _WRITTEN_BY_OTHERS
    return bool(folder_status.st_mode & writers and not folder_status.st_mode & stat.S_ISVTX)


@cache
def _is_own_group(number: int) -> bool:
    """Return whether a group is this user's alone: many systems give each user one, which may write where they may."""
    import grp
    import pwd

    try:
        user, group = pwd.getpwuid(os.geteuid()), grp.getgrgid(number)
    except KeyError:
        return False
    return user.pw_gid == number and group.gr_name == user.pw_name and set(group.gr_mem) <= {user.pw_name}


def is_own_file(status: os.stat_result, above: os.stat_result) -> bool:
    """Return whether a file and its folder are this user's, or root's, and nobody else can write into either."""
    if not (stat.S_ISREG(status.st_mode) and stat.S_ISDIR(above.st_mode)):
        return False
    if not hasattr(os, "geteuid"):
        return True
    is_written = (status.st_mode | above.st_mode) & _WRITTEN_BY_OTHERS
    return not is_written and {status.st_uid, above.st_uid} <= {0, os.geteuid()}


def is_own(kept: Path, files: Collection[str]) -> bool:
    """Return whether a program and all in it is this user's, and nobody else can write into its ``files`` and folders.

    What came while others could write stays theirs. Nobody else can then change a file between this look and its use.
    """
    statuses = [kept.lstat()]
    for entry in kept.rglob("*"):
        with contextlib.suppress(FileNotFoundError):
            statuses.append(entry.lstat())
    if not hasattr(os, "geteuid"):
        return stat.S_ISDIR(statuses[0].st_mode)
    # Root may own a file: what root can do, no check prevents.
    is_whose = all(status.st_uid in (0, os.geteuid()) for status in statuses)
    used = [status for status in statuses if stat.S_ISDIR(status.st_mode)]
    is_folder = statuses[0] in used
    used += [(kept / name).lstat() for name in files]
    return is_whose and is_folder and bool(files) and not any(status.st_mode & _WRITTEN_BY_OTHERS for status in used)
