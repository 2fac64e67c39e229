"""What a release says of itself: the code of others in it, with version and licence."""

import json
import re
import runpy
from pathlib import Path

from ppafo import __version__
from ppafo.parameters import load_parameter_set

ROOT = Path(__file__).parents[2]


def test_the_bill_of_materials_has_what_is_vendored_in_its_version() -> None:
    vendored = ROOT / "page" / "vendor"
    bill = json.loads((vendored / "vendored.cdx.json").read_text(encoding="utf-8"))
    stated = {item["name"]: item["version"] for item in bill["components"]}
    assert sorted(stated) == sorted(folder.name.lower() for folder in vendored.iterdir() if folder.is_dir())
    head = (vendored / "uplot" / "uPlot.esm.js").read_text(encoding="utf-8")[:500]
    found = re.search(r"\(v([\d.]+)\)", head)
    assert found is not None
    assert found[1] == stated["uplot"]


def test_the_licences_of_what_is_vendored_go_with_the_wheel_and_stand_in_the_page() -> None:
    licence = (ROOT / "page" / "vendor" / "uplot" / "LICENSE").read_text(encoding="utf-8")
    assert '"page/vendor/uplot/LICENSE"' in (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    bundle = (ROOT / "src" / "ppafo" / "page" / "bundle" / "page.js").read_text(encoding="utf-8")
    assert " ".join(licence.split()) in " ".join(bundle[:3000].split())


def test_the_citation_file_names_this_version_and_the_authors_and_proceedings_of_the_paper() -> None:
    stated, paper = (ROOT / "CITATION.cff").read_text(encoding="utf-8"), load_parameter_set("ppafo2011").citation
    assert f"\nversion: {__version__}\n" in stated
    assert f'title: "{paper.title}"' in stated
    assert re.findall(r'family-names: "(.+)"', stated) == list(paper.authors)
    assert "Proceedings of the ASME Dynamic Systems and Control Conference (DSCC)" in stated
    assert "Proceedings of the ASME Dynamic Systems and Control Conference (DSCC)" in paper.note


def test_the_page_of_licences_lists_the_packages_of_the_lock() -> None:
    locked = runpy.run_path(str(ROOT / "scripts" / "licences.py"))["locked"]()
    rows = (ROOT / "docs" / "licences.md").read_text(encoding="utf-8").splitlines()
    listed = {cells[1]: cells[2] for cells in (re.split(r" *\| *", row) for row in rows) if len(cells) == 5}
    assert {name: version for name, version in listed.items() if name in locked} == locked, "scripts/licences.py"
    assert set(listed) == {*locked, "package", "---"}
