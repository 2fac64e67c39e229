"""What a release says of itself: the code of others in it, with version and licence."""

import re
import runpy
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest
from hatchling.builders.plugin.interface import BuilderInterface
from hatchling.builders.sdist import SdistBuilder
from hatchling.builders.wheel import WheelBuilder
from packaging.requirements import Requirement

ROOT = Path(__file__).parents[2]


def test_the_page_of_licences_lists_the_packages_of_the_lock() -> None:
    locked = runpy.run_path(str(ROOT / "scripts" / "licences.py"))["locked"]()
    rows = (ROOT / "docs" / "licences.md").read_text(encoding="utf-8").splitlines()
    listed = {cells[1]: cells[2] for cells in (re.split(r" *\| *", row) for row in rows) if len(cells) == 5}
    assert {name: version for name, version in listed.items() if name in locked} == locked, "scripts/licences.py"
    assert set(listed) == {*locked, "package", "---"}


LAST_ADVISED = {
    "jinja2": "3.1.6",  # CVE-2025-27516
    "pillow": "13.0",  # CVE-2026-112398 and those beside it, published with 13.0.0
    "pyarrow": "23.0.1",  # CVE-2026-25087
}
"""First version without the last known advisory of a package."""


def _required() -> dict[str, Requirement]:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    named = [*project["dependencies"], *(text for extra in project["optional-dependencies"].values() for text in extra)]
    return {Requirement(text).name.lower(): Requirement(text) for text in named}


@pytest.mark.parametrize("name", LAST_ADVISED)
def test_no_version_with_a_known_advisory_is_allowed(name: str) -> None:
    (bound,) = _required()[name].specifier
    assert bound.operator == ">="
    assert bound.contains(LAST_ADVISED[name])
    assert not any(bound.contains(f"{release}.999") for release in _releases_before(LAST_ADVISED[name]))


def _releases_before(version: str) -> list[str]:
    *above, last = map(int, version.split("."))
    return [".".join(map(str, (*above, last - 1)))] if last else [str(above[0] - 1)]


def test_the_locks_satisfy_every_lower_bound() -> None:
    required = _required()
    for lock in sorted(ROOT.glob("requirements*.lock")):
        text = lock.read_text(encoding="utf-8")
        for name, version in re.findall(r"^([\w.-]+)==([\w.+-]+)", text, re.MULTILINE):
            if name in required:
                assert required[name].specifier.contains(version), f"{lock.name}: {name}"


def _packed(builder: type[BuilderInterface], root: Path) -> set[str]:
    return {str(Path(file.path).relative_to(root)) for file in builder(str(root)).recurse_included_files()}


def test_archives_hold_what_git_knows_and_no_file_that_somebody_left() -> None:
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    known = {name for name in listed.splitlines() if (ROOT / name).is_file()}
    of_the_package = {name for name in known if name.startswith("src/ppafo/")}
    assert _packed(WheelBuilder, ROOT) & known == of_the_package
    left_out = re.compile(r"docs/images/|\.github/|\.ci/|.*\.lock$")
    assert _packed(SdistBuilder, ROOT) & known == {name for name in known if not left_out.match(name)}


def test_a_secret_in_the_folder_of_the_package_is_not_packed(tmp_path: Path) -> None:
    for name in ("pyproject.toml", "src/ppafo/version.py", "src/ppafo/scenarios/step-response.toml"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(ROOT / name, tmp_path / name)
    for name in (".env", "secret.env", "src/secret.env", "src/ppafo/secret.env", "src/ppafo/scenarios/key.pem"):
        (tmp_path / name).write_text("secret", encoding="utf-8")
    assert _packed(WheelBuilder, tmp_path) == {"src/ppafo/version.py", "src/ppafo/scenarios/step-response.toml"}
    assert not [name for name in _packed(SdistBuilder, tmp_path) if "secret" in name or ".env" in name or "key" in name]
