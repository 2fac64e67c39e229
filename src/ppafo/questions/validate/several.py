"""Which of several parameter sets or levels of the model predicts recordings best: what is named, ranked and said."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from ppafo.answers import Column, Section, Table
from ppafo.errors import DataError, one_line
from ppafo.identification.trajectory.prediction import Difference, Left, Ranking, rank
from ppafo.storage.files import read_bytes
from ppafo.validation.agreement import LEAST_NOISE, RecordingAgreement, measured_values
from ppafo.validation.measured import ANGLE, PRESSURE_1, PRESSURE_2

_SENSORS = (ANGLE, PRESSURE_1, PRESSURE_2)


@dataclass(frozen=True, slots=True)
class NamedSet:
    """A parameter set with values of its own, as it was given: ``NAME`` or ``NAME:PATH=VALUE,PATH=VALUE``."""

    text: str
    parameter_set: str
    overrides: tuple[str, ...] = ()


def parse_sets(first: str, texts: Iterable[str]) -> tuple[NamedSet, ...]:
    """Return the set that is validated and those it is compared with; DataError for a text that is not one."""
    sets = [NamedSet(first, first)]
    for text in texts:
        # A path of a file may have a colon too, but no value stands before it.
        head, equals, value = text.partition("=")
        name, colon, path = head.rpartition(":") if equals else (text, "", "")
        name = name.strip()
        if not name or (equals and not path.strip()):
            raise DataError(
                f"--against '{one_line(text)}': is not of the form NAME or NAME:PATH=VALUE, for example "
                "'ppafo2011:friction.static_torque=0 N m'"
            )
        overrides = tuple(item.strip() for item in f"{path}={value}".split(",")) if colon else ()
        if text in [one.text for one in sets]:
            raise DataError(f"--against '{one_line(text)}': the same set is named twice")
        sets.append(NamedSet(text, name, overrides))
    return tuple(sets)


def ranking_of(sets: Sequence[NamedSet], agreements: Sequence[Sequence[RecordingAgreement]]) -> Ranking:
    """Return which set predicts the recordings best; ``agreements`` are those of each set with each recording."""
    left = []
    for ours in agreements:
        pieces = []
        for number, (agreement, first) in enumerate(zip(ours, agreements[0], strict=True)):
            # Sums and multiples of these say nothing of their own.
            chosen = [one for one in first.channels if one.channel in _SENSORS] or list(first.channels)[:1]
            for channel in chosen:
                values = measured_values(agreement.measured, channel.channel)
                assert values is not None
                times = agreement.measured.time - agreement.delay.correction
                expected = np.interp(times, agreement.model.time, agreement.model[channel.channel])
                pieces.append(Left(channel.channel, number, (values - expected) / (LEAST_NOISE * channel.full_range)))
        left.append(pieces)
    return rank([one.text for one in sets], left)


def seen_by(sets: Sequence[NamedSet], agreements: Sequence[RecordingAgreement]) -> tuple[str, ...]:
    """Return a remark for each recording that a set of a file was fitted to, by the hash that its values name."""
    said = []
    for one in sets:
        if not Path(one.parameter_set).is_file():
            continue
        content = read_bytes(Path(one.parameter_set)).decode(errors="replace")
        said += [
            f"{one.text} was fitted to {agreement.file}, so that its density there is no prediction"
            for agreement in agreements
            if agreement.sha256 and agreement.sha256 in content
        ]
    return tuple(said)


def ranking_sentence(ranking: Ranking) -> str:
    """Return in words which set predicts best, which cannot be distinguished from it and which are worse."""
    best, alike = ranking.densities[0].name, ranking.alike
    worse = [one.name for one in ranking.densities if one.name not in alike]
    count = len(alike)
    if count == len(ranking.densities):
        which = " and ".join((", ".join(alike[:-1]), alike[-1]))
        return f"these recordings cannot distinguish {which}: no difference is more than twice its error"
    said = f"{best} predicts these recordings best"
    if count > 1:
        said = f"{said}, though {', '.join(alike[1:])} cannot be distinguished from it"
    sizes = [f"{name} (by {_size(ranking.between(best, name))})" for name in worse]
    return f"{said}; worse by more than twice the error: {', '.join(sizes)}"


def _size(one: Difference) -> str:
    return f"{one.value:.3g} +- {one.error:.2g}"


def ranking_section(ranking: Ranking, remarks: Sequence[str]) -> Section:
    """Return the densities with their errors and the differences of all pairs with theirs."""
    best = ranking.densities[0].name
    rows = []
    for one in ranking.densities:
        apart = "" if one.name == best else _size(ranking.between(best, one.name))
        verdict = "best" if one.name == best else "indistinguishable" if one.name in ranking.alike else "worse"
        rows.append((one.name, f"{one.value:.6g} +- {one.error:.2g}", apart, verdict))
    others = tuple(
        f"{one.better} {'predicts better than' if one.is_certain else 'cannot be distinguished from'} {one.worse}: "
        f"{_size(one)}"
        for one in ranking.differences
        if best not in (one.better, one.worse)
    )
    noun = "recording" if ranking.recordings == 1 else "recordings"
    return Section(
        "Which predicts best",
        paragraphs=(
            f"Log predictive density of {ranking.samples} samples in {ranking.recordings} {noun}, each given those "
            f"before it, with noise of any kind estimated for each set; samples in {100.0 * LEAST_NOISE:g} % of full "
            "range. Errors are standard errors from blocks. Sets differ where the difference is more than twice its "
            "error.",
        ),
        table=Table((Column("set"), Column("log density"), Column("below the best"), Column("verdict")), tuple(rows)),
        remarks=(*others, *(f"note: {remark}" for remark in remarks)),
    )


def ranking_data(ranking: Ranking, remarks: Sequence[str]) -> dict[str, Any]:
    """Return the ranking as plain data."""
    return {
        "summary": ranking_sentence(ranking),
        "samples": ranking.samples,
        "alike": list(ranking.alike),
        "sets": [{"set": one.name, "log_density": one.value, "error": one.error} for one in ranking.densities],
        "differences": [
            {"better": one.better, "worse": one.worse, "difference": one.value, "error": one.error}
            | {"is_certain": one.is_certain}
            for one in ranking.differences
        ],
        "remarks": list(remarks),
    }
