"""Other publications as files of claims: what a file may say, how a claim is judged, and what the numbers rest on."""

from pathlib import Path

import pytest

from ppafo.analyses.reproduce.claims import COMPUTATIONS, Studies, judge, load_publication
from ppafo.analyses.reproduce.question import reproduce
from ppafo.cli.main import main
from ppafo.errors import ScenarioError
from ppafo.parameters.publications.publication import FILE, PAPER

PUBLISHED = {
    "jrrd-2011": {9.0: "N m"},
    "jmd-2016": {12.0: "N m"},
}
"""Spelled out once more on purpose: every number that was read, and no other."""

TEXT = """
schema_version = 1
name = "mine"
title = "a publication"
citation = "Somebody, 2020"

[[claims]]
id = "held"
statement = "90 psig hold 9 N m."
published = 9.0
unit = "N m"
where = "page 1"
computation = "held_torque"
arguments = { pressure = "90 psi_g" }
at_least = 8.5
at_most = 9.5
"""


def written(folder: Path, text: str) -> str:
    file = folder / "mine.toml"
    file.write_text(text, encoding="utf-8")
    return str(file)


def studied(folder: Path, text: str) -> Studies:
    found = reproduce(study=written(folder, text)).found
    assert isinstance(found, Studies)
    return found


@pytest.mark.parametrize("name", PUBLISHED)
def test_a_shipped_publication_states_only_numbers_that_were_read(name: str) -> None:
    claims = [claim.entry for claim in load_publication(name)]
    stated = {claim.published: claim.unit for claim in claims if claim.published is not None}
    assert stated == PUBLISHED[name]
    assert all(
        claim.entry.assumed or claim.entry.computation in ("held_torque", "") for claim in load_publication(name)
    )


def test_every_computation_is_used_by_a_shipped_claim() -> None:
    used = {claim.entry.computation for name in PUBLISHED for claim in load_publication(name)}
    assert set(FILE.names()) == {*PUBLISHED, PAPER}
    assert used - {""} == set(COMPUTATIONS)


def test_the_torque_at_rest_is_the_measured_slope_times_the_pressure(tmp_path: Path) -> None:
    (claim,) = studied(tmp_path, TEXT).claims
    assert claim.value == pytest.approx(1.451e-5 * 90.0 * 6894.757, rel=1e-6)
    assert claim.verdict == "consistent"


@pytest.mark.parametrize(
    ("change", "verdict"),
    [
        (("at_most = 9.5", 'at_most = 9.5\nassumed = ["a reason"]'), "plausible"),
        (("at_most = 9.5", "at_most = 8.9", "published = 9.0", "published = 8.8"), "inconsistent_as_reported"),
        (
            ("at_least = 8.5\nat_most = 9.5", "at_least = 9.1", "published = 9.0", "published = 9.2"),
            "inconsistent_as_reported",
        ),
        (("at_least = 8.5\nat_most = 9.5", "at_most = 9.1"), "consistent"),
        (
            ("at_most = 9.5", 'at_most = 8.9\nassumed = ["a reason"]', "published = 9.0", "published = 8.8"),
            "undetermined",
        ),
    ],
)
def test_a_claim_is_judged_by_the_range_that_its_file_gives(
    change: tuple[str, ...], verdict: str, tmp_path: Path
) -> None:
    text = TEXT
    for old, new in zip(change[::2], change[1::2], strict=True):
        text = text.replace(old, new)
    assert studied(tmp_path, text).claims[0].verdict == verdict


def test_the_ankle_moment_that_the_torque_is_a_share_of_is_that_of_the_gait() -> None:
    (claim,) = (item for item in load_publication("jmd-2016") if item.entry.id == "share_of_healthy_torque")
    share = judge(claim).value
    assert share is not None
    moment = 1.451e-5 * 120.0 * 6894.757 / (share / 100.0)
    assert 1.2 < moment / 72.5 < 1.8, "healthy ankles peak at about 1.5 N m/kg"


@pytest.mark.parametrize(
    ("change", "line"),
    [
        (("held_torque", "held_tork"), "'held_tork' is unknown, did you mean 'held_torque'?; available: held_torque"),
        (('unit = "N m"', 'unit = "kg"'), "claims.held.unit: unit 'kg' does not fit"),
        (("at_least = 8.5\nat_most = 9.5", ""), "give at_least, at_most or both"),
        (
            ("published = 9.0\n", ""),
            "give one published result: 'published' with its 'unit', or 'words', or 'own' (a calculation)",
        ),
        (("at_least = 8.5", "at_least = 9.8"), "at_least = 9.8 must not exceed at_most = 9.5"),
        (("published = 9.0", "published = 12.0"), "published = 12 is outside at_most = 9.5"),
        (("90 psi_g", "-1 bar_a"), "claims.held.arguments.pressure = '-1 bar_a': must be finite and at least 0 Pa_a"),
        (("at_most = 9.5", "at_most = nan"), "at_most = nan: is not a finite number"),
    ],
)
def test_a_mistake_in_a_file_is_one_line_with_what_is_allowed(
    change: tuple[str, str], line: str, tmp_path: Path
) -> None:
    with pytest.raises(ScenarioError) as caught:
        load_publication(written(tmp_path, TEXT.replace(*change)))
    assert line in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_study_is_written_as_claims_text_and_page(tmp_path: Path) -> None:
    out = tmp_path / "out"
    document = studied(tmp_path, TEXT).json_document()
    assert document["claims"][0]["value"] == pytest.approx(9.0, rel=1e-3)
    assert document["counts"]["consistent"] == 1
    assert main(["reproduce", "--study", written(tmp_path, TEXT), "--out", str(out)]) == 0
    assert {"claims.json", "claims.txt", "report.html"} <= {file.name for file in out.iterdir()}
    page = (out / "report.html").read_text(encoding="utf-8")
    assert "Somebody, 2020" in page
