"""Duration of a gas bottle for the gas use of numbers, of a recording or of a walk, and why it ends."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ppafo.arguments import Duration, Flow, Mass, Overrides, Word, checked
from ppafo.errors import ParameterError
from ppafo.plugins import Plugins
from ppafo.units.shown import shown_in, shown_text, units_in_force
from ppafo.wording import argument_text

if TYPE_CHECKING:
    from ppafo.analyses.endurance.discharge import Endurance
    from ppafo.report.finding import Finding
    from ppafo.signals import Recording
    from ppafo.walking import WalkResult

GasUses = Annotated[
    "str | Path | Recording | WalkResult | Sequence[str | Path | Recording | WalkResult]",
    Word("RECORDING", Path, is_repeated=True),
]
_STRIDE_TIME = 1.1
"""Default stride time [s]."""
# Default walking time between two rests, and shortest walking and simulated time [s].
_BETWEEN_RESTS = 600.0
_SHORTEST = 1.0
MAXIMUM_INTERVALS = 2000
"""Largest number of walking and resting intervals, which are integrated one by one."""


@checked
def bottle(
    recordings: GasUses = (),
    *,
    gas_per_stride: Mass | None = None,
    stride_time: Duration | None = None,
    peak_flow: Flow | None = None,
    bottle: Annotated[str | Path, Word("BOTTLE")] | None = None,
    walk: Duration | None = None,
    rest: Duration | None = None,
    longest: Duration = 24.0 * 3600.0,
    overrides: Overrides = (),
    plugins: Plugins = (),
) -> Finding[Endurance] | Finding[dict[str, Endurance]]:
    """Compute how long a bottle of gas lasts, and why it ends.

    A walk in ``recordings``, as a result or its folder, continues on the bottle until the bottle ends; any other
    recording is repeated. Without recordings, the gas use is ``gas_per_stride`` every ``stride_time``, with at most
    ``peak_flow``.

    Arguments:
        recordings: a .csv or .nc file with supplied_mass, or the result folder of a run or a walk; repeated until the
            bottle ends; several are compared side by side
        gas_per_stride: gas per stride, for example '0.3 g'
        stride_time: time of one stride; default: '1.1 s', the whole recording, or one stride of a walk
        peak_flow: largest flow, for example '4.5 g/s'; default: the mean flow
        bottle: name of a bottle or a .toml file; default: the walk's, or the paper's bottle
        walk: time of walking between two rests, with --rest; default '10 min'
        rest: time of each rest; default '0 s' (no rest)
        longest: maximum simulated time; default '1440 min'
        overrides: values to change, for example 'room.temperature=5 degC'; may be repeated
        plugins: modules of your own, files or names, whose objects files may name

    Returns:
        a Finding whose ``found`` is an Endurance, or the Endurance of each recording by name if there are several

    Raises:
        ParameterError: a bottle, a gas use or a schedule that cannot be used
        DataError: a recording that cannot be used
        SimulationError: a simulation of the bottle that fails

    >>> import ppafo
    >>> found = ppafo.bottle(gas_per_stride="0.3 g").found
    >>> print(f"{found.walking_time / 60.0:.1f} min: {found.ending}")
    14.6 min: too cold
    """
    from ppafo.analyses.endurance.discharge import (
        WALK_FILE,
        discharge,
        finding_of,
        of_recording,
        on_walk,
    )
    from ppafo.arguments.reading import units_given
    from ppafo.parameters.bottles.bottle import PAPER_BOTTLE, load_bottle
    from ppafo.parameters.overrides import read_overrides
    from ppafo.signals import Recording
    from ppafo.walking import WalkResult
    from ppafo.walking.bottle.coupling import Schedule

    uses = (recordings,) if isinstance(recordings, str | Path | Recording | WalkResult) else tuple(recordings)
    if bool(uses) == (gas_per_stride is not None):
        example = argument_text("gas_per_stride", "0.3 g")
        raise ParameterError(f"give either a recording or {argument_text('gas_per_stride')}, for example {example}")
    if walk is not None and rest is None:
        raise ParameterError(f"{argument_text('walk')}: also give {argument_text('rest')}, the time of each rest")
    schedule = Schedule(_BETWEEN_RESTS if walk is None else walk, rest or 0.0, longest)
    most = 0.5 * MAXIMUM_INTERVALS * (schedule.walk + schedule.rest) if rest else math.inf
    for name, value, largest in (("walk", schedule.walk, math.inf), ("longest", longest, most)):
        if not _SHORTEST <= value <= largest:
            limits = f"at least {_SHORTEST:g} s" + (
                f", at most {largest:g} s with such rests" if value > largest else ""
            )
            raise ParameterError(f"{argument_text(name)} = {value:g} s: must be {limits}")
    changes = tuple(overrides)
    chosen = PAPER_BOTTLE if bottle is None else bottle
    for override in (each for each in read_overrides(changes) if "gas" in each.typed.split(".")):
        raise ParameterError(f"override '{override}': the gas is that of the bottle; choose another bottle")
    if gas_per_stride is not None:
        time = _STRIDE_TIME if stride_time is None else stride_time
        units = units_given({"kg/s": peak_flow})
        if time <= 0.0:
            raise ParameterError(f"{argument_text('stride_time')} = {time:g} s: must be above 0 s")
        with shown_in({**units_in_force(), **units}):
            mean = gas_per_stride / time
            if peak_flow is not None and peak_flow < mean:
                least = shown_text(mean, "kg/s", ".4g")
                raise ParameterError(f"{argument_text('peak_flow')}: must be at least the mean flow, {least}")
            full = load_bottle(chosen, changes)
            found = discharge(full, gas_per_stride, time, mean if peak_flow is None else peak_flow, schedule)
        return finding_of({"": replace(found, shown={**found.shown, **units})})
    if peak_flow is not None:
        raise ParameterError(f"{argument_text('peak_flow')}: only with {argument_text('gas_per_stride')}")
    results: dict[str, Endurance] = {}
    for number, use in enumerate(uses):
        if any(use is other or (isinstance(use, str | Path) and str(use) == str(other)) for other in uses[:number]):
            raise ParameterError("the same recording is given twice; give each recording only once")
        name = (
            use.scenario.name if isinstance(use, WalkResult) else use.label if isinstance(use, Recording) else str(use)
        )
        if isinstance(use, Recording) or not (isinstance(use, WalkResult) or (Path(use) / WALK_FILE).is_file()):
            found = of_recording(use, stride_time, chosen, schedule, changes)
        elif stride_time is not None:
            raise ParameterError(f"{argument_text('stride_time')}: {name} repeats one stride of its walk; omit it")
        else:
            found = on_walk(use if isinstance(use, WalkResult) else Path(use), bottle, schedule, changes)
        # Walks of one scenario with other overrides have one name.
        alike = sum(other == name or other.startswith(f"{name} (") for other in results)
        results[f"{name} ({alike + 1})" if alike else name] = found
    return finding_of(results)
