"""Times of a run: the step divides the sample period; recorded samples may lie between steps."""

from collections.abc import Mapping
from typing import Any

from ppafo.errors import ScenarioError
from ppafo.model.columns import Numeric, choose, larger, rounded_up, smaller, truncated
from ppafo.parameters.declared import value_at
from ppafo.parameters.graph import Graph, Link
from ppafo.parameters.overrides import read_overrides
from ppafo.simulation.declaration import PERIOD, RATE, RUN
from ppafo.simulation.document import DocumentReader
from ppafo.simulation.overrides import override_document
from ppafo.simulation.scenario import Scenario
from ppafo.units.shown import shown_text

MAXIMUM_STEPS = 1.0e9
"""Largest number of steps of a run."""
MAXIMUM_OUTPUTS = 5.0e6
# Measurements during a delay are stored, for each run of an ensemble.
MAXIMUM_STEPS_OF_DELAY = 1.0e5

# Up to this fraction times count as equal: decimal ones are seldom whole multiples of each other in binary.
_RELATIVE = 1.0e-9
_DURATION, _STEP, _OUTPUT = RUN
_LONGEST_STEP = 1.0e-3
_DURATION_PATH, _STEP_PATH, _OUTPUT_PATH = (f"run.{item.name}" for item in RUN)
RATE_PATH = "controller.rate"
PERIOD_PATH = "controller.period"
TIMES = (_DURATION_PATH, _STEP_PATH, _OUTPUT_PATH, RATE_PATH, PERIOD_PATH)
"""Paths that decide the clock of a run."""


def read_clock(reading: DocumentReader) -> tuple[float, float, float, float]:
    """Return duration, step, output interval and sample period of a run [s]; the step divides the sample period.

    Without an output interval every step is recorded, or nearly every one if the steps do not divide the duration.
    Raises ScenarioError for contradictory times, and for too many steps.
    """
    duration = reading.number(_DURATION_PATH, _DURATION)
    until = f"{_DURATION_PATH} = {reading.written(_DURATION_PATH)}"
    period, given = read_period(reading)
    if not given:
        raise ScenarioError(f"{reading.file}: '{RATE_PATH}' is missing: give for example rate = '1 kHz', or a period")
    has_output = value_at(reading.document, _OUTPUT_PATH) is not None
    if value_at(reading.document, _STEP_PATH) is not None:
        step = reading.number(_STEP_PATH, _STEP)
        _not_above(reading, _STEP_PATH, step, period, given)
        _not_above(reading, _STEP_PATH, step, duration, until)
    elif has_output:
        step = step_with_output(duration, period, reading.number(_OUTPUT_PATH, _OUTPUT))
    else:
        step = step_unless_given(duration, period)

    output = reading.number(_OUTPUT_PATH, _OUTPUT) if has_output else output_unless_given(duration, period, step)
    if has_output:
        if output < step * (1.0 - _RELATIVE):
            least = f"{_STEP_PATH} = {shown_text(step, 's', unit='s')}"
            raise reading.refusal(_OUTPUT_PATH, f"must not be below {least}; reduce the step or record less")
        _not_above(reading, _OUTPUT_PATH, output, duration, until)
        count = duration / output
        if abs(count - round(count)) > _RELATIVE * count:
            raise reading.refusal(_OUTPUT_PATH, f"must divide {until} evenly, not {count:.6g} times")
    used = dividing_step(period, step)
    if duration / used > MAXIMUM_STEPS:
        many = (
            f"the run has {duration / used:.3g} steps, at most {MAXIMUM_STEPS:.0e}: shorten it or increase {_STEP_PATH}"
        )
        raise reading.refusal(_DURATION_PATH, many)
    if duration / output > MAXIMUM_OUTPUTS:
        many = f"the run has {duration / output:.3g} samples, at most {MAXIMUM_OUTPUTS:.0e}: increase {_OUTPUT_PATH}"
        raise reading.refusal(_DURATION_PATH, many)
    return duration, used, output, period


def read_period(reading: DocumentReader, default: float = 0.0) -> tuple[float, str]:
    """Return the sample period of the controller [s], and how the document gives it; else the default and ""."""
    if value_at(reading.document, RATE_PATH) is not None:
        period = 1.0 / reading.number(RATE_PATH, RATE)
        return period, f"the period of {RATE_PATH} = {reading.written(RATE_PATH)} ({1.0e3 * period:.6g} ms)"
    if value_at(reading.document, PERIOD_PATH) is None:
        return default, ""
    return reading.number(PERIOD_PATH, PERIOD), f"{PERIOD_PATH} = {reading.written(PERIOD_PATH)}"


def links_of_times(document: Mapping[str, Any]) -> Graph:
    """Return the links of the step and the output interval to the other times, if the document does not give them."""
    step, output = (value_at(document, path) is not None for path in (_STEP_PATH, _OUTPUT_PATH))
    sources = (_DURATION_PATH, PERIOD_PATH)
    found = {}
    if not step:
        with_output = Link((*sources, _OUTPUT_PATH), step_with_output)
        found[_STEP_PATH] = (with_output if output else Link(sources, step_unless_given),)
    if not output:
        found[_OUTPUT_PATH] = (Link((*sources, _STEP_PATH), output_unless_given),)
    return found


def step_unless_given(duration: Numeric, period: Numeric) -> Numeric:
    """Default upper limit of the step [s]: the duration or the sample period of the controller, if shorter."""
    found: Numeric = smaller(smaller(duration, period), _LONGEST_STEP)
    return found


def step_with_output(duration: Numeric, period: Numeric, output_interval: Numeric) -> Numeric:
    """Default upper limit of the step [s] with a given output interval [s], which limits the step as well."""
    found: Numeric = smaller(step_unless_given(duration, period), output_interval)
    return found


def dividing_step(period: Numeric, step: Numeric) -> Numeric:
    """Largest step [s] that divides the sample period and does not exceed the given step."""
    # A quotient that rounding put above a whole number would make the step shorter than what is given.
    found: Numeric = period / larger(1.0, rounded_up(period / step * (1.0 - _RELATIVE)))
    return found


def output_unless_given(duration: Numeric, period: Numeric, step: Numeric) -> Numeric:
    """Default output interval [s]: every step, or nearly every step."""
    steps = duration / dividing_step(period, step)
    # The nearest integer; ties go to the even one.
    up = truncated(steps + 0.5)
    is_odd_tie = (up - steps == 0.5) & (0.5 * up != truncated(0.5 * up))
    found: Numeric = duration / larger(1.0, choose(is_odd_tie, up - 1.0, up))
    return found


def _not_above(reading: DocumentReader, path: str, value: float, limit: float, limit_text: str) -> None:
    if value > limit * (1.0 + _RELATIVE):
        raise reading.refusal(path, f"must not exceed {limit_text}")


def time_texts(base: Scenario) -> dict[str, dict[str, Any]]:
    """Return the times by section and name, as in the file, or as numbers if the scenario was changed after loading."""
    given = DocumentReader(base.name, base.origin.content, overrides=read_overrides(base.origin.overrides))
    document = override_document(given).document
    texts = {
        section: {name: value for name, value in document[section].items() if f"{section}.{name}" in TIMES}
        for section in ("run", "controller")
    }
    # The file speaks for the scenario only as long as nobody has changed its times in Python.
    own = base.run.duration, base.run.step, base.run.output_interval, base.controller.period
    if read_clock(DocumentReader(base.name, texts)) == own:
        return texts
    run = {name: f"{getattr(base.run, name)!r} s" for name in ("duration", "step", "output_interval")}
    return {"run": run, "controller": {"period": f"{base.controller.period!r} s"}}
