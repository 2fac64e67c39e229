"""Print the licences of the run-time lock as a table, from what each package says of itself.

    python scripts/licences.py

Name and version come from ``requirements.lock``, the licence from the metadata of the package that is installed.
"""

import re
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

_LOCK = Path(__file__).parents[1] / "requirements.lock"
_LONGEST = 60
"""Longer than a name of licences is the text of one."""


def locked() -> dict[str, str]:
    """Return the versions of the lock by package; several where they depend on Python's own version."""
    found: dict[str, str] = {}
    for name, version in re.findall(r"^([\w.-]+)==([\w.+-]+)", _LOCK.read_text(encoding="utf-8"), re.MULTILINE):
        found[name] = f"{found[name]}, {version}" if name in found else version
    return found


def licence(name: str) -> str:
    """Return what a package says is its licence: the expression, else the classifier, else the text if it is short."""
    try:
        said = distribution(name).metadata
    except PackageNotFoundError:
        return "(not installed here)"
    classifiers = [item.rpartition(" :: ")[2] for item in said.get_all("Classifier") or () if "License" in item]
    expression, text = ("".join(said.get_all(key) or ()) for key in ("License-Expression", "License"))
    short = text if len(text) <= _LONGEST and "\n" not in text else ""
    return expression or ", ".join(classifiers) or short or "(see the package)"


if __name__ == "__main__":
    print("| package | version | licence |\n|---|---|---|")
    for package, versions in locked().items():
        print(f"| {package} | {versions} | {licence(package)} |")
