"""A parameter set compared with recordings, channel by channel, and the answer."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from ppafo.errors import DataError, nearest_name, one_line
from ppafo.parameters import load_device
from ppafo.parameters.device import Device
from ppafo.progress import Progress, Report, report_nothing
from ppafo.report import Answer, Column, Figure, Section, Table
from ppafo.report.display_units import (
    axis_unit,
    display_unit,
    display_value,
    display_values,
    quantity_of_unit,
    quantity_text,
)
from ppafo.report.solved import Solved
from ppafo.report.style import (
    ACTUAL,
    BLACK,
    CHAMBER_1,
    CHAMBER_2,
    GREY,
    Margins,
    figure_of_panels,
    house_style,
    mark_kind,
)
from ppafo.signals.recording import Floats
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.storage.foreign import ColumnMap, load_column_map
from ppafo.validation import ChannelAgreement
from ppafo.validation.agreement import (
    DEFAULT_LIMIT,
    RecordingAgreement,
    ReplaySettings,
    compare_recording,
    measured_values,
)
from ppafo.validation.causes import Cause, Causes, causes_of
from ppafo.validation.measured import (
    COMPARED,
    PRESSURE_1,
    PRESSURE_2,
    Measured,
    parse_thresholds,
    read_measured,
)
from ppafo.validation.replay import MOTIONS, Motion, parse_initial
from ppafo.version import __version__

if TYPE_CHECKING:
    import matplotlib.figure
    from matplotlib.axes import Axes

LARGEST_DELAY = 1.0
"""Seconds; a recording that is later than this was not recorded with its command."""


@dataclass(frozen=True, slots=True, repr=False)
class Validation(Solved):
    """A parameter set and what each recording reports of it."""

    parameter_set: str
    device: Device
    overrides: tuple[str, ...]
    settings: ReplaySettings
    recordings: tuple[RecordingAgreement, ...]
    causes: Causes
    has_limits: bool

    @property
    def passes(self) -> bool:
        """True where every error is within its limit and, without limits given, no cause is found that no bench has."""
        within = all(recording.passes for recording in self.recordings)
        found = self.causes.found
        return within and (self.has_limits or found is None or found.is_usual)


def validate(
    parameter_set: str | Path,
    recordings: Sequence[str | Path],
    valve: str | None = None,
    overrides: Sequence[str] = (),
    motion: str = "free",
    volume: float | None = None,
    initial: Sequence[str] = (),
    thresholds: Sequence[str] = (),
    longest_delay: float = DEFAULT_LIMIT,
    columns: ColumnMap | str | Path | None = None,
    progress: Report | None = None,
) -> Validation:
    """Return the errors (model less measured) of the model with a parameter set against each recording.

    ``recordings`` are CSV or NetCDF files or result folders. The model is run on the recorded command, supply pressure
    and external torque; ``motion`` is ``free``, ``measured`` (the recorded angle is prescribed) or ``held``. With a
    ``volume`` [m^3] there is no vane and chamber 1 is a fixed volume. ``initial`` are texts such as
    ``pressure_2=0 psi_g`` for channels that were not recorded, ``thresholds`` texts such as ``5%`` or ``angle=2 deg``:
    the largest RMS errors that pass, of the full range or in a unit. Without any it is 10 % of full range, at
    least half of the variance of a signal beside its noise is explained, and no single cause in record, set or model
    is found (``causes``) that is larger than those of any bench. ``longest_delay`` [s], at
    most 1 s, limits the delay of the measurement that is taken out. ``columns`` is a column map or
    ``FILE.toml[:NAME]``.

    The result has ``passes`` and, in ``recordings``, one ``RecordingAgreement`` each: ``measured`` and ``model`` are
    recordings, their channels of shape (samples,) in SI; ``channels`` has RMS error, bias, largest error and delay [s]
    of each channel in its SI unit (rad, Pa, N m). ``to_dict``, ``plot`` and ``save`` give JSON, figure and page.

    DataError for a recording or an argument that cannot be used, ParameterError for a parameter set, a valve or an
    override, SimulationError where the model diverges.
    """
    report = progress or report_nothing
    device = load_device(parameter_set, valve, overrides)
    if volume is not None and not volume > 0.0:
        raise DataError(f"volume of {volume:g} m^3: must be above 0")
    if not 0.0 <= longest_delay <= LARGEST_DELAY:
        raise DataError(f"longest delay of {longest_delay:g} s: must be from 0 to {LARGEST_DELAY:g} s")
    settings = ReplaySettings(
        motion=_motion(motion),
        initial=parse_initial(initial, device.supply.atmospheric_pressure),
        longest_delay=longest_delay,
        thresholds=parse_thresholds(thresholds),
        volume=volume,
    )
    if not recordings:
        raise DataError("no recording was given; name at least one .csv or .nc file or result folder")
    column_map = columns if columns is None or isinstance(columns, ColumnMap) else _column_map(str(columns))
    read = [read_measured(path, device, column_map) for path in recordings]
    _check_distinct(read)
    agreements = []
    for measured in read:
        report(Progress(f"replaying {measured.file}"))
        agreements.append(compare_recording(measured, device, settings))
    return Validation(
        parameter_set=str(parameter_set),
        device=device,
        overrides=tuple(overrides),
        settings=settings,
        recordings=tuple(agreements),
        causes=causes_of(read, agreements, device, settings, report),
        has_limits=bool(thresholds),
    )


def _check_distinct(read: Sequence[Measured]) -> None:
    """Refuse a recording that is given twice, under two names too: it would count twice as evidence."""
    seen: dict[str, str] = {}
    for one in read:
        if one.sha256 in seen:
            raise DataError(f"{one.file}: the same recording as {seen[one.sha256]}; give each once")
        seen[one.sha256] = one.file


def _motion(text: str) -> Motion:
    for motion in MOTIONS:
        if motion == text:
            return motion
    raise DataError(f"motion '{one_line(text)}' is not one of {', '.join(MOTIONS)}{nearest_name(text, MOTIONS)}")


def _column_map(text: str) -> ColumnMap:
    """Return the map that is named as a file, and by name where the file has several."""
    path, separator, name = text.rpartition(".toml:")
    return load_column_map(f"{path}.toml", name) if separator and name else load_column_map(text)


KIND_WORDS = {"measured": "measured", "synthetic": "synthetic measurement", "simulated": "simulated, not measured"}
"""What the recording is called beside the model: nobody may take a model's output for a measurement."""
_WIDTH = 7.6
_ROW_HEIGHT = 2.9
_MARGINS = Margins(left=0.68, right=0.15, top=0.72, bottom=0.52, row_gap=0.44, column_gap=0.78)
"""Inches."""
_HEIGHTS = (2.4, 1.0)
_LOOKS = {PRESSURE_1: CHAMBER_1, PRESSURE_2: CHAMBER_2}
_MAXIMUM_DOTS = 400
_NEAR_LIMIT = 0.25
_SHORT = 3.0
"""Recordings shorter than this [s] have an axis in milliseconds."""


def agreement_figure(agreement: RecordingAgreement, atmosphere: float) -> "matplotlib.figure.Figure":
    """Return the figure of one recording: two panels a channel, gauge pressures from ``atmosphere`` [Pa absolute]."""
    channels = agreement.channels
    columns = 1 if len(channels) == 1 else 2
    rows = -(-len(channels) // columns)
    with house_style():
        size = (_WIDTH, _MARGINS.top + _MARGINS.bottom + rows * _ROW_HEIGHT)
        figure, grid = figure_of_panels(size, _MARGINS, 2 * rows, columns, _HEIGHTS * rows)
        scale, unit = (1.0e3, "ms") if agreement.measured.duration < _SHORT else (1.0, "s")
        for number in range(rows * columns):
            row, column = divmod(number, columns)
            upper, lower = grid[2 * row][column], grid[2 * row + 1][column]
            if number >= len(channels):
                upper.set_visible(False)
                lower.set_visible(False)
                continue
            _draw_channel(upper, lower, agreement, channels[number], scale, atmosphere)
        for axes in grid[-1]:
            axes.set_xlabel(f"Time ({unit})")
        _label(figure, grid[0][0], agreement)
        return figure


def _draw_channel(
    upper: "Axes",
    lower: "Axes",
    agreement: RecordingAgreement,
    channel: ChannelAgreement,
    scale: float,
    atmosphere: float,
) -> None:
    name, measured, model = channel.channel, agreement.measured, agreement.model
    quantity = COMPARED[name].quantity
    times = measured.time
    given = measured_values(measured, name)
    if given is None:
        return
    colour = _LOOKS.get(name, ACTUAL).colour
    line = np.interp(times - agreement.delay.correction, model.time, model[name])
    every = -(-times.size // _MAXIMUM_DOTS)
    upper.plot(
        scale * times[::every],
        _level_in_display_unit(given, name, atmosphere)[::every],
        ".",
        color=BLACK,
        markersize=2.6,
        zorder=2,
    )
    upper.plot(scale * times, _level_in_display_unit(line, name, atmosphere), color=colour, linewidth=1.3, zorder=3)
    upper.set_title(f"{COMPARED[name].title}: RMS {100 * channel.fraction:.2g} %", color=BLACK)
    upper.set_ylabel(axis_unit("pressure" if name in (PRESSURE_1, PRESSURE_2) else COMPARED[name].quantity))
    upper.margins(y=0.06)
    residual = display_values(line - given, quantity)
    limit = display_value(channel.limit * channel.full_range, quantity)
    lower.plot(scale * times, residual, color=colour, linewidth=0.9)
    lower.axhline(0.0, color=GREY, linewidth=0.8)
    _mark_limit(lower, limit, float(np.abs(residual).max()))
    lower.set_ylabel(axis_unit(quantity))


def _mark_limit(axes: "Axes", limit: float, largest: float) -> None:
    """Mark the limit of the RMS error where the residual comes near it; else it would only press the residual flat."""
    if largest < _NEAR_LIMIT * limit:
        return
    for level in (-limit, limit):
        axes.axhline(level, color=GREY, linewidth=0.8, linestyle=(0, (4, 3)))


def _label(figure: "matplotlib.figure.Figure", axes: "Axes", agreement: RecordingAgreement) -> None:
    """Name dots and lines once for the whole figure, and say what the recording is."""
    dots, line = axes.lines[0], axes.lines[1]
    inch = 1.0 / figure.get_figheight()
    figure.legend(
        [dots, line],
        [KIND_WORDS[agreement.measured.kind], "model on the recorded inputs"],
        loc="upper left",
        bbox_to_anchor=(0.05, 1.0 - 0.02 * inch),
        ncols=2,
        handlelength=1.6,
        markerscale=2.5,
    )
    mark_kind(figure, agreement.measured.kind)


def _level_in_display_unit(values: Floats, name: str, atmosphere: float) -> Floats:
    """Return the values of a channel as they are drawn; a chamber's gauge pressure counts from the atmosphere there."""
    above = atmosphere if name in (PRESSURE_1, PRESSURE_2) else 0.0
    return display_values(values - above, COMPARED[name].quantity)


_MILLISECONDS = 1.0e3
_HEAD = tuple(
    map(
        Column,
        (
            *("channel", "RMS error", "in noise", "variation", "of range", "limit", "bias", "largest", "at"),
            "verdict",
        ),
    )
)
_UNUSUAL = re.compile(r"[^A-Za-z0-9_.-]+")


def answer_of(validation: Validation) -> Answer:
    """Return the answer of a validation; it has passed where every error is within its limit."""
    count = len(validation.recordings)
    names = recording_names([agreement.file for agreement in validation.recordings])
    kinds = {agreement.measured.kind for agreement in validation.recordings}
    pairs = list(zip(names, validation.recordings, strict=True))
    rows = tuple((item.file, f"sha256 {item.sha256}") for item in validation.recordings if item.sha256)
    return Answer(
        name="validate",
        kicker="Validation of a parameter set",
        title=f"{validation.device.name} against {count} recording{'' if count == 1 else 's'}",
        lead=(
            verdict(validation),
            *_departures(validation, sorted(kinds - {"measured"})),
        ),
        sections=(
            Section(paragraphs=(_method(validation),), is_detail=True),
            *(_section(validation, name, agreement) for name, agreement in pairs),
            (Section("Files", table=Table((), rows), is_detail=True) if rows else Section()),
        ),
        data={
            "format": "ppafo agreement",
            "schema_version": 1,
            "parameter_set": validation.parameter_set,
            "device": validation.device.name,
            "valve": validation.device.valve_name,
            "overrides": list(validation.overrides),
            "longest_delay": validation.settings.longest_delay,
            "passes": validation.passes,
            "summary": verdict(validation),
            "causes": {
                "tried": validation.causes.tried,
                "found": _cause_data(validation.causes.found),
                "nearest": _cause_data(validation.causes.nearest),
            },
            "recordings": [_recording_data(agreement) for agreement in validation.recordings],
            "versions": {"ppafo": __version__},
        },
        passed=validation.passes,
        kind=next(iter(kinds)) if len(kinds) == 1 else "measured",
        files={f"{name}-replayed.csv": partial(_replay_csv, agreement) for name, agreement in pairs},
    )


def recording_names(files: Sequence[str]) -> list[str]:
    """Return a name for the files of each recording: that of its file or folder, with a number where two are alike."""
    stems = [_UNUSUAL.sub("-", Path(file).stem).strip("-.") or "recording" for file in files]
    return [
        f"{stem}-{1 + stems[:index].count(stem)}" if stems.count(stem) > 1 else stem for index, stem in enumerate(stems)
    ]


def verdict(validation: Validation) -> str:
    """Return in one sentence whether the set agrees and, if not, by what it is off and what would explain it."""
    count, name = len(validation.recordings), validation.device.name
    pairs = [(channel, agreement) for agreement in validation.recordings for channel in agreement.channels]
    worst = max((channel for channel, _ in pairs), key=lambda one: one.in_noise)
    size = (
        f"{worst.channel} is off by {worst.in_noise:.2g} times its noise ({100 * worst.fraction:.2g} % of full range)"
    )
    failed = ", ".join(
        f"{channel.channel} in {agreement.file} ({100 * channel.fraction:.3g} %, limit {100 * channel.limit:.3g} %)"
        for channel, agreement in pairs
        if not channel.passes
    )
    why = _why(validation.causes)
    if not validation.passes:
        parts = (why, size, f"beyond the limit: {failed}") if why else (failed, size)
        return f"{name} does not agree: {'; '.join(parts if failed else parts[:2])}"
    rest = "nothing but noise is left" if validation.causes.is_noise else "; ".join([size, *([why] if why else [])])
    return f"{name} agrees with {count} recording{'s' * (count > 1)}: every RMS error is within its limit; {rest}"


def _why(causes: Causes) -> str:
    """Return what explains a disagreement, or what comes nearest; empty where nothing but noise is left."""
    if causes.found is not None:
        others = f" (or, the same for these recordings: {', '.join(one.name for one in causes.found.same)})"
        usual = ", as on any bench" if causes.found.is_usual else ""
        return f"{in_words(causes.found)}{usual}{others if causes.found.same else ''}"
    if not causes.tried:
        return ""
    nearest = causes.nearest
    near = "" if nearest is None else f"; nearest: {in_words(nearest)}, which leaves {nearest.left:.2g} times the noise"
    return f"no single change explains it{near}"


def in_words(one: Cause) -> str:
    """Return a cause in words, numbers of the set in the unit in which people see them."""
    if len(one.numbers) != 1:
        return one.in_words
    ((value, unit),) = one.numbers.values()
    # An atmosphere in gauge pressure says nothing.
    absolute, quantity = unit == "Pa_a", quantity_of_unit(unit)
    shown = f"{1e-3 * value:.4g} kPa" if absolute else quantity_text(value, quantity, ".4g")
    return f"{one.in_words} ({shown if absolute or quantity else f'{shown} {unit}'.removesuffix(' -')})"


def _cause_data(one: Cause | None) -> dict[str, Any] | None:
    if one is None:
        return None
    return {
        "name": one.name,
        "words": in_words(one),
        "same": [other.name for other in one.same],
        "gain": one.gain,
        "left": one.left,
        "numbers": {path: value for path, (value, _) in one.numbers.items()},
        "is_usual": one.is_usual,
    }


def _departures(validation: Validation, kinds: Sequence[str]) -> list[str]:
    """Return what the verdict must not be read without: recordings that nobody measured, values that were changed."""
    said = []
    if kinds:
        said.append(
            f"Not everything here was measured: {', '.join(KIND_WORDS[kind] for kind in kinds)}. Agreement with "
            "such a recording shows how well two models agree, not how well the model agrees with a device."
        )
    if validation.overrides:
        said.append(f"values changed: {', '.join(validation.overrides)}")
    return said


def _method(validation: Validation) -> str:
    return (
        f"The model with the valve '{validation.device.valve_name}' was run with the inputs of each recording, from "
        "the state of its first samples. An error is model less measured. Percentages are of the full range: the "
        "angle between the stops, the gauge pressure of the supply, and twice that for the pressure difference. One "
        "common delay was removed before the errors were computed."
    )


def _section(validation: Validation, name: str, agreement: RecordingAgreement) -> Section:
    kind = KIND_WORDS[agreement.measured.kind]
    atmosphere = validation.device.supply.atmospheric_pressure
    return Section(
        heading=f"{agreement.file} ({kind})",
        paragraphs=(replay_sentence(agreement),),
        table=Table(_HEAD, tuple(channel_cells(channel) for channel in agreement.channels)),
        remarks=tuple(f"note: {remark}" for remark in agreement.remarks),
        figure=Figure(
            f"{name}-agreement",
            f"Dots: {kind}. Lines: the model on the recorded inputs. Below each: model less measured, the limit of "
            "its RMS value dashed where it is in range.",
            lambda: agreement_figure(agreement, atmosphere),
        ),
    )


def _replay_csv(agreement: RecordingAgreement) -> bytes:
    return marked_csv_bytes(agreement.model.resample(agreement.measured.time))


def replay_sentence(agreement: RecordingAgreement) -> str:
    """Return how a recording was replayed, as plain words."""
    measured = agreement.measured
    late = f"{_MILLISECONDS * agreement.delay.correction:.3g} ms" if agreement.delay.correction else "none found"
    return (
        f"{len(measured)} samples over {measured.duration:.4g} s; inputs from the recording: "
        f"{', '.join(agreement.inputs)}; delay of the measurement: {late}"
    )


def channel_cells(channel: ChannelAgreement) -> tuple[str, ...]:
    """Return the cells of a row: name, RMS error, over noise, variation, share, limit, bias, largest to verdict."""
    return (
        channel.channel,
        _error(channel, channel.rms),
        _number(channel.in_noise),
        _error(channel, channel.variation),
        f"{_number(100 * channel.fraction)} %",
        f"{_number(100 * channel.limit)} %",
        _error(channel, channel.bias),
        _error(channel, channel.largest),
        f"{channel.largest_time:.4g} s",
        "pass" if channel.passes else "FAIL",
    )


def _error(channel: ChannelAgreement, value: float) -> str:
    quantity = COMPARED[channel.channel].quantity
    return f"{_number(display_value(value, quantity))} {display_unit(quantity)}"


def _number(value: float) -> str:
    """Return three digits; what is below a thousandth is written as 0, for nobody measures that."""
    return "0" if abs(value) < 5.0e-4 else f"{value:.3g}"


def _recording_data(agreement: RecordingAgreement) -> dict[str, Any]:
    return {
        "file": agreement.file,
        "sha256": agreement.sha256,
        "label": agreement.measured.label,
        "kind": agreement.measured.kind,
        "samples": len(agreement.measured),
        "duration": agreement.measured.duration,
        "motion": agreement.motion,
        "inputs": list(agreement.inputs),
        "step": agreement.step,
        "delay": agreement.delay.correction,
        "delay_is_at_limit": agreement.delay.is_at_limit,
        "passes": agreement.passes,
        "remarks": list(agreement.remarks),
        "channels": {channel.channel: _channel_data(channel) for channel in agreement.channels},
    }


def _channel_data(channel: ChannelAgreement) -> dict[str, Any]:
    quantity = COMPARED[channel.channel].quantity
    return {
        "unit": channel.unit,
        "rms": channel.rms,
        "rms_share": channel.fraction,
        "noise": channel.noise,
        "limit_share": channel.limit,
        "passes": channel.passes,
        "full_range": channel.full_range,
        "variation": channel.variation,
        "rms_unaligned": channel.rms_unaligned,
        "bias": channel.bias,
        "largest": channel.largest,
        "largest_time": channel.largest_time,
        "shown": {"unit": display_unit(quantity), "rms": display_value(channel.rms, quantity)},
    }
