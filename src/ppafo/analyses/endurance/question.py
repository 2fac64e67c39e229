"""Public function ``bottle``: duration of a gas bottle."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ppafo.arguments import Duration, Flow, Mass, Overrides, Word, checked
from ppafo.plugins import Plugins, name_plugins

if TYPE_CHECKING:
    from ppafo.analyses.endurance.answer import Endurance, Endurances
    from ppafo.report.finding import Finding
    from ppafo.signals import Recording
    from ppafo.walking import WalkResult

GasUses = Annotated[
    "str | Path | Recording | WalkResult | Sequence[str | Path | Recording | WalkResult]",
    Word("RECORDING", Path, is_repeated=True),
]
BottleLike = Annotated[str | Path, Word("BOTTLE")]


@checked
def bottle(
    recordings: GasUses = (),
    *,
    gas_per_stride: Mass | None = None,
    stride_time: Duration | None = None,
    peak_flow: Flow | None = None,
    bottle: BottleLike | None = None,
    walk: Duration | None = None,
    rest: Duration | None = None,
    longest: Duration = 86400.0,
    overrides: Overrides = (),
    plugins: Plugins = (),
) -> Finding[Endurance] | Finding[Endurances]:
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
    >>> discharge = ppafo.bottle(gas_per_stride="0.3 g").found.discharge
    >>> print(f"{discharge.walking_time / 60.0:.1f} min: {discharge.ending.kind}")
    14.6 min: too cold
    """
    name_plugins(plugins)
    from dataclasses import replace

    from ppafo.analyses.endurance.answer import Endurances, finding_of, finding_of_several
    from ppafo.analyses.endurance.gas_demand import demand_of_numbers
    from ppafo.analyses.endurance.solve import (
        BETWEEN_RESTS,
        STRIDE_TIME,
        endurance_of_gas_use,
        follow_bottle,
        named_gas_uses,
    )
    from ppafo.arguments.reading import units_given
    from ppafo.errors import ParameterError
    from ppafo.parameters.bottles.bottle import PAPER_BOTTLE, load_bottle
    from ppafo.signals import Recording
    from ppafo.units.shown import shown_in, units_in_force
    from ppafo.walking import WalkResult
    from ppafo.walking.bottle.coupling import Schedule
    from ppafo.wording import argument_text

    gas_uses = (recordings,) if isinstance(recordings, str | Path | Recording | WalkResult) else tuple(recordings)
    if bool(gas_uses) == (gas_per_stride is not None):
        example = argument_text("gas_per_stride", "0.3 g")
        raise ParameterError(f"give either a recording or {argument_text('gas_per_stride')}, for example {example}")
    if walk is not None and rest is None:
        raise ParameterError(
            f"{argument_text('walk')} is the walking time between two rests; also give {argument_text('rest')}, "
            f"or use {argument_text('longest')} for the total time"
        )
    schedule = Schedule(BETWEEN_RESTS if walk is None else walk, rest or 0.0, longest)
    changes = tuple(overrides)
    if gas_per_stride is not None:
        units = units_given({"kg/s": peak_flow})
        with shown_in({**units_in_force(), **units}):
            draw = demand_of_numbers(gas_per_stride, STRIDE_TIME if stride_time is None else stride_time, peak_flow)
            full = load_bottle(PAPER_BOTTLE if bottle is None else bottle, changes)
            return finding_of(replace(follow_bottle(full, draw, schedule), device_units=units))
    if peak_flow is not None:
        raise ParameterError(
            f"{argument_text('peak_flow')} needs {argument_text('gas_per_stride')}; a recording already "
            "contains its largest flow"
        )
    endurances = {
        name: endurance_of_gas_use(name, use, stride_time, bottle, schedule, changes)
        for name, use in named_gas_uses(gas_uses).items()
    }
    return finding_of(*endurances.values()) if len(endurances) == 1 else finding_of_several(Endurances(endurances))
