"""Check of a kind of another package when it is loaded: its numbers, and one trial call of its functions.

A run would meet the same faults later and elsewhere, in a file of this package, or nowhere. The line of a fault names
file, line and function of the kind, with the declared arguments and values. What needs a device, such as the ports of a
valve, an actuator or an effect, is tried with the numbers of that device (``parameters.natural_laws``).
"""

import contextlib
import inspect
import math
from types import FunctionType
from typing import Any

from ppafo.control.kind import ControllerKind, ProfileKind
from ppafo.engine.rows import is_row, leaf_paths, leaves, rebuilt
from ppafo.errors import KindError, UnitError
from ppafo.model.effects.kind import Effect, effect_problem
from ppafo.model.sensors import GaitMeasurement
from ppafo.model.valves.kind import VENT, ValveKind, ValveModel
from ppafo.units import base_value
from ppafo.wording import place

_TRIAL: dict[str, Any] = {
    "measurement": GaitMeasurement(1.4, 3.0e5, 2.0e5, 0.7, 100.0, 50.0),
    "reference": 1.0,
    "requested": 1.0,
    "continues": 1.0,
    "command": 0.3,
    "opening": 0.3,
    "pressure_1": 3.0e5,
    "pressure_2": 2.0e5,
    "time": 0.1,
    "step": 1.0e-3,
    "period": 1.0e-3,
    "a float": (-math.inf, math.inf),
    "a time from 0": (0.0, math.inf),
    "a command from -1 to 1 or VENT": (-1.0, VENT),
    "the model": ValveModel,
    "an output": object,
}
"""Arguments by name, in SI units, and forms of values by phrase: the range of a float, or a class."""
_FUNCTIONS: dict[type, str] = {
    ControllerKind: """
        update parameters state reference measurement period: a command from -1 to 1 or VENT, the state
        restart? state requested continues: the state
    """,
    ProfileKind: """
        value parameters time: a float, a float, a float
        bounds parameters: a float, a float
        until_jump? parameters time: a time from 0
        period? parameters: a time from 0
    """,
    ValveKind: """
        choose parameters: the model
        lag? parameters: a time from 0
        regulation? parameters: a float, a float, a float
    """,
    ValveModel: """
        command_delay parameters: a time from 0
        prepare parameters: the parameters
        advance parameters state command time step: an output, the state
        next_event parameters state command time: a time from 0
        settle parameters state command time: the state
        shift? state state: a float
        rates? parameters state command: the state
        command_for? parameters opening pressure_1 pressure_2: a float
    """,
}
"""Functions of a declaration in the order of trials, ``?`` behind one that may be None: arguments, returned values."""


def check_kind(kind: Any) -> None:
    """Check a component of another package; KindError with file, line and function for the first fault."""
    settings = getattr(kind, "settings", None) or getattr(kind, "parameters", None)
    # The parameters that a plan computes are not the settings.
    if settings is None or getattr(kind, "plan", None) is not None:
        return
    try:
        with contextlib.suppress(StopIteration):
            _attempt(kind, settings)
    except (AttributeError, TypeError, ValueError, UnitError) as error:
        where = ""
        with contextlib.suppress(OSError, TypeError):  # it is no class, or in no file
            where = f"{place(inspect.getfile(settings), inspect.getsourcelines(settings)[1])}: {settings.__name__}: "
        raise KindError(f"{where}{error}") from error


def _attempt(kind: Any, settings: type) -> None:
    """Check the numbers of a kind, and call its functions at the defaults, if all numbers have one."""
    for item in kind.quantities:
        default = item.minimum if item.default is None else item.default
        if not item.minimum <= default <= item.maximum:
            raise ValueError(
                f"{item.name}: {item.minimum}, {default}, {item.maximum} must rise: minimum, default, maximum"
            )
        if base_value(1.0, str(item.unit)) != 1.0:
            raise ValueError(f"{item.name}: the unit {item.unit!r} is not SI")
    if not is_row(settings) or len(leaf_paths(settings, "")) != len(kind.quantities):
        declaration = "name: Annotated[float, Number(unit, summary, default, minimum, maximum)]"
        raise ValueError(f"must be a NamedTuple with each of its numbers declared, as {declaration}")
    if isinstance(kind, Effect) and (problem := effect_problem(kind)):
        raise ValueError(problem)
    state = getattr(kind, "initial", None)
    defaults = [item.default for item in kind.quantities]
    if None not in defaults:
        trial = {
            **_TRIAL,
            "parameters": rebuilt(settings, map(float, defaults)),
            "state": state,
            "the state": type(state),
        }
        _call_each(trial, kind)
        if isinstance(kind, ValveKind):
            model = trial["model"]
            trial |= {"state": model.state(), "the state": model.state, "the parameters": model.parameters}
            _call_each(trial, model)


def _call_each(trial: dict[str, Any], declaration: Any) -> None:
    """Call the functions of a declaration one after the other; what they return are arguments of the next."""
    for row in _FUNCTIONS.get(type(declaration), "").strip().splitlines():
        called, _, returned = row.strip().partition(": ")
        name, *arguments = called.replace("?", "").split()
        function = getattr(declaration, name)
        if function is None and "?" in called:
            continue
        declared = f"{name}({', '.join(arguments)}) must return {returned}"
        if not isinstance(function, FunctionType):
            raise ValueError(f"{declared}, as a plain function defined with 'def', not {function!r}")
        code = function.__code__
        line = code.co_firstlineno
        try:
            value = function(*map(trial.__getitem__, arguments))
        except (AttributeError, NameError) as error:
            # Where the function is compiled it is refused with the nearest name.
            raise StopIteration from error
        except Exception as error:  # whatever a function of another package raises
            inside = error.__traceback__ and error.__traceback__.tb_next
            line = inside.tb_lineno if inside else line
            problem = f"raises {type(error).__name__}: {error}"
            raise KindError(f"{place(code.co_filename, line)}: {declared}, but {problem}") from error
        phrases = returned.split(", ")
        values = value if isinstance(value, tuple) and len(phrases) > 1 else (value,)
        if len(values) != len(phrases) or not all(map(_is_form, values, map(trial.__getitem__, phrases))):
            raise KindError(f"{place(code.co_filename, line)}: {declared}, not {value!r}")
        trial |= {phrase.split()[-1]: item for item, phrase in zip(values, phrases, strict=True)}


def _is_form(value: Any, form: Any) -> bool:
    """Return whether a value is a float in a range, a NamedTuple of floats, or an object of a class."""
    if isinstance(form, tuple):
        return isinstance(value, float) and form[0] <= value <= form[1]
    numbers = leaves(value) if is_row(type(value)) else []
    return isinstance(value, form) and all(isinstance(number, float) for number in numbers)
