"""When in a stride the muscles of a wearer who reacts are active, beside the electromyography of people."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ppafo.answers import Column, Section, Table
from ppafo.signals.recording import Floats
from ppafo.walking.result import WalkResult
from ppafo.walking.walk import Comparison

THRESHOLD = 0.2
"""Fraction of the largest activation of the mean stride above which a muscle counts as active."""
SHORTEST = 5
"""Percent of the stride below which a gap or a burst does not count."""

Spans = tuple[tuple[int, int], ...]
"""From and until [% of the stride]; (85, 15) goes on over the strike."""


class PublishedTiming(NamedTuple):
    """A muscle of the model, which muscle of people stands for it, and when that is active.

    ``measured`` is from the electromyography of the person whose gait is shipped, over the same threshold; None where
    that muscle was not measured. ``usual`` is of the textbook.
    """

    name: str
    title: str
    measured: Spans | None
    usual: Spans


PUBLISHED = (
    PublishedTiming(name="soleus", title="soleus", measured=((15, 55),), usual=((3, 52),)),
    PublishedTiming(
        name="gastrocnemius",
        title="gastrocnemius (measured: medial head)",
        measured=((20, 52),),
        usual=((6, 48),),
    ),
    PublishedTiming(name="tibialis", title="tibialis anterior", measured=((62, 13),), usual=((54, 9),)),
    PublishedTiming(name="vastus", title="vastus (lateralis)", measured=((92, 25),), usual=((88, 15),)),
    PublishedTiming(
        name="hamstring",
        title="hamstrings (measured: medial; usual: semimembranosus)",
        measured=((85, 15),),
        usual=((81, 5),),
    ),
    PublishedTiming(name="gluteus", title="gluteus maximus (usual: upper part)", measured=None, usual=((94, 24),)),
    PublishedTiming(name="flexor", title="hip flexors (usual: iliacus)", measured=None, usual=((60, 72),)),
)
"""Measured: Falisse et al. 2019, J R Soc Interface 16:20190402, subject 1 at 1.33 m/s, mean over 6 to 11 strides of
right legs in ExperimentalData.mat of github.com/antoinefalisse/3dpredictsim; the hamstrings at the side are left out,
whose signal hardly changes over the stride. Usual: J. Perry, Gait Analysis (1992), as a public function of 2005
(get_emgTimingFromPerry.m, A. S. Arnold) has it; the book itself was not read, nor above which level it counts."""

_READ = (
    "Percent of the stride from strike to strike of the left foot. Active is above 20 % of the largest activation of "
    "the mean stride, without gaps and bursts of less than 5 %. 'Measured' is the electromyography of the person whose "
    "gait is shipped, over the same threshold; 'usual' is Perry (1992) as others have copied it. The fraction in "
    "brackets is that of the stride in which device off and people agree: both active or neither."
)


@dataclass(frozen=True, slots=True)
class Timing:
    """When a muscle is active [% of the stride], and the fraction of the stride in which it agrees with people."""

    spans: Spans
    agrees_with_measured: float | None
    agrees_with_usual: float


def active_spans(activation: Floats) -> Spans:
    """Return when the activation of a mean stride, (101,) at ``PHASES``, is above the threshold."""
    active = activation[:100] > THRESHOLD * activation.max()
    for is_gap in (True, False):  # gaps first, so that a burst with a notch is one
        for start, stop in _runs(active != is_gap):
            if (stop - start) % 100 < SHORTEST and (stop - start) % 100:
                active[np.arange(start, start + (stop - start) % 100) % 100] = is_gap
    return _runs(active)


def _runs(chosen: NDArray[np.bool_]) -> Spans:
    """Return where a round of 100 is chosen: from and until, ((0, 100),) where everywhere."""
    if chosen.all():
        return ((0, 100),)
    starts = np.flatnonzero(chosen & ~np.roll(chosen, 1))
    stops = np.flatnonzero(~chosen & np.roll(chosen, 1))
    return tuple((int(start), int(stops[(stops > start).argmax()])) for start in starts)


def agreement(first: Spans, second: Spans) -> float:
    """Return the fraction of the stride in which both are active or neither is."""
    return float(np.mean(_mask(first) == _mask(second)))


def _mask(spans: Spans) -> NDArray[np.bool_]:
    percent = np.arange(100)
    found = np.zeros(100, dtype=np.bool_)
    for start, stop in spans:
        inside = (percent >= start) & (percent < stop)
        found |= inside if start < stop else (percent >= start) | (percent < stop)
    return found


def muscle_timing(walked: WalkResult) -> dict[str, Timing]:
    """Return when each muscle is active in the mean stride; {} without strides."""
    found = {}
    for item in PUBLISHED:
        channel = f"{item.name}_activation"
        if channel in walked.averages:
            spans = active_spans(walked.averages[channel].mean)
            measured = None if item.measured is None else agreement(spans, item.measured)
            found[item.name] = Timing(spans, measured, agreement(spans, item.usual))
    return found


def muscle_timing_section(comparison: Comparison) -> tuple[Section, ...]:
    """Return a row for each muscle; nothing without strides."""
    worn, bare = (muscle_timing(walked) for walked in (comparison.with_device, comparison.without_device))
    if not worn and not bare:
        return ()
    rows = []
    for item in PUBLISHED:
        own = bare.get(item.name)
        measured = None if item.measured is None else span_text(item.measured)
        usual = span_text(item.usual)
        if own is not None:
            usual = f"{usual} ({own.agrees_with_usual:.2f})"
            measured = None if measured is None else f"{measured} ({own.agrees_with_measured:.2f})"
        cells = (span_text(found[item.name].spans) if item.name in found else None for found in (worn, bare))
        rows.append((item.title, *cells, measured, usual))
    heads = ("Muscle", "with (%)", "device off (%)", "measured (%)", "usual (%)")
    return (
        Section("When muscles are active", (_READ,), Table(tuple(map(Column, heads)), tuple(rows)), is_detail=True),
    )


def span_text(spans: Spans) -> str:
    """Return spans as a table has them."""
    return ", ".join(f"{start} to {stop}" for start, stop in spans) or "never"
