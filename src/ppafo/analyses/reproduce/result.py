"""Result of the reproduction: claims with observations and runs, and the conclusion on the interpretations of U."""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from ppafo.analyses.reproduce.bench import AssumedValue, SyntheticEvidence
from ppafo.analyses.reproduce.claim import VERDICTS, Claim, Observation, Verdict, verdict_counts
from ppafo.analyses.reproduce.meaning_of_u import InterpretationOfU
from ppafo.analyses.reproduce.publication import ALL, SEED, JudgedClaim, Publication
from ppafo.analyses.reproduce.step_response import StepEvents
from ppafo.parameters.audit import AuditFinding
from ppafo.parameters.publications.publication import paper_entries
from ppafo.simulation.simulate import Result
from ppafo.version import __version__

STEP = "step-response"
SOLENOID = "torque-task-solenoid"
PROPORTIONAL = "torque-task-proportional"
NOTHING_CONFIRMED = "No experimental result is confirmed independently of fitted settings."


@dataclass(frozen=True, slots=True)
class Reproduction:
    """Result of a reproduction: claims in the paper's order, observations, runs, assumptions and audit findings.

    ``synthetic`` is the synthetic recordings, or a sentence with the reason if there are none.
    """

    claims: tuple[Claim, ...]
    step_observations: tuple[Observation, ...]
    torque_observations: tuple[Observation, ...]
    readings_of_u: tuple[InterpretationOfU, ...]
    step: Result
    step_events: StepEvents | None
    solenoid: Result
    proportional: Result
    synthetic: SyntheticEvidence | str
    assumed: tuple[AssumedValue, ...]
    printed_set: str
    printed_findings: tuple[AuditFinding, ...]
    completed_set: str
    completed_findings: tuple[AuditFinding, ...]
    overrides: tuple[str, ...]

    @property
    def missed(self) -> tuple[Claim, ...]:
        """Claims whose value is outside the required window."""
        return tuple(claim for claim in self.claims if claim.is_missed)

    def json_document(self) -> dict[str, Any]:
        """Return claims with verdicts, and the number of claims for each verdict, as plain data in SI."""
        return {
            "counts": verdict_counts(self.claims),
            "claims": [claim.document() for claim in self.claims],
            "readings_of_u": [asdict(row) for row in self.readings_of_u],
            "overrides": list(self.overrides),
            "versions": dict(self.step.versions),
        }


@dataclass(frozen=True, slots=True)
class Studies:
    """Publications with their judged claims, and the reproduction of the paper if it is included."""

    studies: tuple[tuple[Publication, tuple[JudgedClaim, ...]], ...]
    reproduction: Reproduction | None = None

    @property
    def verdicts(self) -> list[Verdict]:
        """Verdicts of all claims, starting with the paper's."""
        of_paper = () if self.reproduction is None else self.reproduction.claims
        return [claim.verdict for claim in of_paper] + [claim.verdict for _, claims in self.studies for claim in claims]

    def json_document(self) -> dict[str, Any]:
        """Return claims with verdicts, and the number of claims for each verdict, as plain data in SI."""
        of_paper = () if self.reproduction is None else self.reproduction.claims
        return {
            "study": self.studies[0][0].name if self.reproduction is None else ALL,
            "counts": {verdict: self.verdicts.count(verdict) for verdict in VERDICTS},
            "claims": [
                *({"study": SEED, **claim.document()} for claim in of_paper),
                *(claim.document(publication.name) for publication, claims in self.studies for claim in claims),
            ],
            "versions": {"ppafo": __version__},
        }


def holding_torque(result: Result) -> float:
    """Largest static torque for the supply of a result [N m]; equation (2), other chamber at atmosphere."""
    device = result.scenario.device
    return device.actuator.torque_constant * (device.supply.pressure - device.supply.atmospheric_pressure)


def reading_rows(rows: Sequence[InterpretationOfU]) -> list[tuple[str, str, str, str]]:
    """Return table rows of the interpretations of U: name, and reductions of error, gas and error within reach [%]."""
    return [(row.name, f"{row.error:.0f} %", f"{row.gas:.0f} %", f"{row.error_within_reach:.0f} %") for row in rows]


def result_on_u(rows: Sequence[InterpretationOfU]) -> tuple[str, ...]:
    """Return the conclusion from the interpretations of U as a sentence; empty if the numbers do not support it."""
    entries = paper_entries()
    error, saving = entries["torque_rms_improvement"], entries["co2_saving"]
    low, high, least = error.at_least or 0.0, error.at_most or 0.0, saving.at_least or 0.0
    # The first reading is the opening itself, the others are voltages.
    opening, *volts = rows
    is_opening_alone = low <= opening.error <= high and not any(low <= row.error <= high for row in volts)
    is_beyond_reach = not any(low <= row.error_within_reach <= high for row in rows)
    if not (is_opening_alone and is_beyond_reach and all(row.gas >= least for row in rows)):
        return ()
    return ("15 % less error needs U as the opening and a reference above the torque ceiling; less gas needs neither.",)
