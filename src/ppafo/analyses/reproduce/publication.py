"""Publication as a file of claims: statements, sources, assumptions, and computation of our values."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.analyses.reproduce.claim import Claim, Verdict, verdict_counts
from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.documents.toml_text import label
from ppafo.errors import ScenarioError, SimulationError, UnitError, refused_as
from ppafo.parameters import load_device
from ppafo.parameters.publications.publication import FILE, PAPER, ClaimEntry, read_publication
from ppafo.progress import Progress, Report
from ppafo.units import from_si, parse_quantity
from ppafo.version import __version__
from ppafo.walking.loading import load_walk
from ppafo.walking.motion import walk_of
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import healthy_metrics, walk
from ppafo.wording import argument_text, known_names, nearest_name, said_missing

if TYPE_CHECKING:
    from ppafo.analyses.reproduce.solve import Reproduction

DEVICE = "ppafo2011"
MINUTES = 0.5
"""Duration of a walk [min]; without noise the strides repeat, so that longer walks give the same result."""
PAIR = "solenoid"
"""Name of the walk with direct event control."""
KEEPS_GAIT = "wearer.keeps_gait=1"
"""Override of a walk for a nondisabled wearer, whose muscles keep the measured ankle angle."""
SEED, ALL = PAPER, "all"
"""Name of the study of the paper behind this package, and name for all studies together."""


@dataclass(frozen=True, slots=True)
class _Computation:
    """Computation of the value of a claim: SI unit, arguments with their SI units, and function."""

    unit: str
    arguments: Mapping[str, str]
    compute: Callable[..., float]


# Several claims rest on one walk, which takes seconds.
@lru_cache(maxsize=16)
def _walked(overrides: tuple[str, ...]) -> WalkResult:
    """Run the shipped walk with overrides.

    Raises SimulationError if the walk does not reach its end.
    """
    result = walk(load_walk(PAIR, overrides), minutes=MINUTES)
    if not result.status.is_completed:
        raise SimulationError(
            f"walk '{PAIR}' cannot be used for a claim, which needs a complete walk: {result.status.message}"
        )
    return result


def held_torque(pressure: float) -> float:
    """Static torque [N m] at a supply pressure [Pa absolute]: torque constant times gauge pressure. Equation (2)."""
    return load_device(DEVICE).actuator.torque_constant * (pressure - STANDARD_ATMOSPHERE)


def share_of_healthy_moment(pressure: float) -> float:
    """Static torque at a pressure [Pa absolute] divided by the largest ankle moment of the built-in gait [-]."""
    configuration = load_walk(PAIR)
    moment = walk_of(configuration).gait.curve("ankle_moment").values_at(np.linspace(0.0, 1.0, 1001))
    return held_torque(pressure) / (walk_of(configuration).wearer.body_mass * float(moment.max()))


def walking_torque(pressure: float) -> float:
    """Peak torque [N m] of the mean stride of the walk 'solenoid' at a supply pressure [Pa absolute]."""
    # As repr, so that the walk has this very number. Nothing is published of a limit of the torque.
    overrides = (f"supply.pressure={pressure!r} SI", "controller.largest_torque=100 N m")
    return float(_walked(overrides).averages["torque"].mean.max())


def dorsiflexor_share() -> float:
    """Dorsiflexor moment of a nondisabled wearer with the device divided by the moment without [-], stride means."""
    worn = _walked((KEEPS_GAIT,))
    return worn.metrics["dorsiflexor_moment"].value / healthy_metrics(worn.scenario)["dorsiflexor_moment"].value


_OF_PRESSURE = {"pressure": "Pa_a"}
COMPUTATIONS: dict[str, _Computation] = {
    "held_torque": _Computation("N m", _OF_PRESSURE, held_torque),
    "share_of_healthy_moment": _Computation("1", _OF_PRESSURE, share_of_healthy_moment),
    "walking_torque": _Computation("N m", _OF_PRESSURE, walking_torque),
    "dorsiflexor_share": _Computation("1", {}, dorsiflexor_share),
}


@dataclass(frozen=True, slots=True)
class Publication:
    """Publication with its claims in the order of the file."""

    name: str
    title: str
    citation: str
    claims: tuple[Claim, ...]


@dataclass(frozen=True, slots=True)
class Studies:
    """Publications with their judged claims, and the reproduction of the paper if it is included."""

    studies: tuple[Publication, ...]
    reproduction: "Reproduction | None" = None

    @property
    def claims(self) -> list[tuple[str, Claim]]:
        """Claims of all publications with the name of each, starting with the paper's."""
        of_paper = () if self.reproduction is None else self.reproduction.claims
        studied = ((study.name, claim) for study in self.studies for claim in study.claims)
        return [*((SEED, claim) for claim in of_paper), *studied]

    def json_document(self) -> dict[str, Any]:
        """Return claims with verdicts, and the number of claims for each verdict, as plain data in SI."""
        return {
            "study": self.studies[0].name if self.reproduction is None else ALL,
            "counts": verdict_counts([claim for _, claim in self.claims]),
            "claims": [{"study": study, **claim.document()} for study, claim in self.claims],
            "versions": {"ppafo": __version__},
        }


def load_publication(name_or_path: str | Path) -> Publication:
    """Return a publication by its name in the package or by its file.

    Raises ScenarioError for an invalid file.
    """
    document, file = read_publication(name_or_path)
    claims = tuple(_checked(entry, document.citation, f"{file}: claims.{entry.id}") for entry in document.claims)
    return Publication(document.name, document.title, document.citation, claims)


def _checked(entry: ClaimEntry, citation: str, where: str) -> Claim:
    """Return a claim whose computation, range, unit and arguments fit each other; ``where`` is its place."""
    claim = Claim(entry, note=entry.note or entry.not_testable, assumptions=entry.assumed, citation=citation)
    if bool(entry.computation) == bool(entry.not_testable):
        raise ScenarioError(f"{where}: give either computation, or not_testable with the reason")
    if entry.not_testable:
        return claim
    if entry.computation not in COMPUTATIONS:
        known = known_names(entry.computation, COMPUTATIONS)
        raise ScenarioError(f"{where}.computation: '{entry.computation}' is unknown{known}")
    if entry.at_least is None and entry.at_most is None:
        raise ScenarioError(f"{where}: give at_least, at_most or both, the range in which the claim holds")
    low, high = claim.limits
    if low > high:
        raise ScenarioError(f"{where}: at_least = {low:g} must not exceed at_most = {high:g}")
    # A published number lies in its own range: else the range was typed wrongly.
    if entry.published is not None and not low <= entry.published <= high:
        limit = f"at_least = {low:g}" if entry.published < low else f"at_most = {high:g}"
        raise ScenarioError(f"{where}: published = {entry.published:g} is outside {limit}; widen the range")
    computation, values = COMPUTATIONS[entry.computation], dict[str, float]()
    with refused_as(ScenarioError, f"{where}.unit", UnitError):
        # Only for what it raises: here the place in the file is known.
        from_si(1.0, entry.unit, computation.unit)
    takes = f"arguments of {entry.computation}: {', '.join(computation.arguments)}"
    if unknown := [name for name in entry.arguments if name not in computation.arguments]:
        hint = nearest_name(unknown[0], computation.arguments)
        raise ScenarioError(f"{where}.arguments: '{unknown[0]}' is unknown{hint}; {takes}")
    if missing := [name for name in computation.arguments if name not in entry.arguments]:
        raise ScenarioError(f"{where}.arguments: {said_missing(missing)}; {takes}")
    for name, unit in computation.arguments.items():
        key, text = f"{where}.arguments.{name}", entry.arguments[name]
        with refused_as(ScenarioError, key, UnitError):
            values[name] = parse_quantity(text, unit)
        # An absolute pressure does not lie below 0.
        if not 0.0 <= values[name] < math.inf:
            raise ScenarioError(f"{key} = '{text}': must be finite and at least 0 {unit}")
    return replace(claim, arguments=values)


def study_names() -> tuple[str, ...]:
    """Return the valid arguments of ``--study``."""
    return (SEED, *(name for name in FILE.names() if name != SEED), ALL)


def list_studies() -> list[dict[str, Any]]:
    """Return name and title of every study."""
    words = {name: read_publication(name)[0].title for name in FILE.names()} | {ALL: "every study, one table"}
    return [{"name": name, "title": words[name]} for name in study_names()]


def check_study(study: str, overrides: Sequence[str]) -> None:
    """Raise ScenarioError for an unknown study, and for overrides with any study but the paper's."""
    if study not in study_names() and Path(study).suffix != ".toml":
        raise ScenarioError(
            f"there is no study '{label(study)}'{known_names(study, study_names())}, or give a .toml file"
        )
    if overrides and study != SEED:
        option, name = argument_text("overrides", option="--set"), argument_text("study")
        raise ScenarioError(f"{option} {overrides[0]}: applies to the study '{SEED}' only; omit {option} or {name}")


def run_studies(study: str, report: Report) -> tuple[Publication, ...]:
    """Run one study, or all studies but the paper's; returns each publication with its judged claims.

    Raises ScenarioError for an invalid study, SimulationError if a walk fails.
    """
    studies = []
    for name in study_names()[1:-1] if study == ALL else (study,):
        publication, claims = load_publication(name), []
        for number, claim in enumerate(publication.claims):
            progress = Progress(f"{publication.name}: {claim.entry.id}", number, len(publication.claims), noun="claims")
            report(progress)
            claims.append(judge(claim))
        studies.append(replace(publication, claims=tuple(claims)))
    return tuple(studies)


def judge(claim: Claim) -> Claim:
    """Compute our value for a claim and judge it; SimulationError if a walk fails."""
    entry, computation = claim.entry, COMPUTATIONS.get(claim.entry.computation)
    if computation is None:
        return claim
    value = from_si(computation.compute(**claim.arguments), entry.unit, computation.unit)
    low, high = claim.limits
    # A model with assumptions that does not agree is no evidence against what was measured.
    agrees: Verdict = "plausible" if entry.assumed else "consistent"
    disagrees: Verdict = "undetermined" if entry.assumed else "inconsistent_as_reported"
    return replace(claim, value=value, verdict=agrees if low <= value <= high else disagrees)
