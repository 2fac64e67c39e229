"""Report of a walk of one wearer with and without the device: text, tables and figures."""

import platform
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from functools import partial
from typing import Any

from ppafo.analyses import ask, np
from ppafo.constants import STANDARD_ATMOSPHERE
from ppafo.documents.json_text import fields_of, plain
from ppafo.errors import PpafoError
from ppafo.metrics.strides import PER_STRIDE
from ppafo.parameters.reach import torque_reach
from ppafo.simulation.numbers import declared_numbers
from ppafo.simulation.scenario import UNITS
from ppafo.simulation.tracking.case import overrides_of
from ppafo.storage.comma_separated import marked_csv_bytes
from ppafo.storage.netcdf import netcdf_bytes
from ppafo.units.shown import in_units
from ppafo.version import __version__
from ppafo.walking.bottle.coupling import SupplyCourse, duration_text, strides_text
from ppafo.walking.figures.bottle import bottle_figure
from ppafo.walking.figures.legs import frames_figure
from ppafo.walking.figures.mean_stride import walk_figure
from ppafo.walking.gait_series import gait_timing
from ppafo.walking.motion import person_remarks, walk_of, with_duration
from ppafo.walking.planning import law_of, sensor_numbers
from ppafo.walking.result import WALK_FORMAT, WalkResult, limited_request
from ppafo.walking.strides import PHASES
from ppafo.walking.walk import WalkComparison, walk

_PRESSURE, _TORQUE, _GAS = (ask.Kind(quantity=name, form=".3g") for name in ("pressure", "torque", "gas mass"))
_SHARE, _WARMTH, _BOTTLE_PRESSURE = (
    ask.Kind(quantity=name, form=".0f") for name in ("fraction", "temperature", "pressure")
)
_WORK = ask.Kind("", "J", "energy", ".3g")
_PERCENT = ask.Kind("", "1", "fraction", ".2g")
_ANGLE = ask.Kind("", "rad", "angle", ".3g")
_HEIGHT = ask.Kind("", "m", "length", ".2g")
_NUMBERS = {
    "body_mass": ("Body mass of the wearer", "mass", 1),
    "gas": ("Gas per stride", "gas mass", 3),
    "total_gas": ("Gas of the whole walk", "gas mass", 2),
    "positive_push_off_work": ("Positive work on the wearer in push-off", "energy", 2),
    "push_off_share": ("... of the healthy ankle's positive work", "fraction", 1),
    "net_push_off_work": ("Net work on the wearer in push-off", "energy", 2),
    "torque_error": ("RMS torque error while torque is requested", "torque", 2),
    "requested_torque": ("... RMS of the requested torque", "torque", 2),
    "peak_torque": ("Largest torque in either direction", "torque", 1),
    "largest_torque": ("... limit of the controller", "torque", 1),
    "reversals_per_stride": ("Command reversals per stride", "", 1),
    "lowest_toes": ("Lowest toe height above ground in mid-swing", "body length", 1),
    "toe_landing": ("Strides that begin on the toes", "fraction", 0),
    "dorsiflexor_moment": ("Moment of the wearer's dorsiflexors, mean", "torque", 2),
    "angle_difference": ("RMS difference to the healthy ankle angle", "angle", 1),
    "counted_strides": ("Strides in these means", "", 0),
}
"""Rows of the table of metrics of a walk: title, kind of quantity and number of decimals by name."""
_EXPLAINED = (
    "'Without' is the same wearer without a device: no plate, torque or friction, and the ankle's own range of motion. "
    "'Healthy' is the gait itself. Ground contact in the swing is not simulated: toes below the ground would drag. "
    "The first two strides, in which the controller learns the stride time, and an unfinished last stride are left "
    "out. The device is on one leg, so a stride is one step of that leg. The gait is prescribed: the device moves "
    "the ankle where the foot is free, and cannot change how the wearer walks."
)
_LEGS = (
    "Shank and foot on the path that the gait prescribes. A cross marks toes below the ground in mid-swing: they "
    "would drag."
)
_MEAN = (
    "Mean over the strides with the standard deviation as a band. A deterministic walk on a perfectly regular gait "
    "has almost none."
)
_BOTTLE = (
    "Gas supply over the walk. A regulator delivers its set pressure at most, and less as the bottle empties. "
    "Gas at the device leaves the hose."
)
_BOTTLE_EXPLAINED = (
    "The vapour of liquid CO2 at 20 degC needs 95 kJ/kg to become gas of 25 degC behind the regulator. It draws "
    "this heat from the regulator's body and the hose, and these from the room. Below the triple point dry ice "
    "stays in the seat and narrows it. The gas in lines and chambers keeps the temperature with which it leaves the "
    "hose; in reality their walls warm it, so its effect is overestimated here.",
    "A walk ends when the line behind the regulator does not reach the given fraction of the set pressure within two "
    "strides, or when the fluid in the bottle freezes.",
)
_PRESSURES = (1.2, 1.4, 1.7, 2.0, 3.0, 5.0)
"""Factors on the gauge pressures of the supplies that are tried if the toes would drag."""
_HIGHEST_PRESSURE = 1.0e6
"""Highest gauge pressure [Pa] that is tried: ten bar, the rating of most small pneumatic parts."""
_NEARLY = 0.95
"""Ratio of a torque to its limit from which the limit counts as reached [-]."""
_FIRST_TRIAL = 9.0
"""Duration of the first walk with a remedy [s]; one that does not suffice in it is not tried for the whole duration."""


@in_units(lambda comparison: comparison.with_device.scenario.device.shown)
def finding_of(comparison: WalkComparison) -> ask.Finding[dict[str, Any]]:
    """Return the comparison of a walk with and without the device as a finding.

    A walk that diverged has numbers but no figures, and the report has not passed.
    """
    worn = comparison.with_device
    scenario = worn.scenario
    motion = walk_of(worn.scenario)
    law = law_of(worn.scenario)
    strides = f"{worn.metrics['strides'].value:.0f} strides" if "strides" in worn.metrics else "no strides"
    ended = f"{scenario.name}: {worn.status.kind}, {strides} of {motion.gait.name}"
    verdict = ask.verdict_of(worn)
    gains = ask.gains_of(scenario)
    cut_off = (walked for walked in (worn, comparison.without_device) if not walked.status.is_completed)
    said = [ended, *(f"{walked.scenario.name}: {walked.status.message}" for walked in cut_off)]
    said += [benefit_sentence(comparison), verdict.sentence, limited_request(scenario)]
    said += [scenario.origin.replaced, "" if gains is None else gains.sentence]
    title = f" ({motion.gait.title})" if motion.gait.title else ""
    set_up = (scenario.description, f"device '{scenario.device.name}', gait '{motion.gait.name}'{title}", law.summary)
    mended = ask.usage_text(ask.reloaded(scenario, verdict.mended)) if verdict.mended else ""
    supply = worn.supply
    bottle = []
    pictures = []
    remarks = [*person_remarks(scenario)]
    pressures = scenario.device.supply.pressure, scenario.device.supply.dorsiflexion_pressure
    for number, pressure in enumerate(pressures, 1):
        channel = f"pressure_{number}"
        largest = float(worn.recording[channel].max()) if channel in worn.recording else 0.0
        # The foot compresses the chamber; with healthy wearers by less.
        if largest > 2.0 * pressure:
            reached, supplied = map(_PRESSURE.text, (largest, pressure))
            remarks.append(
                f"the pressure in chamber {number} reaches {reached}, at a supply pressure of {supplied}: "
                f"actuator, valves and tubing must withstand {reached}"
            )
    if supply:
        bottle = [
            ask.Section("On the bottle", ask.columns_of(("", ""), _bottle_facts(worn, supply))),
            ask.Section(
                "The bottle over the walk",
                name="bottle",
                caption=_BOTTLE,
                draw=partial(bottle_figure, worn),
                is_detail=True,
            ),
            ask.Section("How to read the bottle", said=_BOTTLE_EXPLAINED, is_detail=True),
        ]
    # Without a whole stride there is no mean of them.
    if worn.averages and comparison.without_device.averages:
        legs = partial(frames_figure, comparison)
        mean = partial(walk_figure, {"with the device": worn, "without": comparison.without_device})
        pictures = [
            ask.Section("The leg", name="legs", caption=_LEGS, draw=legs, is_detail=True),
            ask.Section("The mean stride", name="mean-stride", caption=_MEAN, draw=mean, is_detail=True),
        ]
    files: dict[str, Callable[[], bytes]] = {"recording.csv": partial(marked_csv_bytes, worn.recording)}
    for result, ending in ((worn, ""), (comparison.without_device, "-off")):
        files[f"recording{ending}.nc"] = partial(netcdf_bytes, result.recording, None)
        files[f"strides{ending}.csv"] = partial(_strides_csv, result)
        files[f"mean-stride{ending}.csv"] = partial(_mean_stride_csv, result)
    if supply:
        files["bottle.csv"] = partial(marked_csv_bytes, supply.recording)
    assumed = [(assumption.path, assumption.note) for assumption in scenario.assumptions]
    return ask.Finding(
        name="walk",
        kicker=f"A walk of {float(worn.recording.time[-1]) / 60.0:.3g} min",
        title=f"Walking with {scenario.name}",
        said=[sentence for sentence in said if sentence],
        parts=(
            ask.Section(said=[sentence for sentence in set_up if sentence], is_detail=True),
            ask.Section(columns=comparison_table(comparison), remarks=[remark for remark in remarks if remark]),
            *bottle,
            ask.Section("Command with the remedy" if mended else "", code=mended),
            ask.Section("How to read it", said=(_EXPLAINED,), is_detail=True),
            *pictures,
            ask.Section(
                "Assumptions" if assumed else "", ask.columns_of(("value", "why"), assumed), left=2, is_detail=True
            ),
        ),
        found=_walk_data(comparison, verdict),
        passed=comparison.is_completed,
        files=files,
        overrides=ask.changes_in(scenario),
    )


# Benefit of the device against the same walk without it, and a remedy if it does not help.


def benefit_sentence(comparison: WalkComparison) -> str:
    """Return a sentence on whether the device helps until the end of the walk; "" for a walk that diverged.

    The device helps by net work in push-off, toes above the ground, and an ankle closer to the healthy angle.
    """
    worn = comparison.with_device
    bare = comparison.without_device
    numbers, without = ({name: metric.value for name, metric in walked.metrics.items()} for walked in (worn, bare))
    if "diverged" in (worn.status.kind, bare.status.kind) or "net_push_off_work" not in numbers:
        return ""
    has_work = numbers["net_push_off_work"] > 0.0
    drags, drags_without = (metrics.get("lowest_toes", 0.0) < 0.0 for metrics in (numbers, without))
    clauses = [f"{_WORK.text(numbers['net_push_off_work'])} of net work in push-off"]
    lifts = drags_without and not drags
    if "push_off_share" in numbers:
        clauses[0] += f" (positive work {_PERCENT.text(numbers['push_off_share'])} of the healthy ankle's)"
    if "angle_difference" in numbers and "angle_difference" in without:
        angle, angle_without = (metrics["angle_difference"] for metrics in (numbers, without))
        lifts |= not drags and angle < angle_without
        clauses.append(f"ankle {_ANGLE.text(angle)} from the healthy one ({_ANGLE.text(angle_without)} without)")
    if "lowest_toes" in numbers:
        height = "toes would drag" if drags else f"toes {_HEIGHT.text(numbers['lowest_toes'])} over the ground"
        height_without = "also" if drags == drags_without else "would drag" if drags_without else "clear"
        clauses.append(f"{height} ({height_without} without)")
    if not (has_work or lifts):
        verdict = "the device does not help"
    elif drags:
        verdict = "the device helps in push-off but not in swing"
    else:
        verdict = "the device helps" if has_work else "the device helps in swing alone"
    if not worn.status.is_completed:
        verdict = f"until then {verdict}"
    remedied = _remedied(worn, drags) if drags or not has_work else []
    return "; ".join([f"{verdict}, against the same walk without it: {', '.join(clauses)}", *remedied])


def _remedied(worn: WalkResult, drags: bool) -> list[str]:
    """Return a clause on the cause of missing help, with the first remedy that another walk confirms or advice.

    The list is empty for a walk on a bottle, and for a cause without remedy and advice. A remedy needs push-off work
    and, if the toes would drag, clear toes.
    """
    if walk_of(worn.scenario).bottle is not None:
        return []
    cause, remedies, advice = _trials(worn, drags)
    whole = worn.scenario.run.duration
    for overrides in remedies:
        with suppress(PpafoError):
            # Toes may sink from stride to stride: the whole walk decides.
            for seconds in (_FIRST_TRIAL, whole) if whole > _FIRST_TRIAL else (whole,):
                again = walk(with_duration(ask.reloaded(worn.scenario, overrides), seconds))
                if not again.status.is_completed:
                    break
                toes, work = (again.metrics[name].value for name in ("lowest_toes", "net_push_off_work"))
                if work <= 0.0 or (drags and toes < 0.0):
                    break
            else:
                changes = " and ".join(f"`{text.replace('=', ' = ', 1)}`" for text in overrides)
                gain = f"toes {_HEIGHT.text(toes)} over the ground and {_WORK.text(work)}"
                minutes = f"{whole / 60.0:.3g} min"
                return [f"{cause}: for example with {changes}, {gain}, simulated in another walk of {minutes}"]
    return [f"{cause}, and {advice}"] if advice else []


def _trials(worn: WalkResult, drags: bool) -> tuple[str, Sequence[tuple[str, ...]], str]:
    """Return the cause of missing help, the overrides of each remedy to try in turn, and advice if none suffices.

    ``drags`` is True if the toes would drag. Where the controller requests less torque at the lowest toes than the
    actuator gives, a stiffer hold is tried; a limit that cuts the request is raised to the torque of the actuator.
    """
    scenario = worn.scenario
    requested = 0.0
    available = 0.0
    settings = scenario.controller.settings
    supply = scenario.device.supply
    levels = {"supply.pressure": supply.pressure}
    if supply.dorsiflexion_pressure != supply.pressure:
        levels["supply.dorsiflexion_pressure"] = supply.dorsiflexion_pressure
    # Supply pressures [Pa] by path, least first, up to what small parts withstand.
    raised = [
        {path: STANDARD_ATMOSPHERE + factor * (level - STANDARD_ATMOSPHERE) for path, level in levels.items()}
        for factor in _PRESSURES
        if factor * (supply.pressure - STANDARD_ATMOSPHERE) <= _HIGHEST_PRESSURE
    ]
    if scenario.controller.kind == "off":
        # A controller alone, and with the valve that it needs.
        law = "controller.kind=event_proportional"
        valve = "device.valve=proportional"
        return "its controller is off", ((law,), (law, valve)), "another controller alone does not help"
    if drags and "reference" in worn.averages:
        # Dorsiflexion torques at the lowest toes: requested, and of the actuator.
        timing = gait_timing(walk_of(scenario).gait)
        first, last = PHASES.searchsorted([timing.clearance_from, timing.clearance_to])
        lowest = first + int(worn.averages["toe_height"].mean[first:last].argmin())
        request, angle = (float(worn.averages[name].mean[lowest]) for name in ("reference", "angle"))
        requested = -request
        available = -torque_reach(scenario.device, angle)[0]
    path = "controller.hold_stiffness"
    other = "an actuator with more torque" if drags else "another timing of push-off"
    if requested >= _NEARLY * available or "hold_stiffness" not in settings:
        return (
            "the ankle is not lifted enough" if drags else "the torque opposes the motion",
            [overrides_of(scenario, pressures) for pressures in raised],
            f"more supply pressure alone does not suffice; {other} was not tried",
        )
    limit = {"controller.largest_torque": available} if requested >= _NEARLY * settings["largest_torque"] else {}
    stiffness = max(float(settings["hold_stiffness"]), declared_numbers(scenario)[path].default or 0.0)
    holds = [*([limit] if limit else []), *({**limit, path: factor * stiffness} for factor in (2.0, 4.0))]
    # A stiffer hold alone comes before one with more pressure: the valve may fill the chamber too slowly.
    filled = [{**hold, **pressures} for hold in holds[-2:] for pressures in raised[:3]]
    largest = overrides_of(scenario, holds[-1])[-1].replace("=", " = ", 1)
    return (
        f"the ankle is not lifted enough, as the controller requests {_TORQUE.text(requested)} at the lowest toes, "
        f"where the actuator gives {_TORQUE.text(available)}",
        [overrides_of(scenario, numbers) for numbers in (*holds, *filled)],
        f"larger settings up to `{largest}`, alone and with more supply pressure, were simulated and do not suffice",
    )


# Data and files of a walk.


def _walk_data(comparison: WalkComparison, verdict: ask.Tracking) -> dict[str, Any]:
    """Return ``walk.json``: metrics (with the device, without it, healthy) and events as plain data in SI units.

    ``verdict`` is on the torque that the controller requests. A bottle is described by its values, without the gas
    property tables; at its end, and at their lowest, are its series.
    """
    worn = comparison.with_device
    bare = comparison.without_device
    scenario = comparison.with_device.scenario
    motion = walk_of(scenario)
    control = scenario.controller
    origin = scenario.origin
    supply = worn.supply
    of_supply = (
        {}
        if supply is None
        else {
            "supply": {
                **supply.supply.to_dict(),
                "ending": supply.ending._asdict(),
                "balance": supply.balance,
                "at_end": {name: float(values[-1]) for name, values in supply.values.items()},
                "lowest": {name: float(np.min(values)) for name, values in supply.values.items()},
            }
        }
    )
    return {
        "format": WALK_FORMAT,
        "schema_version": 1,
        "units": UNITS,
        "status": plain(worn.status),
        "status_off": plain(bare.status),
        "metrics": plain(dict(worn.metrics)),
        "metrics_off": plain(dict(bare.metrics)),
        "versions": {"ppafo": __version__, "python": platform.python_version(), "numpy": np.__version__},
        "configuration": {
            **fields_of(scenario, "name", "description"),
            "device": plain(scenario.device),
            "gait": plain(motion.gait),
            "wearer": plain(motion.wearer),
            "wearer_origin": motion.wearer_origin,
            "controller": control.kind,
            "settings": plain(control.settings),
            "period": control.period,
            "step": scenario.run.step,
            "sensors": {"numbers": plain(sensor_numbers(scenario)), "seed": scenario.sensors.seed},
            "supply_line": plain(scenario.supply_line),
            "gas_model": plain(scenario.gas_model),
            "bottle": None if motion.bottle is None else motion.bottle.to_dict(),
            "assumed": {assumption.path: assumption.note for assumption in scenario.assumptions},
            **fields_of(origin, "file", "content"),
            "overrides": list(origin.overrides),
        },
        "shown": dict(scenario.device.shown),
        "tracking": plain(verdict),
        "gains": plain(ask.gains_of(scenario)),
        "minutes": float(worn.recording.time[-1]) / 60.0,
        **of_supply,
        "healthy": plain(dict(comparison.healthy)),
    }


def _bottle_facts(worn: WalkResult, supply: SupplyCourse) -> list[tuple[str, str]]:
    """Return end of the walk and its time, gas used, and lowest temperatures, as pairs of name and value."""
    values = supply.values
    motion = walk_of(worn.scenario)
    peaks = worn.peak_torques
    end = {name: float(series[-1]) for name, series in values.items()}
    filled = f"{_GAS.text(supply.supply.mass)} at {_WARMTH.text(supply.supply.temperature)}"
    remaining = _GAS.text(end["bottle_mass"])
    if "liquid_mass" in values:
        remaining += f", {_GAS.text(end['liquid_mass'])} of it liquid"
    # Strides are counted by time, as ``ppafo bottle`` counts them.
    strides = strides_text(supply.ending.time / motion.gait.stride_time)
    walked = f"{strides} strides, {worn.metrics['strides'].value:.0f} of them whole between strikes"
    rows = [
        ("bottle", f"{supply.supply.bottle.title}, with {filled}"),
        ("reason for the end", supply.ending.message),
        ("when", f"{duration_text(supply.ending.time)}, {walked}"),
        ("gas used", f"{_GAS.text(supply.balance['left_bottle'])}, left {remaining}"),
        (
            "bottle at the end",
            f"{_WARMTH.text(end['bottle_temperature'])}, {_BOTTLE_PRESSURE.text(end['bottle_pressure'])}",
        ),
        ("coldest gas behind the regulator", _WARMTH.text(float(values["outlet_temperature"].min()))),
        ("coldest gas at the device", _WARMTH.text(float(values["gas_temperature"].min()))),
        ("seat free of ice, at least", _SHARE.text(float(values["seat_open"].min()))),
    ]
    # The third stride is the first in which the controller knows the stride time.
    if peaks.size > 3:
        third = _TORQUE.text(float(peaks[2]))
        last = _TORQUE.text(float(peaks[-1]))
        rows.append(("push-off peak by stride", f"{third} in the third, {last} in the last"))
    return rows


def comparison_table(comparison: WalkComparison) -> list[ask.Column]:
    """Return the table of metrics by row, with columns for the device, without it, and a healthy ankle."""
    walks = {"with": comparison.with_device.metrics, "without": comparison.without_device.metrics}
    walker = comparison.with_device.scenario
    columns = {}
    for head, metrics in (walks | {"healthy": comparison.healthy}).items():
        values: dict[str, float | str | None] = {"body_mass": walk_of(walker).wearer.body_mass}
        values |= {name: metric.value for name, metric in metrics.items()}
        if "lowest_toes" in metrics and metrics["lowest_toes"].value < 0.0:
            values["lowest_toes"] = "would drag"
        if "command_reversals" in metrics and "strides" in metrics and metrics["strides"].value > 0.0:
            values["reversals_per_stride"] = metrics["command_reversals"].value / metrics["strides"].value
        columns[head] = values
    columns["with"]["largest_torque"] = walker.controller.settings.get("largest_torque")
    # The positive work of a healthy ankle is what the device's is a share of.
    if "positive_push_off_work" in comparison.healthy:
        columns["healthy"]["push_off_share"] = 1.0
    # A number that no walk of the table has would be a row of dashes.
    rows = []
    for name, (title, quantity, digits) in _NUMBERS.items():
        numbers = [values.get(name) for values in columns.values()]
        if any(number is not None for number in numbers):
            kind = ask.Kind(title, quantity=quantity)
            # A number rounded to zero has no sign.
            texts = [f"{kind.shown(each):z.{digits}f}" if isinstance(each, float) else each for each in numbers]
            rows.append((kind.title, *texts))
    return ask.columns_of(["", *columns], rows)


def _strides_csv(result: WalkResult) -> bytes:
    """Return the numbers of each whole stride as CSV; the start of a stride is the sample after its heel strike."""
    # The last strike begins a stride that the end of the walk cuts off: it has no numbers.
    count = result.strides["gas"].size
    columns = {"stride [-]": np.arange(1.0, count + 1.0), "start [s]": result.recording.time[result.starts[:count]]}
    return _csv(columns | {f"{name} [{quantity.unit}]": result.strides[name] for name, quantity in PER_STRIDE.items()})


def _mean_stride_csv(result: WalkResult) -> bytes:
    """Return mean and standard deviation over strides of each channel as CSV, at every percent of the stride."""
    # Without a whole stride the file has its head alone.
    columns = {"phase [-]": PHASES if result.averages else PHASES[:0]}
    for name, curves in result.averages.items():
        columns |= {f"{name} [{curves.unit}]": curves.mean, f"{name}_deviation [{curves.unit}]": curves.deviation}
    return _csv(columns)


def _csv(columns: Mapping[str, ask.Floats]) -> bytes:
    """Return simulated columns as CSV."""
    rows = (",".join(map(repr, row)) for row in zip(*(values.tolist() for values in columns.values()), strict=True))
    return "\n".join(["# simulated: a model's own output, not measured", ",".join(columns), *rows, ""]).encode()
