"""The site of the documents has every page, and its checks find what they are for; all without Sphinx."""

from pathlib import Path

import ppafo
from scripts.docstrings import restructured
from scripts.website import DOCS, FRONT, WORKBENCH, contents, decisions, documents, faults, interface, stage

INDEX = {"README.md", "docs/README.md"}


def test_every_page_of_the_documents_is_in_the_table_of_contents_once() -> None:
    listed = [page for section in contents() for page in section.pages]
    assert sorted([*listed, *decisions()]) == sorted(set(documents()) - INDEX)
    assert set(FRONT) <= set(documents())


def test_every_public_name_is_described_once() -> None:
    pages = interface()
    text = "\n".join(page for name, page in pages.items() if name.startswith("public/"))
    described = [line.split("::")[1].strip() for line in text.splitlines() if line.startswith(".. auto")]
    assert sorted(described) == sorted(f"ppafo.{name}" for name in ppafo.__all__)
    assert "``proportional_gain``" in pages["kinds"]


def test_the_page_on_exports_leads_to_the_one_that_the_site_has(tmp_path: Path) -> None:
    stage(tmp_path)
    text = (tmp_path / "docs" / "how-to" / "export.md").read_text(encoding="utf-8")
    assert f'<a href="../../{WORKBENCH}">' in text


def test_a_docstring_is_text_with_code_in_it() -> None:
    plain = ["Torque `tau` of ``m g l`` [N m]; P_up * |x|, f_.", "", "    a = b * c", "", "Alias for field number 3"]
    assert restructured(plain) == [
        "Torque ``tau`` of ``m g l`` [N m]; P_up \\* \\|x\\|, f\\_.",
        "",
        "::",
        "",
        "    a = b * c",
    ]


def test_the_arguments_of_a_command_are_a_list_with_its_further_lines() -> None:
    lines = ["draws: how many; default", "    4096", "seed: of the draws"]
    assert restructured(lines) == ["- ``draws``: how many; default 4096", "- ``seed``: of the draws"]


def test_arguments_returns_and_raises_are_lists_under_their_names() -> None:
    lines = ["Arguments:", "    draws: how many; default", "        4096", "", "Returns:", "    a Result"]
    assert restructured(lines) == [
        "**Arguments**",
        "",
        "- ``draws``: how many; default 4096",
        "",
        "**Returns**",
        "",
        "a Result",
    ]


def test_a_function_leads_to_its_file_on_a_forge_and_to_its_description_on_the_site(tmp_path: Path) -> None:
    assert "](../src/ppafo/model/plant.py)" in (DOCS / "equations.md").read_text(encoding="utf-8")
    stage(tmp_path)
    assert "src/ppafo/model/plant.py" not in (tmp_path / "docs" / "equations.md").read_text(encoding="utf-8")


def test_links_that_lead_nowhere_and_other_hosts_are_found(tmp_path: Path) -> None:
    (tmp_path / "a.html").write_text(
        '<h1 id="top-of-a">A</h1><a href="b.html#there">1</a><a href="b.html#gone">2</a><a href="c.html">3</a>'
        '<a href="#top-of-a">4</a><a href="https://example.org">5</a><img src="https://example.org/x.png">'
    )
    (tmp_path / "b.html").write_text('<p id="there"></p>')
    assert faults(tmp_path) == [
        "a.html loads https://example.org/x.png",
        "a.html leads to b.html#gone, whose anchor is not there",
        "a.html leads to c.html, which is not there",
    ]
