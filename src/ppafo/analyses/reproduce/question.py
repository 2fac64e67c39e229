"""Public function ``reproduce``: experiments of the paper and claims of other publications, computed again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ppafo.arguments import Overrides, Word, checked
from ppafo.plugins import Plugins
from ppafo.progress import Progress, Report, report_nothing

if TYPE_CHECKING:
    from ppafo.analyses.reproduce.claims import Studies
    from ppafo.analyses.reproduce.paper import Reproduction
    from ppafo.report.finding import Finding


@checked
def reproduce(
    study: Annotated[str | Path, Word("NAME", option="--study")] = "ppafo-2011",
    *,
    overrides: Overrides = (),
    plugins: Plugins = (),
    progress: Report | None = None,
) -> Finding[Reproduction] | Finding[Studies]:
    """Reproduce the paper's experiments and check its claims.

    Arguments:
        study: publication to run again: a name, a .toml file of claims, or 'all'; default ppafo-2011, the paper
        overrides: values to change in the paper's experiments, for example 'valve.area=12.6 mm^2'; may be repeated
        plugins: modules of your own, files or names, whose objects files may name
        progress: called with every count of a long computation

    Returns:
        a Finding whose ``found`` is the Reproduction of the paper, or the claims of other publications with verdicts

    Raises:
        ScenarioError: a study that does not exist, or an override that no experiment has
        SimulationError: a run that diverges

    >>> import ppafo
    >>> finding = ppafo.reproduce("jmd-2016")
    >>> finding.title, finding.passed
    ('jmd-2016, run again', True)
    """
    report = progress or report_nothing
    # Loading takes a second or two.
    report(Progress("loading the experiments"))
    from ppafo.analyses.reproduce.claims import ALL, Studies, judge, load_publication, study_names
    from ppafo.analyses.reproduce.paper import reproduce_paper
    from ppafo.analyses.reproduce.report import finding_of, finding_of_studies
    from ppafo.documents.toml_text import label
    from ppafo.errors import ScenarioError
    from ppafo.parameters.publications.publication import PAPER
    from ppafo.wording import argument_text, known_names

    name = str(study)
    changes = tuple(overrides)
    if name not in study_names() and Path(study).suffix != ".toml":
        raise ScenarioError(
            f"there is no study '{label(name)}'{known_names(name, study_names())}, or give a .toml file"
        )
    if changes and name != PAPER:
        option = argument_text("overrides", option="--set")
        argument = argument_text("study")
        raise ScenarioError(f"{option} {changes[0]}: applies to the study '{PAPER}' only; omit {option} or {argument}")
    if name == PAPER:
        return finding_of(reproduce_paper(changes, report))
    judged = list(reproduce_paper((), report).claims) if name == ALL else []
    for each in study_names()[1:-1] if name == ALL else (name,):
        claims = load_publication(each)
        for number, claim in enumerate(claims):
            report(Progress(f"{claim.study}: {claim.entry.id}", number, len(claims), noun="claims"))
            judged.append(judge(claim))
    return finding_of_studies(Studies(ALL if name == ALL else judged[0].study, tuple(judged)))
