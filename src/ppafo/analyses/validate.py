"""Comparison of a parameter set with recordings: replay, errors of each channel, cause of the residual, verdict."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from ppafo.analyses import ask, np
from ppafo.arguments import Duration, Name, Overrides, Volume, Word, checked
from ppafo.documents.json_text import fields_of
from ppafo.errors import DataError
from ppafo.plugins import Plugins
from ppafo.progress import Progress, Report, report_nothing
from ppafo.units.shown import in_units
from ppafo.version import __version__
from ppafo.wording import count_of, nearest_name, one_line, percentage

if TYPE_CHECKING:
    from pandas import DataFrame  # type: ignore[import-untyped]
    from xarray import Dataset

    from ppafo.parameters.device import Device
    from ppafo.report.finding import Finding
    from ppafo.signals import Recording
    from ppafo.storage.column_map import ColumnMap
    from ppafo.validation.agreement import ChannelAgreement, RecordingAgreement
    from ppafo.validation.causes import Diagnosis
    from ppafo.validation.measured import MeasuredRecording
    from ppafo.validation.settings import ReplaySettings

KIND_WORDS = {"measured": "measured", "synthetic": "synthetic measurement", "simulated": "simulated, not measured"}
"""Words of the report for the origin of a recording, so that model output does not pass for a measurement."""
_OF_START = 3.0
"""Error divided by noise [-] beyond which residuals that are noise are so with a fitted start alone."""
_EXPLAINS = 0.5
"""Largest ratio of the residual with the nearest cause to the residual without a cause at which a cause is named."""
_NEAR_LIMIT = 0.25
"""Least ratio of the largest residual to the RMS limit at which the panel shows the limit; else it would be flat."""
_SHORT = 3.0
"""Duration [s] below which the time axis is in milliseconds."""
_HEAD = ("channel", "RMS error", "in noise", "variation", "of range", "limit", "bias", "largest", "at", "verdict")
"""Column heads of the table of errors."""


@dataclass(frozen=True, slots=True)
class Validation:
    """Result of the validation of a parameter set against recordings.

    ``device``: device of the set after the ``overrides``
    ``settings``: settings of the replay
    ``recordings``: agreement of each recording with the model
    ``causes``: diagnosed causes of the residual
    """

    parameter_set: str
    device: Device
    overrides: tuple[str, ...]
    settings: ReplaySettings
    recordings: tuple[RecordingAgreement, ...]
    causes: Diagnosis

    @property
    def passes(self) -> bool:
        """True if every RMS error is within its limit; causes of the residual do not affect the verdict."""
        return all(recording.passes for recording in self.recordings)

    def json_document(self) -> dict[str, Any]:
        """Return errors, causes and recordings as plain data in SI."""
        from ppafo.validation.settings import COMPARED

        return {
            "format": "ppafo agreement",
            "schema_version": 1,
            **fields_of(self, "parameter_set", "passes"),
            "device": self.device.name,
            "valve": self.device.valve_name,
            "overrides": list(self.overrides),
            "longest_delay": self.settings.longest_delay,
            "summary": verdict(self),
            "causes": {
                "tried": self.causes.tried,
                **{
                    name: cause
                    and {
                        **fields_of(cause, "name", "gain", "left", "is_usual"),
                        "words": cause.in_words,
                        "same": [other.name for other in cause.same],
                        "numbers": {path: value for path, (value, _) in cause.numbers.items()},
                    }
                    for name, cause in (("found", self.causes.found), ("nearest", self.causes.nearest))
                },
            },
            "recordings": [
                {
                    **fields_of(agreement.request.measured, "file", "sha256"),
                    **fields_of(agreement, "delay", "passes"),
                    **fields_of(agreement.measured, "label", "kind", "duration"),
                    "samples": len(agreement.measured),
                    "motion": agreement.request.settings.motion,
                    "step": agreement.replayed.step,
                    "inputs": list(agreement.request.inputs),
                    "delay_is_at_limit": agreement.is_at_limit,
                    "remarks": list(agreement.remarks),
                    "channels": {
                        channel.channel: {
                            "unit": COMPARED[channel.channel].unit,
                            **fields_of(channel, "rms", "rms_unaligned", "noise", "passes", "full_range"),
                            **fields_of(channel, "variation", "bias", "largest", "largest_time"),
                            "rms_share": channel.fraction,
                            "limit_share": channel.limit,
                            "shown": {
                                # A difference of values, as of two pressures.
                                "unit": (kind := ask.Kind("", "", COMPARED[channel.channel].quantity)).shown_unit,
                                "rms": kind.shown(channel.rms),
                            },
                        }
                        for channel in agreement.channels
                    },
                }
                for agreement in self.recordings
            ],
            "versions": {"ppafo": __version__},
        }


@checked
def validate(
    parameter_set: Annotated[str | Path, Word("PARAMETERS")],
    recordings: Sequence[Annotated[Recording | DataFrame | Dataset | str | Path, Word("RECORDING")]],
    *,
    valve: Name | None = None,
    overrides: Overrides = (),
    motion: Annotated[str, Word("free|measured|locked|leg")] = "free",
    volume: Volume | None = None,
    initial: Sequence[Annotated[str, Word("CHANNEL=VALUE")]] = (),
    thresholds: Annotated[Sequence[str], Word("[CHANNEL=]LIMIT", option="--threshold")] = (),
    longest_delay: Duration = 0.02,
    columns: Annotated[ColumnMap | str | Path, Word("FILE.toml[:NAME]")] | None = None,
    plugins: Plugins = (),
    progress: Report | None = None,
) -> Finding[Validation]:
    """Compare a parameter set with recordings, channel by channel.

    The model is run on the recorded command, supply pressure and external torque; residuals are measured - model.
    Without thresholds, an RMS error may be 3 % of full range, or less if that is over half of the variance of the
    signal, in addition to noise and the usual zero error of the sensor. A cause of the residual is named in any case.

    Arguments:
        parameter_set: name of a parameter set, or a .toml file
        recordings: a .csv or .nc file, or a result folder; several may be given
        valve: valve of the parameter set; default: its default valve
        overrides: values to change, for example 'valve.area=12.6 mm^2'; may be repeated
        motion: free: the model moves the vane; measured: the vane follows the recorded angle; locked: the vane stays at
            its initial angle; leg: the model moves vane and foot on the fixture of step-response (default free)
        volume: no vane: the valve fills and vents chamber 1 of this fixed volume, for example '60 cm^3'; pressure_1 is
            compared
        initial: initial value of a channel that was not recorded, for example 'pressure_2=0 psi_g'
        thresholds: maximum RMS error, as a fraction of full range or with a unit: 5%, angle=10%, 'pressure_1=3.7
            psi_d'; default: 3%, and half of the variance of the signal is explained
        longest_delay: maximum delay of the measurement to estimate; default '20 ms', '0 s' for none
        columns: file with a column map [columns.NAME], for recordings with other column names; a problem file may
            contain it
        plugins: modules of your own, files or names, whose objects files may name
        progress: called with every count of a long computation

    Returns:
        a Finding whose ``found`` is a Validation with ``passes`` and, in ``recordings``, one ``RecordingAgreement``
        each: ``measured`` and ``model`` are recordings, their channels of shape (samples,) in SI; ``channels`` has
        RMS error, bias, largest error and delay [s] of each channel in its SI unit (rad, Pa, N m)

    Raises:
        DataError: a recording that cannot be used
        ParameterError: a parameter set that cannot be used
        SimulationError: a model that cannot be run on the recording

    >>> import ppafo
    >>> folder = ppafo.simulate("step-response").save("bench")
    >>> print(ppafo.validate("ppafo2011", [folder], motion="leg", overrides=["supply.pressure=55 psi_g"]).said[0])
    ppafo2011 agrees with 1 recording: every RMS error is within its limit; nothing but noise is left
    """
    from ppafo.parameters import load_device
    from ppafo.validation.agreement import compare_recording
    from ppafo.validation.causes import causes_of
    from ppafo.validation.measured import read_measured
    from ppafo.validation.settings import LARGEST_DELAY, MOTIONS, ReplaySettings, parse_initial, parse_thresholds

    report = progress or report_nothing
    device = load_device(parameter_set, overrides=overrides, valve=valve)
    device.check_pressurised("a validation, which counts in parts of the gauge supply pressure,")
    if longest_delay > LARGEST_DELAY:
        raise DataError(f"longest delay = {longest_delay:g} s: must be from 0 to {LARGEST_DELAY:g} s")
    chosen = next((known for known in MOTIONS if known == motion), None)
    if chosen is None:
        hint = nearest_name(motion, MOTIONS)
        raise DataError(f"motion '{one_line(motion)}': must be one of {', '.join(MOTIONS)}{hint}")
    if volume is not None and chosen != "free":
        raise DataError(f"motion '{chosen}': a fixed volume has no moving vane")
    states = parse_initial(initial, device.supply.atmospheric_pressure)
    settings = ReplaySettings(chosen, states, longest_delay, parse_thresholds(thresholds), volume)
    if not recordings:
        raise DataError("no recording was given; give at least one .csv or .nc file or result folder")
    read: dict[str, MeasuredRecording] = {}
    for measured in (read_measured(source, device, columns) for source in recordings):
        # Given twice, under two names too, a recording would count twice as evidence.
        if (same := read.setdefault(measured.sha256, measured)) is not measured:
            raise DataError(f"{measured.file}: is the same recording as {same.file}; give every recording only once")
    agreements = []
    for measured in read.values():
        report(Progress(f"replaying {measured.file}"))
        agreements.append(compare_recording(measured, device, settings))
    causes = causes_of(agreements, report)
    return _finding_of(Validation(str(parameter_set), device, tuple(overrides), settings, tuple(agreements), causes))


def verdict(validation: Validation) -> str:
    """Return a sentence on the agreement of the set, with the largest deviation and its probable cause, if any."""
    from ppafo.simulation.recorded.usual_errors import PRESSURE_ERRORS

    causes = validation.causes
    passes = validation.passes
    recordings = validation.recordings
    pairs = [(channel, agreement) for agreement in recordings for channel in agreement.channels]
    # The difference of two pressures is no channel of its own.
    worst, _ = max(pairs, key=lambda pair: (pair[0].channel in pair[1].measured, pair[0].in_noise))
    removed = max(agreement.delay for agreement in recordings)
    if causes.is_noise:
        # The search fits the state at the start too, where a joint that moves already has no rest to read it from.
        fitted = " once the state at the start is fitted" if worst.in_noise > _OF_START else ""
        texts = [f"nothing but noise is left{fitted}"]
    else:
        texts = [
            f"{worst.channel} is off by {_times(worst.in_noise)} times its noise "
            f"({percentage(worst.fraction, 2)} of full range)"
        ]
        if causes.found is not None:
            removed = causes.found.delay
            # An error beyond a limit is more than usual, of whatever kind it is.
            said = f"{causes.found.in_words}{', as on any bench' if causes.found.is_usual and passes else ''}"
            same = ", ".join(cause.name for cause in causes.found.same)
            texts.insert(0, f"{said} (indistinguishable with these recordings: {same})" if same else said)
        elif causes.tried or causes.kinds:
            if not passes and any(row.request.settings.motion == "free" for row in recordings):
                texts.append("the vane was taken to be free")
            second = ", for a second one is seen beside the nearest" if causes.has_second else ""
            texts.append(f"no single change explains the residual{second}")
            # Named if it at least halves the error, leaves noise, or is of wrong samples, found whatever else is wrong.
            near = causes.nearest
            if near is not None and (
                causes.has_second or near.is_of_samples or near.left <= _EXPLAINS * worst.in_noise
            ):
                left = [
                    f"{each.in_words}, which leaves {_times(each.left)} times the noise" for each in (near, *near.same)
                ]
                texts.append(f"nearest: {', or '.join(left)}")
            texts += [f"tried: {causes.kinds}"] if causes.kinds else []
    # Said if it is longer than usual of sensors: a valve may be late as well.
    if removed > PRESSURE_ERRORS.delay:
        said = f"a delay of {1.0e3 * removed:.3g} ms was removed"
        if (delay := validation.device.valve.settings.get("delay")) is not None:
            said += f", of the sensors or of the valve (valve.delay = {1.0e3 * (delay + removed):.3g} ms)"
        texts.append(said)
    explanation = "; ".join(texts)
    name = validation.device.name
    if not passes:
        failed = ", ".join(
            f"{channel.channel} in {agreement.file} ({percentage(channel.fraction, 3)}, limit "
            f"{percentage(channel.limit, 3)})"
            for channel, agreement in pairs
            if not channel.passes
        )
        return f"{name} does not agree: {failed}; {explanation}"
    agreed = f"{name} agrees with {count_of(len(recordings), 'recording')}"
    if causes.is_noise or (causes.found is not None and causes.found.is_usual):
        return f"{agreed}: every RMS error is within its limit; {explanation}"
    return f"{agreed} within {percentage(worst.limit, 3)} of full range, but {explanation}"


def _times(size: float) -> str:
    """Return a multiple of the noise as text with two digits and without a power of ten."""
    return f"{size:.2g}" if size < 100.0 else f"{size:.0f}"


@in_units(lambda validation: validation.device.shown)
def _finding_of(validation: Validation) -> Finding[Validation]:
    """Return a validation as a finding; passed if every error is within its limit."""
    from ppafo.storage.comma_separated import marked_csv_bytes

    # Stems of the written files, numbered if recordings have one name.
    stems = [
        re.sub(r"[^\w.-]+", "-", Path(row.file).stem, flags=re.ASCII).strip("-.") or "recording"
        for row in validation.recordings
    ]
    names = [
        f"{stem}-{1 + stems[:index].count(stem)}" if stems.count(stem) > 1 else stem for index, stem in enumerate(stems)
    ]
    pairs = list(zip(names, validation.recordings, strict=True))
    kinds = {agreement.measured.kind for _, agreement in pairs}
    said = [verdict(validation)]
    # The verdict must not be read without these.
    if unmeasured := sorted(kinds - {"measured"}):
        said.append(
            f"Not everything here was measured: {', '.join(KIND_WORDS[kind] for kind in unmeasured)}. Agreement with "
            "such a recording shows how well two models agree, not how well the model agrees with a device."
        )
    method = (
        f"The model with the valve '{validation.device.valve_name}' was run with the inputs of each recording, from "
        "the state of its first samples. A residual is measured - model. Percentages are of the full range: the "
        "angle between the stops, the gauge pressure of the supply, and twice that for the pressure difference. One "
        "common delay was removed before the errors were computed."
    )
    read = [agreement.request.measured for _, agreement in pairs]
    hashes = [(measured.file, f"sha256 {measured.sha256}") for measured in read if measured.sha256]
    return ask.Finding(
        name="validate",
        kicker="Validation of a parameter set",
        title=f"{validation.device.name} against {count_of(len(validation.recordings), 'recording')}",
        said=said,
        parts=(
            ask.Section(said=[method], is_detail=True),
            *(_part(name, agreement) for name, agreement in pairs),
            ask.Section("Files" if hashes else "", ask.columns_of(("", ""), hashes), is_detail=True),
        ),
        found=validation,
        passed=validation.passes,
        kind=next(iter(kinds)) if len(kinds) == 1 else "measured",
        overrides=validation.overrides,
        files={
            f"{name}-replayed.csv": partial(marked_csv_bytes, agreement.model.resample(agreement.measured.time))
            for name, agreement in pairs
        },
    )


def _part(name: str, agreement: RecordingAgreement) -> ask.Section:
    """Return the section of one recording: table of errors, and panels. ``name`` is the stem of its files."""
    from ppafo.validation.settings import COMPARED

    def number(value: float) -> str:
        return "0" if abs(value) < 5.0e-4 else f"{value:.3g}"

    def cells(channel: ChannelAgreement) -> tuple[str, ...]:
        kind = ask.Kind("", "", COMPARED[channel.channel].quantity)
        rms, variation, bias, largest = (
            f"{number(kind.shown(value))} {kind.shown_unit}"
            for value in (channel.rms, channel.variation, channel.bias, channel.largest)
        )
        shares = [f"{number(100 * share)} %" for share in (channel.fraction, channel.limit)]
        end = bias, largest, f"{channel.largest_time:.4g} s", "pass" if channel.passes else "FAIL"
        return channel.channel, rms, number(channel.in_noise), variation, *shares, *end

    measured = agreement.measured
    kind = KIND_WORDS[agreement.measured.kind]
    delay = f"{1.0e3 * agreement.delay:.3g} ms" if agreement.delay else "none found"
    replayed = (
        f"{len(measured)} samples over {measured.duration:.4g} s; inputs from the recording: "
        f"{', '.join(agreement.request.inputs)}; delay of the measurement: {delay}"
    )
    across = 1 if len(agreement.channels) == 1 else 2
    return ask.Section(
        f"{agreement.file} ({kind})",
        ask.columns_of(_HEAD, map(cells, agreement.channels)),
        [replayed],
        remarks=[f"note: {remark}" for remark in agreement.remarks],
        panels=partial(_panels, agreement, across),
        name=f"{name}-agreement",
        caption=f"Dots: {kind}. Lines: the model on the recorded inputs. Below each: the residual, measured - "
        "model, the limit of its RMS value dashed where it is in range.",
        across=across,
        size=(6.0 / across, 1.9),
    )


def _panels(agreement: RecordingAgreement, across: int) -> list[ask.Panel]:
    """Return the panels of a recording in rows of ``across`` channels: samples with the model, and residuals below."""
    from ppafo.report.residuals import FittedCurve, course_panels
    from ppafo.report.style import ACTUAL, CHAMBER_1, CHAMBER_2
    from ppafo.validation.settings import COMPARED, PRESSURE_1, PRESSURE_2

    measured = agreement.measured
    looks = {PRESSURE_1: CHAMBER_1, PRESSURE_2: CHAMBER_2}
    time, scale = (ask.Kind("Time", "ms"), 1.0e3) if measured.duration < _SHORT else (ask.TIME, 1.0)
    pairs: list[list[ask.Panel]] = []
    for index, channel in enumerate(agreement.channels):
        name = channel.channel
        quantity = COMPARED[channel.channel]
        limit = channel.limit * channel.full_range
        curve = FittedCurve(
            time=time,
            level=ask.Kind(quantity.title, "", "pressure" if name in looks else quantity.quantity),
            change=ask.Kind(f"Measured - model, RMS {percentage(channel.fraction, 2)}", "", quantity.quantity),
            times=scale * measured.time,
            samples=channel.values,
            model=channel.model,
            names=("", "") if index else (KIND_WORDS[measured.kind], "model on the recorded inputs"),
            colour=looks.get(name, ACTUAL).colour,
        )
        is_near = float(np.abs(channel.residuals).max()) >= _NEAR_LIMIT * limit
        pairs.append(course_panels(curve, "dots", "" if index else "figure", (-limit, limit) if is_near else ()))
    # An odd number of channels leaves one place in the last row empty.
    pairs += [[ask.Panel(ask.TIME, ask.TIME, ()), ask.Panel(ask.TIME, ask.TIME, (), tall=0.5)]] * (-len(pairs) % across)
    rows = [pairs[first : first + across] for first in range(0, len(pairs), across)]
    return [panel for row in rows for level in zip(*row, strict=True) for panel in level]
