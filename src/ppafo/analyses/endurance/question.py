"""Arguments of the analysis ``bottle``: duration of a gas bottle."""

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

    A walk, its result or its folder, walks on the bottle until that ends it. Any other gas use is in
    ``recordings``, or else ``gas_per_stride`` every ``stride_time`` with at most ``peak_flow``. ``overrides`` are texts
    such as ``room.temperature=5 degC``. ParameterError or DataError for bad input, SimulationError where the solver
    fails.

    recordings: a .csv or .nc file with supplied_mass, or the result folder of a run or a walk; repeated until the
        bottle ends; several are compared side by side
    gas_per_stride: gas per stride, for example '0.3 g'
    stride_time: time of one stride; default: '1.1 s', the whole recording, one stride of a walk, or its task sequence
    peak_flow: largest flow, for example '4.5 g/s'; default: the mean flow
    bottle: name of a bottle or a .toml file; default: the walk's, or the paper's bottle
    walk: time of walking between two rests, with --rest; default '10 min'
    rest: time of each rest; default '0 s' (no rest)
    longest: maximum simulated time; default '1440 min'
    plugins: modules of your own, files or names, whose objects files may name

    >>> import ppafo
    >>> discharge = ppafo.bottle(gas_per_stride="0.3 g").found.discharge
    >>> print(f"{discharge.walking_time / 60.0:.1f} min: {discharge.ending.kind}")
    14.6 min: too cold
    """
    name_plugins(plugins)
    from dataclasses import replace

    from ppafo.analyses.endurance.answer import Endurances, finding_of, finding_of_several
    from ppafo.analyses.endurance.gas_demand import demand_of_numbers, demand_of_recording
    from ppafo.analyses.endurance.solve import BETWEEN_RESTS, STRIDE_TIME, endurance_of_walk_gas, follow_bottle
    from ppafo.analyses.endurance.walk_gas import WALK_FILE, read_walk_gas, walk_gas
    from ppafo.arguments.door import argument_text
    from ppafo.arguments.reading import units_given
    from ppafo.errors import ParameterError
    from ppafo.parameters.bottles.bottle import PAPER_BOTTLE, load_bottle
    from ppafo.report.stored_figure import stated_units
    from ppafo.signals import Recording
    from ppafo.storage.result_folder import RUN_FILE, read_json, read_recording
    from ppafo.units.shown import shown_in, units_in_force
    from ppafo.walking import WalkResult
    from ppafo.walking.bottle.coupling import Schedule

    given = (recordings,) if isinstance(recordings, str | Path | Recording | WalkResult) else tuple(recordings)
    if bool(given) == (gas_per_stride is not None):
        example = argument_text("gas_per_stride", "0.3 g")
        raise ParameterError(f"give either a recording or {argument_text('gas_per_stride')}, for example {example}")
    if walk is not None and rest is None:
        raise ParameterError(
            f"{argument_text('walk')} is the walking time between two rests: give {argument_text('rest')} too, or "
            f"{argument_text('longest')} for the total time"
        )
    schedule = Schedule(BETWEEN_RESTS if walk is None else walk, rest or 0.0, longest)
    named, changed = PAPER_BOTTLE if bottle is None else bottle, tuple(overrides)
    if gas_per_stride is not None:
        units = units_given({"kg/s": peak_flow})
        with shown_in({**units_in_force(), **units}):
            draw = demand_of_numbers(gas_per_stride, STRIDE_TIME if stride_time is None else stride_time, peak_flow)
        emptied = follow_bottle(load_bottle(named, changed), draw, schedule)
        return finding_of(replace(emptied, device_units=units))
    if peak_flow is not None:
        raise ParameterError(
            f"{argument_text('peak_flow')} belongs to {argument_text('gas_per_stride')}; a recording has its own "
            "largest flow"
        )
    uses: dict[str, str | Path | Recording | WalkResult] = {}
    for use in given:
        if any(use is other or (isinstance(use, str | Path) and str(use) == str(other)) for other in uses.values()):
            raise ParameterError("the same recording is given twice")
        label = (
            use.label if isinstance(use, Recording) else use.scenario.name if isinstance(use, WalkResult) else str(use)
        )
        # Walks of one scenario with other overrides have one name.
        alike = sum(name == label or name.startswith(f"{label} (") for name in uses)
        uses[f"{label} ({alike + 1})" if alike else label] = use
    found = {}
    for name, use in uses.items():
        gas = walk_gas(use) if isinstance(use, WalkResult) else None
        # The folder that a walk of one wearer was written into.
        if isinstance(use, str | Path) and (Path(use) / WALK_FILE).is_file():
            gas = read_walk_gas(Path(use))
        if gas is None:
            full = load_bottle(named, changed)
            recording = use if isinstance(use, Recording) else read_recording(Path(str(use)))
            life = follow_bottle(full, demand_of_recording(recording, stride_time), schedule)
            run = Path(str(use)) / RUN_FILE
            units = stated_units(run, read_json(run)) if not isinstance(use, Recording) and run.is_file() else {}
            # Whoever says how long a stride takes recorded strides; else the recording is what repeats.
            found[name] = replace(life, is_of_recording=stride_time is None, device_units=units)
            continue
        if stride_time is not None:
            stride = f"its whole task sequence '{gas.task_sequence}'" if gas.task_sequence else "one stride of its walk"
            given_time = argument_text("stride_time")
            raise ParameterError(f"{given_time}: a stride of {name} is {stride}; omit {given_time}")
        found[name] = endurance_of_walk_gas(gas, bottle, schedule, changed)
    return finding_of(*found.values()) if len(found) == 1 else finding_of_several(Endurances(found))
