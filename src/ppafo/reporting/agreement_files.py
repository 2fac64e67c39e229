"""Everything that ``ppafo validate`` writes, as file contents by name."""

import re
from collections.abc import Sequence
from pathlib import Path

import ppafo
from ppafo.documents.json_text import json_text
from ppafo.reporting.agreement_figure import agreement_figure
from ppafo.reporting.agreement_table import (
    KIND_WORDS,
    agreement_document,
    channel_cells,
    replay_sentence,
    shown_unit,
    verdict_sentence,
)
from ppafo.reporting.page import inline_figure, rendered_page
from ppafo.reporting.style import rendered
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.validation import RecordingAgreement, Validation
from ppafo.validation.compared import COMPARED

AGREEMENT = "agreement.json"
REPORT = "report.html"
TEMPLATE = "agreement.html.jinja"
_FORMATS = ("png", "svg")
_UNUSUAL = re.compile(r"[^A-Za-z0-9_.-]+")


def recording_names(paths: Sequence[str | Path]) -> list[str]:
    """Return a name for the files of each recording: that of its file or folder, with a number where two are alike."""
    stems = [_UNUSUAL.sub("-", Path(path).stem).strip("-.") or "recording" for path in paths]
    return [
        f"{stem}-{1 + stems[:index].count(stem)}" if stems.count(stem) > 1 else stem for index, stem in enumerate(stems)
    ]


def file_names(paths: Sequence[str | Path]) -> tuple[str, ...]:
    """Return the names of all files for these recordings, in the order of writing; the report comes last."""
    endings = ("-replayed.csv", *(f"-agreement.{file_format}" for file_format in _FORMATS))
    return (*(f"{name}{ending}" for name in recording_names(paths) for ending in endings), AGREEMENT, REPORT)


def agreement_files(validation: Validation) -> dict[str, bytes]:
    """Return every file: the replayed model and a figure for each recording, the numbers and the report."""
    names = recording_names([agreement.file for agreement in validation.recordings])
    atmosphere = validation.device.supply.atmospheric_pressure
    contents: dict[str, bytes] = {}
    figures = []
    for name, agreement in zip(names, validation.recordings, strict=True):
        drawn = rendered(agreement_figure(agreement, atmosphere), _FORMATS)
        figures.append(drawn["svg"])
        contents[f"{name}-replayed.csv"] = marked_csv_bytes(agreement.model.resampled(agreement.measured.time))
        contents |= {f"{name}-agreement.{file_format}": content for file_format, content in drawn.items()}
    contents[AGREEMENT] = f"{json_text(agreement_document(validation))}\n".encode()
    contents[REPORT] = agreement_report(validation, figures).encode()
    return contents


def agreement_report(validation: Validation, figures: Sequence[bytes]) -> str:
    """Return the report as HTML; the figures are the contents of SVG files, one for each recording."""
    parts = [_part(agreement, figure) for agreement, figure in zip(validation.recordings, figures, strict=True)]
    kinds = {agreement.measured.kind for agreement in validation.recordings}
    values = {
        "device": validation.device.name,
        "valve": validation.device.valve_name,
        "overrides": list(validation.overrides),
        "passes": validation.passes,
        "verdict": verdict_sentence(validation),
        "recordings": parts,
        "not_measured": [KIND_WORDS[kind] for kind in sorted(kinds - {"measured"})],
        "gauge": "the gauge pressure of the supply",
        "versions": f"ppafo {ppafo.__version__}",
    }
    return rendered_page(TEMPLATE, values)


def _part(agreement: RecordingAgreement, figure: bytes) -> dict[str, object]:
    rows = [
        {
            "title": COMPARED[channel.channel].title,
            "cells": channel_cells(channel)[1:-1],
            "passes": channel.passes,
            "unit": shown_unit(channel.channel),
        }
        for channel in agreement.channels
    ]
    return {
        "file": agreement.file,
        "kind": KIND_WORDS[agreement.measured.kind],
        "sha256": agreement.sha256,
        "replay": replay_sentence(agreement),
        "remarks": list(agreement.remarks),
        "rows": rows,
        "figure": inline_figure(figure),
        "passes": agreement.passes,
    }
