"""Compilers and compiled models of this computer, in words and as data."""

import time
from pathlib import Path
from typing import Any

from ppafo.engine.cache import LONGEST_UNUSED, MAXIMUM_BYTES, kept_sizes, list_left_out, list_programs
from ppafo.engine.loading import compilers_to_try

_DAY = 86400.0


def models_document(folder: Path | None, why_not: str) -> dict[str, Any]:
    """Return compilers and kept models of a cache folder; ``why_not`` says why that one is not used, if so."""
    programs = [] if folder is None else list_programs(folder)
    now = time.time()
    return {
        "compilers": [compiler.name for compiler in compilers_to_try()],
        "folder": None if folder is None else str(folder),
        "not_used": why_not or None,
        "size": sum(program.size for program in programs),
        "made_from_programs": 0 if folder is None else sum(kept_sizes(folder)),
        "left_out": {} if folder is None else list_left_out(folder),
        "kept_unused_days": LONGEST_UNUSED / _DAY,
        "most_bytes": MAXIMUM_BYTES,
        "programs": [
            {"name": program.place.name, "size": program.size, "unused_days": max(0.0, (now - program.used) / _DAY)}
            for program in programs
        ],
    }


def models_text(document: dict[str, Any]) -> str:
    """Return ``models_document`` in words."""
    lines = [f"compilers: {', '.join(document['compilers'])}", f"folder: {document['folder'] or 'none'}"]
    if document["not_used"]:
        lines.append(f"not used: {document['not_used']}")
    if "freed" in document:
        lines.append(f"removed: {_megabytes(document['freed'])}")
    lines.append(f"programs: {len(document['programs'])}, {_megabytes(document['size'])}")
    if document["made_from_programs"]:
        lines.append(f"texts of programs and their forms for pages: {_megabytes(document['made_from_programs'])}")
    lines += [
        f"  {item['name']}  {_megabytes(item['size']):>8}  last used {_days(item['unused_days'])}"
        for item in document["programs"]
    ]
    lines += [f"left out for a day: {name}: {why}" for name, why in document["left_out"].items()]
    limits = f"{document['kept_unused_days']:.0f} days unused, or above {_megabytes(document['most_bytes'])} in all"
    return "\n".join([*lines, f"removed by themselves: after {limits}"])


def _megabytes(size: int) -> str:
    return f"{size / 1e6:.1f} MB"


def _days(days: float) -> str:
    return "today" if days < 1.0 else f"{days:.0f} day{'' if int(days + 0.5) == 1 else 's'} ago"
