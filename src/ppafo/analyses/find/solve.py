"""Search for the lowest or highest value that meets a condition on a metric: grid, then bisection."""

import contextlib
import math
import re
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ppafo.errors import ParameterError, ScenarioError, StudyError, UnitError, at_fault, refused_as
from ppafo.metrics import METRICS
from ppafo.progress import Report
from ppafo.remedy_trials import tried
from ppafo.running import simulate
from ppafo.simulation.declaration import changes_reach
from ppafo.simulation.ensemble.running import lacking
from ppafo.simulation.gains import remark_on_following_gains
from ppafo.simulation.numbers import NOISE_SEED, declared_numbers
from ppafo.simulation.scenario import Scenario
from ppafo.simulation.simulate import Result
from ppafo.simulation.tracking import Tracking
from ppafo.simulation.tracking.remarks import standing_still
from ppafo.simulation.tracking.remedies import change_text
from ppafo.simulation.tracking.rule import CRITERION_TEXTS
from ppafo.simulation.tracking.shortfall import shortfall
from ppafo.studies.distributions import Floats
from ppafo.studies.draws import seeds_of_noise
from ppafo.studies.limits import MetricLimit, atmosphere_of, check_metrics, level_of
from ppafo.studies.study import with_overrides
from ppafo.studies.varying import VariedPath, given_in, varied_path
from ppafo.study.runs import RunCounter, Runs, excess, scenario_runs, settled, with_companions
from ppafo.units import SI, split_quantity
from ppafo.wording import one_line

FEWEST, MOST = 3, 100_000
"""Range of the number of grid values: both ends and one between, up to the maximum."""
_PARTS = 32
"""Number of parts into which a bracket is divided: this many parallel runs take little longer than one run."""
_STREAMS = 16
"""Number of noise streams for every value if sensors are noisy, the same for all values."""
ACCURACY = 1.0e-6
"""Width of the last bracket, as a fraction of the range of values [-]."""
_SEED = 1
"""Random seed of the noise streams."""
_RANGE = re.compile(r"\s*([^=\s]+)\s*=\s*(.+?)\s*\.\.\s*(.+?)\s*")
FOLLOWS = "follows"
"""Text of the condition that the run follows its reference, by the verdict of ``simulate``, within the reach."""
_CONDITION = re.compile(r"\s*([\w.:]+)\s*(<=|>=)\s*(.+?)\s*")


def range_of(text: str, base: Scenario) -> tuple[VariedPath, float, float]:
    """Return path, lower and upper bound [SI] of a text ``PATH=LOW..HIGH``; StudyError for any other text."""
    parts = _RANGE.fullmatch(text)
    if parts is None:
        raise StudyError(
            f"'{one_line(text)}' is not of the form PATH=LOW..HIGH, for example 'supply.pressure=20..90 psi_g'"
        )
    name, lower, upper = parts.groups()
    with refused_as(StudyError, f"'{one_line(text)}'", ScenarioError, UnitError):
        path = varied_path(name, base)
        # As in '20..90 psi_g': the low end has the unit of the high one unless it says its own.
        unit = split_quantity(upper)[1]
        if not split_quantity(lower)[1]:
            lower = f"{lower} {unit}".rstrip()
        low, high = path.level(lower), path.level(upper)
        path = given_in(path, [upper])
    if not low < high:
        raise StudyError(f"'{one_line(text)}': the lower end must be below the upper end")
    return path, low, high


def condition_of(text: str, base: Scenario, path: str) -> MetricLimit:
    """Return the condition of a text ``METRIC <= LIMIT``, ``METRIC >= LIMIT`` or ``follows``; StudyError for others.

    Gauge pressures refer to the ambient pressure of the scenario, unless ``path``, the varied number, is this pressure.
    """
    quoted = f"'{one_line(text)}'"
    if text.strip() == FOLLOWS:
        # Every value that is found follows its reference; of two that do not, the error says which is nearer.
        tracked = (f"rms_{base.controlled}_error", "rms_error", "torque_error", "peak_torque")
        errors = [name for name in tracked if name in METRICS and not lacking(base, METRICS[name])]
        if base.controller.is_open_loop or not errors:
            raise StudyError(
                f"{quoted} needs a reference, which scenario '{base.name}' lacks; give a condition such as "
                "'METRIC <= LIMIT'"
            )
        return MetricLimit(errors[0], math.inf, True, FOLLOWS)
    parts = _CONDITION.fullmatch(text)
    if parts is None:
        raise StudyError(
            f"{quoted} must be METRIC <= LIMIT or METRIC >= LIMIT, for example 'final_error <= 0.3 N m', "
            f"or '{FOLLOWS}' (the run follows its reference)"
        )
    metric, sign, limit = parts.groups()
    check_metrics([metric], base)
    level = level_of(limit, metric, quoted, atmosphere_of(base, [path]))
    return MetricLimit(metric, level, sign == "<=", f"{metric} {sign} {limit}")


TRIED = np.dtype(
    [
        *((name, np.float64) for name in ("value", "metric", "judged", "spread", "excess")),
        *((name, np.bool_) for name in ("follows", "is_of_grid")),
        *((name, np.intp) for name in ("unsettled", "oscillating")),
    ]
)
"""Row of a tried value [SI] with its metric [SI], nan if the run failed, and the ``spread`` over the noise streams.

``judged``: number compared with the limit: the metric, or the RMS error in the second half of the hold if that is
    larger and the value swings there; nan if the loop oscillates throughout
``excess``: tracking error divided by its limit [-], the largest over the streams; up to 1 the reference is followed
``follows``: True if the reference is followed in all streams
``is_of_grid``: True for values of the initial grid, False for values of a bracket
``unsettled``, ``oscillating``: number of runs that swing in the second half of the hold, and oscillate throughout
"""


@dataclass(frozen=True, slots=True)
class FindResult:
    """Search result: tried values, ascending, as a structured array of ``TRIED``, and the counted ``runs``.

    ``remarks`` are on gains that follow the varied number, and on values kept from another kind or set. ``verdicts``
    are values [SI] with the verdict of a run of their own: for the condition that the run follows, and for a loop that
    fails at the nearest value. ``refusal`` is the reason why the outer neighbour of the value found is no valid value,
    and the path of the number that allows it; "" for a valid neighbour.
    """

    scenario: str
    path: VariedPath
    condition: MetricLimit
    highest: bool
    noise_streams: int
    runs: Runs
    tried: NDArray[np.void]
    remarks: tuple[str, ...] = ()
    verdicts: tuple[tuple[float, str], ...] = ()
    refusal: tuple[str, str] = ("", "")

    @property
    def is_met(self) -> NDArray[np.bool_]:
        """Mask of the values that meet the condition and whose runs follow the reference."""
        return np.asarray(self.condition.is_kept(self.tried["judged"]) & self.tried["follows"])

    @property
    def found(self) -> tuple[int | None, float | None]:
        """Index of the outermost value that meets the condition, and its outer neighbour [SI]; None if missing."""
        met = np.flatnonzero(self.is_met)
        if met.size == 0:
            return None, None
        index = int(met[-1] if self.highest else met[0])
        outer = index + (1 if self.highest else -1)
        return index, float(self.tried["value"][outer]) if 0 <= outer < self.tried.size else None

    @property
    def nearest(self) -> float:
        """Tried value [SI] that is nearest to the condition."""
        choose = np.nanargmin if self.condition.is_most else np.nanargmax
        return float(self.tried["value"][choose(self.tried["judged"])])

    @property
    def met_intervals(self) -> list[list[float]]:
        """First and last value of each interval of consecutive values that meet the condition."""
        # False beyond both ends, where an interval that reaches the end of the range ends.
        padded = np.concatenate([[False], self.is_met, [False]]).astype(int)
        first, after = np.flatnonzero(np.diff(padded) > 0), np.flatnonzero(np.diff(padded) < 0)
        values = self.tried["value"].tolist()
        return [[values[low], values[high - 1]] for low, high in zip(first, after, strict=True)]

    def with_values(self, base: Scenario, values: Floats, seeds: Floats, is_of_grid: bool) -> "FindResult":
        """Try values, each with all noise streams, and return them merged with the values tried before."""
        metric, shape = self.condition.metric, (max(1, seeds.size), values.size)
        columns = {self.path.path: np.tile(values, shape[0])}
        if seeds.size:
            columns[NOISE_SEED] = np.repeat(seeds, values.size)
        rows = self.runs.run(columns)
        # One instant of a value that swings may meet the condition by chance.
        judged = settled(rows, metric)
        verdicts = excess(rows, base, columns)
        oscillates = verdicts.oscillates == 1.0
        # A run without a verdict is none that follows.
        fails = verdicts.follows != 1.0
        if self.condition.text == FOLLOWS:
            # A torque just beyond the actuator's is missed by no more than is allowed, but it is not reached.
            fails |= (verdicts.beyond_reach > 0.0) & changes_reach(columns)
        else:
            fails = (verdicts.follows == 0.0) & ~verdicts.excused
        # A loop whose command turns all the time meets no condition that anybody would build on.
        usable = np.where(oscillates, np.nan, judged)
        tried = np.empty(values.size, TRIED)
        tried["value"], tried["is_of_grid"] = values, is_of_grid
        tried["metric"] = rows[metric].reshape(shape).mean(axis=0)
        tried["judged"] = usable.reshape(shape).mean(axis=0)
        tried["spread"] = rows[metric].reshape(shape).std(axis=0, ddof=min(1, shape[0] - 1))
        tried["unsettled"] = (judged > rows[metric]).reshape(shape).sum(axis=0)
        tried["oscillating"] = oscillates.reshape(shape).sum(axis=0)
        tried["excess"] = verdicts.largest.reshape(shape).max(axis=0)
        tried["follows"] = ~fails.reshape(shape).any(axis=0)
        merged = np.concatenate([self.tried, tried])
        return replace(self, tried=merged[np.argsort(merged["value"], kind="stable")])


def outermost(
    base: Scenario,
    vary: str,
    such_that: str,
    highest: bool,
    grid: int,
    threads: int | None = None,
    progress: Report | None = None,
) -> FindResult:
    """Search for the lowest or highest value that meets a condition.

    ``vary`` is ``PATH=LOW..HIGH`` and ``such_that`` is ``METRIC <= LIMIT``, ``METRIC >= LIMIT`` or ``follows``.
    ``highest`` selects the highest value instead of the lowest; ``grid`` is the number of values tried first.

    Raises StudyError for invalid input, and if no run has the metric.
    """
    with at_fault("vary"):
        path, low, high = range_of(vary, base)
    with at_fault("such_that"):
        condition = condition_of(such_that, base, path.path)
    if not FEWEST <= grid <= MOST:
        raise StudyError(f"grid = {grid}: must be at least {FEWEST} and at most {MOST:,}")
    # The same streams for all values, so that neighbours differ by the value alone.
    seeds = seeds_of_noise([base], [path.path], _STREAMS, _SEED)
    counter = RunCounter(grid * max(1, seeds.size), progress)
    runs = scenario_runs(base, with_companions([condition.metric], base), counter, (), threads)
    remarks = (remark_on_following_gains(base, [path.path]), base.origin.replaced)
    search = FindResult(base.name, path, condition, highest, seeds.size, runs, np.empty(0, TRIED), remarks)
    search = search.with_values(base, np.linspace(low, high, grid), seeds, True)
    if not np.isfinite(search.tried["judged"]).any():
        ends = f"from {path.quote(low)} to {path.quote(high)}"
        if search.tried["oscillating"].any():
            _, verdict = _judged(base, path, low)
            said = f"; at {path.quote(low)} {verdict.sentence}" if verdict.fails else ""
            raise StudyError(f"scenario '{base.name}': the loop oscillates in every run {ends}{said}")
        reason = f"; the first: {runs.reason}" if runs.reason else ""
        raise StudyError(f"scenario '{base.name}': no run {ends} gives the metric '{condition.metric}'{reason}")
    # The runs of a bracket are simulated side by side, which is faster than one run at a time by bisection.
    index, neighbour = search.found
    while index is not None and neighbour is not None:
        value = float(search.tried["value"][index])
        if abs(value - neighbour) <= ACCURACY * (high - low):
            break
        search = search.with_values(base, np.linspace(value, neighbour, _PARTS + 1)[1:-1], seeds, False)
        index, neighbour = search.found
    if neighbour is not None:
        search = replace(search, refusal=_refusal(base, path, neighbour, high if highest else low))
    # With noise a single run does not represent the mean over the noise streams.
    if seeds.size:
        return search
    values: list[float] = []
    if index is None:
        # A loop that fails even at the nearest value is why no value meets the condition.
        near = search.nearest
        values = [] if search.tried["follows"][search.tried["value"] == near].all() else [near]
    elif condition.text == FOLLOWS:
        # The value found and its outer neighbour.
        outer = [] if neighbour is None or any(search.refusal) else [neighbour]
        values = [float(search.tried["value"][index]), *outer]
    return replace(search, verdicts=tuple((value, _verdict(base, path, value)) for value in values))


def _judged(base: Scenario, path: VariedPath, value: float) -> tuple[Result, Tracking]:
    """Return the run at a value [SI], and the verdict with its tried remedy."""
    # Given in the unit of the range, the value and what is said of it are in that unit.
    result = simulate(with_overrides(base, [f"{path.path}={path.quote(value, '.17g')}"]))
    # The remedy that succeeds decides between possible causes.
    return result, tried(result.scenario, result.tracking)


def _verdict(base: Scenario, path: VariedPath, value: float) -> str:
    """Return the verdict on the run at a value [SI], a torque beyond the actuator's included."""
    result, tracking = _judged(base, path, value)
    said = "; ".join(filter(None, (tracking.found, tracking.cause))) if tracking.fails else tracking.said
    lacking = float(np.max(shortfall(result.scenario)))
    if not tracking.fails and lacking > 0.0 and changes_reach([path.path]):
        said = f"{CRITERION_TEXTS['reach']} {change_text(result.scenario.controlled, lacking)}"
    return "; ".join(filter(None, (said, standing_still(result, not tracking.fails))))


def _refusal(base: Scenario, path: VariedPath, value: float, end: float) -> tuple[str, str]:
    """Reason why a value [SI] is refused, and path of the number that must be raised or lowered to ``end`` [SI] too."""
    try:
        with_overrides(base, [f"{path.path}={value!r} {SI}"])
    except (ParameterError, ScenarioError) as error:
        for other, quantity in declared_numbers(base).items():
            # Only a number that limits this one makes the end of the range valid.
            if other != path.path and quantity.unit == path.quantity.unit:
                with contextlib.suppress(ParameterError, ScenarioError):
                    with_overrides(base, [f"{each}={end!r} {SI}" for each in (path.path, other)])
                    return str(error), other
        return str(error), ""
    return "", ""
