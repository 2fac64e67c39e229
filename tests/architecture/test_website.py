"""The site of the documents has every page, and its checks find what they are for; all without Sphinx."""

from pathlib import Path

import ppafo
from scripts.website import FRONT, contents, decisions, documents, faults, interface

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
