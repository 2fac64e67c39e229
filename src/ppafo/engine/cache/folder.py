"""Cache folder of compiled programs, and protection against code that another user could put into it."""

import contextlib
import os
import stat
from functools import cache
from pathlib import Path

from ppafo.wording import reason

CACHE_VARIABLE = "PPAFO_CACHE_DIR"
TEXTS = "made"
"""Folder of texts inside the folder of the programs."""
LOCK = ".lock-"
"""Prefix of lock file names; the name of the program follows."""
NOTE = "not-working-"
"""Prefix of the names of files with the reason why a compiler does not work on this computer."""
LEFT_OUT_FOR = 86400.0
"""Time [s] after which a compiler that failed is tried again, because missing headers may have been installed."""
_WRITTEN_BY_OTHERS = stat.S_IWGRP | stat.S_IWOTH


def cache_folder() -> Path | None:
    """Return the cache folder of programs: ``PPAFO_CACHE_DIR``, or the user's cache; None without a home folder."""
    if os.environ.get(CACHE_VARIABLE):
        return Path(os.environ[CACHE_VARIABLE]).absolute()
    import platformdirs

    try:
        folder = Path(platformdirs.user_cache_dir("ppafo", appauthor=False)) / "programs"
    except RuntimeError:
        return None
    return folder if folder.is_absolute() else None


def refusal(folder: Path | None) -> str:
    """Return the reason why a cache folder cannot be used, as the end of a sentence; empty if the folder can be used.

    A missing folder is created. The folder must belong to this user and must not be a link, and no other user may be
    able to write to it or to replace it.
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
        return f"{folder} cannot be created: {reason(error)}"
    has_users = hasattr(os, "geteuid")
    if not stat.S_ISDIR(status.st_mode):
        why_not = f"{folder} is {'a link' if stat.S_ISLNK(status.st_mode) else 'not a folder'}"
    elif has_users and status.st_uid != os.geteuid():
        why_not = f"{folder} belongs to another user"
    elif has_users and status.st_mode & _WRITTEN_BY_OTHERS:
        why_not = f"other users can write into {folder}; run 'ppafo doctor --clear' and 'chmod 700'"
    elif has_users and any(_can_be_exchanged(status_above) for status_above in above):
        why_not = f"other users can replace {folder}"
    else:
        why_not = "" if os.access(folder, os.W_OK | os.X_OK) else f"{folder} cannot be written"
    return why_not


def _can_be_exchanged(folder_status: os.stat_result) -> bool:
    """Return whether another user can rename entries of a folder."""
    if folder_status.st_uid not in (0, os.geteuid()):
        return True
    # A sticky folder such as /tmp lets each user rename only what is his own.
    writers = stat.S_IWOTH if _is_own_group(folder_status.st_gid) else _WRITTEN_BY_OTHERS
    return bool(folder_status.st_mode & writers and not folder_status.st_mode & stat.S_ISVTX)


@cache
def _is_own_group(number: int) -> bool:
    """Return whether only this user belongs to a group; many systems give each user a private group."""
    import grp
    import pwd

    try:
        user, group = pwd.getpwuid(os.geteuid()), grp.getgrgid(number)
    except KeyError:
        return False
    return user.pw_gid == number and group.gr_name == user.pw_name and set(group.gr_mem) <= {user.pw_name}


def is_private(*paths: Path) -> bool:
    """Return whether files and folders belong to this user or root, are no links and are writable for nobody else.

    Nobody else can change one between this check and its use. OSError for a path that is not there.
    """
    statuses = [path.lstat() for path in paths]
    if not all(stat.S_ISREG(status.st_mode) or stat.S_ISDIR(status.st_mode) for status in statuses):
        return False
    # Root may own a file: what root can do, no check prevents.
    return not hasattr(os, "geteuid") or all(
        status.st_uid in (0, os.geteuid()) and not status.st_mode & _WRITTEN_BY_OTHERS for status in statuses
    )
