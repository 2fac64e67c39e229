"""Times of a run: one step that divides the sample period, the output interval and the duration."""

import math
from dataclasses import dataclass
from fractions import Fraction

from ppafo.errors import ScenarioError
from ppafo.simulation.declaration import PERIOD, RATE, RUN, value_at
from ppafo.simulation.reading import Reading, written

MOST_STEPS = 1.0e8
MOST_OUTPUTS = 5.0e6
MOST_STEPS_OF_DELAY = 1.0e5
SMALLEST_SHARE = 1.0e-3
"""The step is not made smaller than this share of the one asked for just to make times fit each other."""

_LARGEST_DENOMINATOR = 10**8
_RELATIVE = 1.0e-9
_DURATION, _STEP, _OUTPUT = RUN
_DURATION_PATH, _STEP_PATH, _OUTPUT_PATH = (f"run.{item.name}" for item in RUN)
_RATE_PATH, _PERIOD_PATH = "controller.rate", "controller.period"


@dataclass(frozen=True, slots=True)
class Clock:
    """Duration, step, output interval and sample period [s]; the step divides the others."""

    duration: float
    step: float
    output_interval: float
    period: float


def read_clock(reading: Reading) -> Clock:
    """Return the times of a run; the step is the largest one that divides the others and is not above what is asked."""
    duration = reading.number(_DURATION_PATH, _DURATION)
    period_path, period = _read_period(reading)
    step = _read_step(reading, duration, period_path, period)
    output = _read_output(reading, duration, step)
    times = {period_path: period, _DURATION_PATH: duration} | ({} if output is None else {_OUTPUT_PATH: output})
    used = _step_that_fits(reading, step, times)
    clock = Clock(duration, used, used if output is None else output, period)
    _check_size(reading, clock)
    return clock


def _check_size(reading: Reading, clock: Clock) -> None:
    duration, used, output = clock.duration, clock.step, clock.output_interval
    if duration / used > MOST_STEPS:
        raise reading.refusal(
            _DURATION_PATH,
            f"with a step of {written(used, 's')} the run has {duration / used:.3g} steps, at most {MOST_STEPS:.0e} "
            f"are allowed: shorten the run or take a larger {_STEP_PATH}",
        )
    if duration / output > MOST_OUTPUTS:
        raise reading.refusal(
            _DURATION_PATH,
            f"recorded every {written(output, 's')} the run has {duration / output:.3g} samples, at most "
            f"{MOST_OUTPUTS:.0e} are allowed: take a larger {_OUTPUT_PATH}",
        )


def _read_period(reading: Reading) -> tuple[str, float]:
    """Return the sample period and the path that gave it."""
    rate, period = (value_at(reading.document, path) for path in (_RATE_PATH, _PERIOD_PATH))
    if rate is not None and period is not None:
        raise reading.refusal(_RATE_PATH, f"give either {_RATE_PATH} or {_PERIOD_PATH}, not both")
    if rate is not None:
        return _RATE_PATH, 1.0 / reading.number(_RATE_PATH, RATE)
    if period is not None:
        return _PERIOD_PATH, reading.number(_PERIOD_PATH, PERIOD)
    raise ScenarioError(f"{reading.file}: '{_RATE_PATH}' is missing: give for example rate = '1 kHz', or a period")


def _read_step(reading: Reading, duration: float, period_path: str, period: float) -> float:
    if value_at(reading.document, _STEP_PATH) is None:
        output = value_at(reading.document, _OUTPUT_PATH)
        shortest = min(duration, period, _STEP.default or duration)
        return shortest if output is None else min(shortest, reading.number(_OUTPUT_PATH, _OUTPUT))
    step = reading.number(_STEP_PATH, _STEP)
    _not_above(reading, _STEP_PATH, step, period_path, period)
    _not_above(reading, _STEP_PATH, step, _DURATION_PATH, duration)
    return step


def _read_output(reading: Reading, duration: float, step: float) -> float | None:
    """Return the time between two recorded samples, None where every step is to be recorded."""
    if value_at(reading.document, _OUTPUT_PATH) is None:
        return None
    output = reading.number(_OUTPUT_PATH, _OUTPUT)
    if output < step * (1.0 - _RELATIVE):
        raise reading.refusal(
            _OUTPUT_PATH,
            f"must not be below {_STEP_PATH} = {written(step, 's')}; take a smaller step or record less often",
        )
    _not_above(reading, _OUTPUT_PATH, output, _DURATION_PATH, duration)
    count = duration / output
    if abs(count - round(count)) > _RELATIVE * count:
        raise reading.refusal(
            _OUTPUT_PATH, f"must divide {_DURATION_PATH} = {written(duration, 's')}, it fits {count:.6g} times"
        )
    return output


def _not_above(reading: Reading, path: str, value: float, limit_path: str, limit: float) -> None:
    if value > limit * (1.0 + _RELATIVE):
        raise reading.refusal(path, f"must not be above {written(limit, 's')}, which {limit_path} gives")


def _step_that_fits(reading: Reading, step: float, times: dict[str, float]) -> float:
    """Return the largest step [s], at most ``step``, of which all times are whole multiples."""
    shares = [_exact(time) for time in times.values()]
    common = shares[0]
    for share in shares[1:]:
        common = _common_divisor(common, share)
    parts = math.ceil(float(common) / step * (1.0 - _RELATIVE))
    used = float(common / max(1, parts))
    if used < SMALLEST_SHARE * step or not _all_whole(used, times):
        said = ", ".join(f"{path} ({written(time, 's')})" for path, time in times.items())
        raise ScenarioError(
            f"{reading.file}: no step near {_STEP_PATH} = {written(step, 's')} divides all of {said}; choose them as "
            f"whole multiples of the step"
        )
    return used


def _exact(time: float) -> Fraction:
    """Return the simple fraction that a time was meant to be, so that 0.1 is a tenth and 1 / 30 a thirtieth."""
    return Fraction(time).limit_denominator(_LARGEST_DENOMINATOR)


def _common_divisor(first: Fraction, second: Fraction) -> Fraction:
    denominator = first.denominator * second.denominator
    numerator = math.gcd(first.numerator * second.denominator, second.numerator * first.denominator)
    return Fraction(numerator, denominator)


def _all_whole(step: float, times: dict[str, float]) -> bool:
    counts = [time / step for time in times.values()] if step > 0.0 else [0.5]
    return all(abs(count - round(count)) <= 1.0e-6 for count in counts)
