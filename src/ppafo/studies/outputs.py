"""What a study keeps of its runs, checked against what its scenarios have."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass

from ppafo.engine.lane_meters import TRACED
from ppafo.errors import StudyError, UnitError, first_twice, nearest_name
from ppafo.metrics import METRICS
from ppafo.simulation.ensemble.running import lacking
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import OPEN_LOOP
from ppafo.studies import declaration as declared
from ppafo.units import parse_quantity

Refusal = Callable[[object], StudyError]


@dataclass(frozen=True, slots=True)
class Outputs:
    """Metrics, channels kept for every run and as bands, time between two samples [s], quantiles from 0 to 1."""

    metrics: tuple[str, ...]
    trajectories: tuple[str, ...]
    bands: tuple[str, ...]
    every: float
    quantiles: tuple[float, ...]

    @property
    def traces(self) -> tuple[str, ...]:
        """Every channel that is needed over time, each once."""
        return tuple(dict.fromkeys((*self.trajectories, *self.bands)))


def valid_outputs(outputs: declared.Outputs, scenarios: Sequence[Scenario], refusal: Refusal) -> Outputs:
    """Return the outputs in SI units; an error that ``refusal`` makes for a name that does not exist."""
    metrics = tuple(METRICS) if outputs.metrics == "all" else tuple(outputs.metrics)
    _check_names("metrics", metrics, METRICS, refusal)
    _check_names("trajectories", outputs.trajectories, tuple(TRACED), refusal)
    _check_names("bands", outputs.bands, tuple(TRACED), refusal)
    if all(scenario.control.kind == OPEN_LOOP for scenario in scenarios):
        _check_no_reference((*outputs.trajectories, *outputs.bands), refusal)
    has = {name: [lacking(scenario, METRICS[name]) for scenario in scenarios] for name in metrics}
    missing = {name: reasons[0] for name, reasons in has.items() if all(reasons)}
    for name, reason in missing.items() if outputs.metrics != "all" else ():
        raise refusal(f"outputs: no scenario has '{name}': {reason}")
    metrics = tuple(name for name in metrics if name not in missing)
    return Outputs(
        metrics=metrics,
        trajectories=outputs.trajectories,
        bands=outputs.bands,
        every=_interval(outputs, scenarios, refusal),
        quantiles=tuple(sorted(set(outputs.quantiles))),
    )


def _check_names(key: str, given: Sequence[str], known: Collection[str], refusal: Refusal) -> None:
    for name in given:
        if name not in known:
            what = "metric" if key == "metrics" else "channel"
            hint = nearest_name(name, known)
            raise refusal(f"outputs.{key}: there is no {what} '{name}'{hint}; available: {', '.join(known)}")
    repeated = first_twice(given)
    if repeated is not None:
        raise refusal(f"outputs.{key}: '{repeated}' is named twice")


def _check_no_reference(channels: Sequence[str], refusal: Refusal) -> None:
    """Refuse the channel of a reference where no controller follows one."""
    if "reference" in channels:
        raise refusal("outputs: 'reference' needs a reference, and the controllers here follow none")


def _interval(outputs: declared.Outputs, scenarios: Sequence[Scenario], refusal: Refusal) -> float:
    try:
        every = parse_quantity(outputs.every, "s")
    except UnitError as error:
        raise refusal(f"outputs.every = {outputs.every!r}: {error}") from error
    if not (outputs.trajectories or outputs.bands):
        return every
    shortest = min(scenario.duration for scenario in scenarios)
    if not 0.0 < every <= shortest:
        raise refusal(
            f"outputs.every = {outputs.every!r} must be more than 0 s and at most run.duration, {shortest:g} s"
        )
    return every
