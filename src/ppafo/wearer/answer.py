"""A walk of a neuromuscular gait model: with the device and with it off, until a fall where there is one."""

from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from ppafo.analyses.walk.document import Row, metrics_table, walk_data
from ppafo.analyses.walk.safety import over_time_parts, safety_remarks
from ppafo.analyses.walk.task_sequence import bottle_data, bottle_parts, bottle_remark
from ppafo.documents.json_text import plain
from ppafo.gait.document import load_gait
from ppafo.metrics.strides import SETTLING
from ppafo.report.finding import Finding, Part, columns_of
from ppafo.report.kind import Kind
from ppafo.report.panels import Mark, Panel
from ppafo.report.style import BLUE, GREY, VERMILION
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.storage.netcdf import netcdf_bytes
from ppafo.walking.motion import person_remarks, walk_of
from ppafo.walking.result import REACTING_WALK_FORMAT, WalkResult
from ppafo.walking.strides import PHASES
from ppafo.walking.walk import Comparison
from ppafo.wearer.settings import wearer_of_walk
from ppafo.wearer.way import EDGE, met_by

SCHEMA_VERSION = 2

ROWS: tuple[Row, ...] = (
    ("walked_time", "Walked until the end or a fall", "time", 1),
    ("strides", "Whole strides", "", 0),
    ("walking_speed", "Speed", "velocity", 2),
    ("stride_time", "Time of a stride", "time", 3),
    ("lowest_toes", "Lowest toes over the ground in mid-swing, mean", "body length", 1),
    ("toe_landing", "Strides that begin on the toes", "fraction", 0),
    ("muscle_work", "Work of all muscles in one stride", "energy", 1),
    ("muscle_power", "Power of all muscles", "power", 1),
    ("metabolic_power_umberger", "Metabolic rate of all muscles, Umberger 2010", "power", 0),
    ("metabolic_power_bhargava", "Metabolic rate of all muscles, Bhargava 2004", "power", 0),
    ("positive_push_off_work", "Positive work of the device in push-off", "energy", 2),
    ("net_push_off_work", "Net work of the device in push-off", "energy", 2),
    ("gas", "Gas per stride", "gas mass", 3),
    ("total_gas", "Gas of the whole walk", "gas mass", 2),
    ("counted_strides", "Strides with help, of gas and push-off", "", 0),
)
"""Metric, title, kind of quantity and digits behind the point of each row."""

_EXPLAINED = (
    "'Device off' is the same wearer with the same device and both chambers vented: it still rubs and has inertia. The "
    "first two strides are left out of the means, and means of gas and push-off also leave out strides with less help. "
    "The device is on the left leg, and a stride is one step of that leg."
)

_EFFORT = (
    "Power and metabolic rate are of one set of reflexes. Those that other searches find differ by some percent: a "
    "difference between with and off that is smaller is none. The rate at rest is not in it, and the two models differ "
    "by a factor of two."
)
_LIMITS = (
    "The gains of the reflexes are the wearer's file's, with the device on and off: the wearer is unadapted. "
    "The body is planar and has no arms, and the device adds no weight, only friction, damping and the inertia of vane "
    "and foot plate about the ankle. No number here is a benefit to a person: it is what this model does."
)
_CURVES = (
    "Mean over the strides from strike to strike of the left foot, with the standard deviation as a band. The ground "
    "force is that on the left foot."
)
_LIKENESS = (
    "Of the mean stride: correlation r, root mean square of the difference, and the delay of the wearer, below 0 where "
    "the wearer is early, at which r is largest. The measured gait is from healthy people without a device; numbers "
    "appear whatever they are."
)
_COMPARED = (
    ("ground_force", "vertical_force", "Vertical ground force (body weights)"),
    ("angle", "ankle_angle", "Ankle angle (deg)"),
    ("shank_angle", "shank_angle", "Shank angle (deg)"),
    ("wearer_ankle_moment", "ankle_moment", "Ankle moment (N m/kg)"),
)
"""Channel of the wearer, curve of the gait, and title with unit."""
MOST_LAG = 10
"""Delays that are tried, in percent of the stride."""
_PANELS = (
    ("angle", Kind("Ankle angle", "rad", "angle")),
    ("knee_angle", Kind("Knee angle", "rad", "angle")),
    ("toe_height", Kind("Toes over the ground", "m", "body length")),
    ("ground_force", Kind("Vertical ground force", "N", "force")),
    ("torque", Kind("Actuator torque", "N m", "torque")),
    ("tibialis_activation", Kind("Activation of the tibialis")),
)


_NAMED = "ground_force"
"""The panel that names the curves: it has nothing to hide in the swing."""


@dataclass(frozen=True, slots=True, eq=False)
class ReactingPair:
    """A walk of a neuromuscular gait model with the device, and with it off."""

    comparison: Comparison

    def json_document(self) -> dict[str, Any]:
        """Return metrics, events and how alike the gait is to a measured one, as plain data in SI."""
        worn, bare = self.comparison.with_device, self.comparison.without_device
        return {
            **walk_data(REACTING_WALK_FORMAT, SCHEMA_VERSION, self.comparison),
            "likeness": {
                words: {name: plain(item) for name, item in likeness(walked).items()}
                for words, walked in (("with", worn), ("off", bare))
            },
            **bottle_data(worn),
        }


def reacting_finding(comparison: Comparison) -> Finding[ReactingPair]:
    """Return a walk of a neuromuscular gait model; one who falls with the device has not passed."""
    worn, bare = comparison.with_device, comparison.without_device
    scenario = worn.scenario
    wearer = wearer_of_walk(walk_of(scenario))
    remarks = [*person_remarks(scenario)]
    changed = [
        f"{name.removesuffix('_strength')} {100.0 * value:.3g} %"
        for name, value in wearer.settings.items()
        if name.endswith("_strength") and value != 1.0
    ]
    remarks += [f"strength of the left leg: {', '.join(changed)}"] if changed else []
    remarks += fall_remarks(comparison)
    remarks += [] if worn.supply is None else [bottle_remark(worn)]
    remarks += safety_remarks(worn)
    numbers = [
        (head, {name: one.value for name, one in walked.metrics.items()})
        for head, walked in (("with", worn), ("device off", bare))
    ]
    stays = worn.metrics["stays_up"].value > 0.5
    strides = f"{worn.metrics['strides'].value:.0f} strides"
    ended = "walks to the end" if stays else f"falls after {worn.metrics['fall_time'].value:.1f} s"
    return Finding(
        name="walk",
        kicker=f"A walk of a neuromuscular gait model, {scenario.run.duration / 60.0:.3g} min",
        title=f"Walking with {scenario.name}",
        said=(f"{scenario.name}: {wearer.name} {ended}, {strides}",),
        parts=(
            Part(columns=metrics_table(ROWS, numbers), remarks=remarks),
            *_way_part(comparison),
            *bottle_parts(worn),
            *_likeness_part(comparison),
            Part("How to read it", said=(_EXPLAINED, _EFFORT, _LIMITS), is_detail=True),
            *over_time_parts(worn),
            *(
                [
                    Part(
                        "The mean stride",
                        panels=partial(stride_panels, comparison),
                        name="mean-stride",
                        caption=_CURVES,
                        across=3,
                        size=(3.1, 2.5),
                        title=f"{scenario.name}: {wearer.name}, neuromuscular",
                        is_detail=True,
                    )
                ]
                if worn.averages
                else []
            ),
        ),
        found=ReactingPair(comparison),
        passed=comparison.is_completed and stays and worn.is_helped,
        files={
            "recording.nc": partial(netcdf_bytes, worn.recording, None),
            "recording.csv": partial(marked_csv_bytes, worn.recording),
            "recording-off.nc": partial(netcdf_bytes, bare.recording, None),
        },
    )


@dataclass(frozen=True, slots=True)
class Likeness:
    """How alike a curve of the wearer is to a gait's: r, RMS difference [unit of the curve], and r after a delay.

    ``delay`` [strides] of the wearer is that at which r is largest, ``delayed_r``.
    """

    r: float
    rms: float
    delay: float
    delayed_r: float


def likeness(walked: WalkResult) -> dict[str, Likeness]:
    """Return how alike the mean stride is to the measured gait that is shipped, by curve; {} without strides."""
    gait, wearer = load_gait(), wearer_of_walk(walk_of(walked.scenario))
    over = {"ground_force": wearer.weight, "wearer_ankle_moment": wearer.mass}
    found = {}
    for channel, curve, _ in _COMPARED:
        measured = getattr(gait, curve)
        if channel not in walked.averages or measured is None:
            continue
        own, places = walked.averages[channel].mean / over.get(channel, 1.0), np.asarray(PHASES)
        with np.errstate(invalid="ignore"):
            delays = np.arange(-MOST_LAG, MOST_LAG + 1) / 100.0
            shifted = [float(np.corrcoef(own, measured.values_at(places - delay))[0, 1]) for delay in delays]
        difference = own - measured.values_at(places)
        best = int(np.nanargmax(shifted)) if np.isfinite(shifted).any() else MOST_LAG
        rms = float(np.sqrt(np.mean(difference**2)))
        found[curve] = Likeness(shifted[MOST_LAG], rms, float(delays[best]), shifted[best])
    return found


def _likeness_part(comparison: Comparison) -> tuple[Part, ...]:
    found = [likeness(walked) for walked in (comparison.with_device, comparison.without_device)]
    if not any(found):
        return ()
    head = ["Mean stride of the wearer and measured gait"]
    for words in ("with", "device off"):
        head += [f"r {words}", "RMS", "delay (%)", "r then"]
    rows = []
    for _, curve, title in _COMPARED:
        cells: list[str | None] = []
        for own in found:
            if curve not in own:
                cells += [None] * 4
                continue
            item, unit = own[curve], np.degrees(1.0) if curve.endswith("angle") else 1.0
            cells += [
                f"{item.r:.2f}",
                f"{unit * item.rms:.3g}",
                f"{100.0 * item.delay:.0f}",
                f"{item.delayed_r:.2f}",
            ]
        rows.append((title, *cells))
    return (Part("Compared with a measured gait", columns_of(head, rows), (_LIKENESS,), is_detail=True),)


def fall_remarks(comparison: Comparison) -> list[str]:
    """Return who falls, with the device and without."""
    found = []
    for words, walked in (
        ("with the device", comparison.with_device),
        ("with the device off", comparison.without_device),
    ):
        fall, strides = walked.metrics.get("fall_time"), max(walked.metrics["strides"].value - SETTLING, 0.0)
        means = (
            f", and the means are of {strides:.0f} stride{'s' if strides > 1 else ''} before that" if strides else ""
        )
        if fall is not None:
            place = met_by(
                wearer_of_walk(walk_of(walked.scenario)).stretches, float(walked.recording["hip_position"][-1])
            )
            found.append(f"{words}: the wearer falls {place}{' ' if place else ''}at {fall.value:.1f} s{means}")
    return found


def _way_part(comparison: Comparison) -> tuple[Part, ...]:
    """Return what was walked on each stretch of the way, with the device and without; nothing on level ground."""
    way = wearer_of_walk(walk_of(comparison.with_device.scenario)).stretches
    stretches, met = [item for item in way if item.kind == "walk"], [item for item in way if not item.is_plain]
    if not met:
        return ()
    head = ["On the way", "from (m)", "strides with", "lowest toes (cm)", "strides off", "lowest toes (cm)"]
    rows = []
    for place, stretch in enumerate(stretches):
        until = stretches[place + 1].start if place + 1 < len(stretches) else np.inf
        own = [item.title for item in met if item.kind != "walk" and stretch.start <= item.start + EDGE < until]
        cells: list[str | None] = []
        for walked in (comparison.with_device, comparison.without_device):
            begun = walked.recording["hip_position"][walked.starts[:-1]]
            on_it = (begun >= stretch.start) & (begun < until)
            toes = walked.strides["toe_clearance"][on_it]
            cells += [str(int(on_it.sum())), f"{100.0 * float(toes.min()):.1f}" if toes.size else None]
        rows.append((", ".join([*own, stretch.title]), f"{stretch.start:.2f}", *cells))
    return (Part(columns=columns_of(head, rows)),)


def stride_panels(comparison: Comparison) -> list[Panel]:
    """Return the mean stride of a neuromuscular gait model, with the device and with it off."""
    walks = (
        ("device off (vented)", comparison.without_device, VERMILION),
        ("with the device", comparison.with_device, BLUE),
    )
    panels: list[Panel] = []
    stride, percent = Kind("Stride", "%"), 100.0 * PHASES
    for channel, kind in _PANELS:
        marks = [Mark("level", (), 0.0, colour=GREY, style={"linewidth": 0.8})] if channel == "toe_height" else []
        for label, walked, colour in walks:
            if channel in walked.averages:
                curves = walked.averages[channel]
                band = (curves.mean - curves.deviation, curves.mean + curves.deviation)
                marks.append(Mark("line", percent, curves.mean, (), label if channel == _NAMED else "", colour))
                marks.append(Mark("band", percent, band, colour=colour, style={"alpha": 0.2}))
        legend = "inside" if channel == _NAMED else ""
        panels.append(
            Panel(stride, kind, marks, legend=legend, then=lambda axes: axes.set_xlim(0.0, 100.0), shares_x=True)
        )
    return panels
