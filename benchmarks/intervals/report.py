"""What came of a study of intervals: table by kind of noise, document, and the figure of ranks."""

from collections.abc import Sequence
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.intervals.calibration import FIVE_PARAMETERS, Line
from ppafo.answers.style import BLACK, BLUE, GREY, VERMILION, house_style, mark_kind

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CONFIDENCE = 0.95
REACHED = (0.90, 0.98)
"""Shares of 95 % intervals that hold between which a cell counts as good."""

_SHORT = ("discharge coefficient", "leak area", "static friction", "damping", "inertia")
_SETS, _SETS_FOR_ALL, _LEVELS, _SEED = 4000, 20000, 99, 1
_LEAST = 1.0e-6


def coverage_text(lines: Sequence[Line], is_drawn: bool) -> str:
    """Return the table: shares of intervals that hold, widths over the best possible, alarms; or ranks."""
    rows = [_cells(kind, of_kind, is_drawn) for kind, of_kind in _by_kind(lines)]
    head = ("noise", "fits", *_SHORT, "held", "known", "spread", "shift", "width", "alarms")
    widths = [max(len(row[column]) for row in (head, *rows)) for column in range(len(head))]
    told = (
        f"ranks of truths drawn from the prior: largest fraction of the {CONFIDENCE:.0%} simultaneous band (* outside)"
        if is_drawn
        else f"fractions of {CONFIDENCE:.0%} intervals that hold the planted value (* outside {REACHED[0]:.0%} to "
        f"{REACHED[1]:.0%})"
    )
    body = [
        "  ".join(cell.rjust(width) if column else cell.ljust(width) for column, (cell, width) in enumerate(pairs))
        for pairs in (list(zip(row, widths, strict=True)) for row in (head, *rows))
    ]
    seconds = float(np.median([line.seconds for line in lines]))
    return "\n".join(
        [
            told,
            *body,
            f"held: {CONFIDENCE:.0%} intervals of all parameters that hold; known: of fits that know the noise",
            "spread, shift: deviation of the ranks as normal scores (1; above it: too narrow), largest mean (0)",
            "width: median of the standard deviation over the best possible, of the least and the greatest parameter",
            "alarms: fits of the right model that the test of misfit called wrong",
            f"{_missed(lines, is_drawn)} of {len(rows) * len(_SHORT)} cells outside; {seconds:.1f} s a fit (median)",
            *([_chance_of_missed(lines)] if is_drawn else []),
        ]
    )


def _chance_of_missed(lines: Sequence[Line]) -> str:
    """Return what the number of cells outside means: the band is one over all levels, but each cell has its own."""
    kinds = _by_kind(lines)
    cells = len(kinds) * len(_SHORT)
    beyond = sum(
        int(np.sum(_shares_of_band(of_kind) * _critical(len(of_kind)) > _critical(len(of_kind), cells)))
        for _, of_kind in kinds
    )
    return (
        f"right intervals leave it in {cells * (1.0 - CONFIDENCE):.1f} of {cells} cells; the band that all cells keep "
        f"with that chance at once is left by {beyond}"
    )


def coverage_document(lines: Sequence[Line], is_drawn: bool) -> dict[str, Any]:
    """Return the same as data."""
    found = []
    for kind, of_kind in _by_kind(lines):
        found.append(
            {
                "noise": kind,
                "fits": len(of_kind),
                "held": dict(zip(FIVE_PARAMETERS, _held(of_kind).tolist(), strict=True)),
                "width_over_best": dict(zip(FIVE_PARAMETERS, _widths(of_kind).tolist(), strict=True)),
                "share_of_band": dict(zip(FIVE_PARAMETERS, _shares_of_band(of_kind).tolist(), strict=True)),
                "held_with_known_noise": dict(zip(FIVE_PARAMETERS, _held_if_known(of_kind).tolist(), strict=False)),
                "spread_of_scores": dict(zip(FIVE_PARAMETERS, _scores(of_kind).std(axis=0).tolist(), strict=True)),
                "shift_of_scores": dict(zip(FIVE_PARAMETERS, _scores(of_kind).mean(axis=0).tolist(), strict=True)),
                "alarms": sum(line.alarm for line in of_kind),
            }
        )
    return {"truths": "drawn" if is_drawn else "fixed", "confidence": CONFIDENCE, "kinds": found, "synthetic": True}


def is_good(lines: Sequence[Line], is_drawn: bool) -> bool:
    """Return whether no cell of the table is outside."""
    return _missed(lines, is_drawn) == 0


def ranks_figure(lines: Sequence[Line]) -> "Figure":
    """Return a panel for each kind of noise: how far the ranks of the truths are from even, and the band."""
    from matplotlib.figure import Figure

    kinds = _by_kind(lines)
    rows = -(-len(kinds) // 5)
    with house_style():
        figure = Figure(figsize=(9.6, 1.1 + 2.1 * rows))
        figure.set_layout_engine("constrained", rect=(0.0, 0.0, 1.0, 0.95))
        axes = figure.subplots(rows, min(5, len(kinds)), sharex=True, sharey=True, squeeze=False)
        for place, (kind, of_kind) in zip(axes.flat, kinds, strict=False):
            _draw(place, kind, of_kind)
        for place in list(axes.flat)[len(kinds) :]:
            place.set_visible(False)
        figure.supxlabel("Fraction of the posterior below the truth (-)")
        figure.supylabel("Fraction of the truths minus an even one (-)")
        mark_kind(figure, "synthetic")
        return figure


def _draw(axes: "Axes", kind: str, lines: Sequence[Line]) -> None:
    levels = _levels()
    band = _critical(len(lines)) * np.sqrt(levels * (1.0 - levels) / len(lines))
    axes.fill_between(levels, -band, band, color=GREY, alpha=0.3, linewidth=0.0)
    axes.axhline(0.0, color=BLACK, linewidth=0.6)
    for place, share in enumerate(_shares_of_band(lines)):
        away = _away(np.array([line.below[place] for line in lines]))
        axes.plot(levels, away, color=BLUE if share <= 1.0 else VERMILION, linewidth=1.0)
    axes.set_title(f"{kind}, {len(lines)}", fontsize=9.5, loc="center")


def _by_kind(lines: Sequence[Line]) -> list[tuple[str, list[Line]]]:
    return [(kind, [one for one in lines if one.kind == kind]) for kind in dict.fromkeys(one.kind for one in lines)]


def _cells(kind: str, lines: Sequence[Line], is_drawn: bool) -> tuple[str, ...]:
    values = _shares_of_band(lines) if is_drawn else _held(lines)
    shown = [f"{value:.2f}" if is_drawn else f"{100.0 * value:.1f} %" for value in values]
    marked = [f"{text}{' ' if good else '*'}" for text, good in zip(shown, _good(lines, is_drawn), strict=True)]
    widths, scores, known = _widths(lines), _scores(lines), _held_if_known(lines)
    shifts = scores.mean(axis=0)
    return (
        kind,
        str(len(lines)),
        *marked,
        f"{100.0 * _held(lines).mean():.1f} %",
        f"{100.0 * known.mean():.1f} %" if known.size else "-",
        f"{np.sqrt(np.mean(np.var(scores, axis=0))):.2f}",
        f"{shifts[np.argmax(np.abs(shifts))]:+.2f}",
        f"{widths.min():.2f} to {widths.max():.2f}",
        str(sum(line.alarm for line in lines)),
    )


def _good(lines: Sequence[Line], is_drawn: bool) -> list[bool]:
    if is_drawn:
        return [bool(share <= 1.0) for share in _shares_of_band(lines)]
    return [bool(REACHED[0] <= share <= REACHED[1]) for share in _held(lines)]


def _missed(lines: Sequence[Line], is_drawn: bool) -> int:
    return sum(not good for _, of_kind in _by_kind(lines) for good in _good(of_kind, is_drawn))


def _held(lines: Sequence[Line]) -> "np.ndarray":
    return _inside(np.array([line.below for line in lines]))


def _held_if_known(lines: Sequence[Line]) -> "np.ndarray":
    """Return the same of the intervals that know the noise; empty where there are none."""
    return _inside(np.array([line.exact for line in lines])) if all(line.exact for line in lines) else np.zeros(0)


def _inside(below: "np.ndarray") -> "np.ndarray":
    tail = 0.5 - 0.5 * CONFIDENCE
    return np.asarray(np.mean((below >= tail) & (below <= 1.0 - tail), axis=0))


def _scores(lines: Sequence[Line]) -> "np.ndarray":
    """Return the ranks as normal scores, in which a shift and a wrong width are easy to see."""
    from scipy.special import ndtri

    return np.asarray(ndtri(np.clip([line.below for line in lines], _LEAST, 1.0 - _LEAST)))


def _widths(lines: Sequence[Line]) -> "np.ndarray":
    return np.asarray(np.median([line.width for line in lines], axis=0))


def _levels() -> "np.ndarray":
    return np.linspace(0.01, 0.99, _LEVELS)


def _away(ranks: "np.ndarray") -> "np.ndarray":
    levels = _levels()
    return np.asarray(np.searchsorted(np.sort(ranks), levels, side="right") / len(ranks) - levels)


def _shares_of_band(lines: Sequence[Line]) -> "np.ndarray":
    """Return how far the ranks of each parameter are from even, over the half width of the band where it is most."""
    levels, critical = _levels(), _critical(len(lines))
    band = critical * np.sqrt(levels * (1.0 - levels) / len(lines))
    below = np.array([line.below for line in lines])
    return np.array([np.max(np.abs(_away(below[:, place])) / band) for place in range(below.shape[1])])


@cache
def _critical(count: int, cells: int = 1) -> float:
    """Return the standard errors within which even ranks stay at all levels at once with the chance of the band.

    With several independent cells, in all of them at once.
    """
    return float(np.quantile(_worst(count, _SETS if cells == 1 else _SETS_FOR_ALL), CONFIDENCE ** (1.0 / cells)))


@cache
def _worst(count: int, sets: int) -> "np.ndarray":
    """Return how far even ranks are from even at most, in standard errors, in each of many draws."""
    random = np.random.default_rng(_SEED)
    levels = _levels()
    spread = np.sqrt(levels * (1.0 - levels) / count)
    return np.array([np.max(np.abs(_away(random.random(count))) / spread) for _ in range(sets)])
