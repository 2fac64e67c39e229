"""Check of a kind of another package when it is loaded: its numbers, and a call of a control law.

A run would meet the same faults later and elsewhere, in a file of this package, or nowhere. The line of a fault names
file, line and function of the kind. What needs a device, as a valve, an actuator or an effect does, is tried with the
numbers of that device (``parameters.natural_laws``).
"""

import contextlib
import inspect
from itertools import product
from types import FunctionType
from typing import Any

from ppafo.control.kind import ControllerKind
from ppafo.engine.rows import is_row, leaf_paths, leaves, rebuilt
from ppafo.errors import KindError, UnitError
from ppafo.model.declaration import quantities_of
from ppafo.model.effects.kind import Effect, effect_problem
from ppafo.model.sensors import GaitMeasurement
from ppafo.model.valves.kind import VENT
from ppafo.units import base_value
from ppafo.wording import place

_MEASUREMENT = GaitMeasurement(1.4, 3.0e5, 2.0e5, 0.7, 100.0, 50.0)
_REFERENCES = (1.0, 4.0, -3.0, 2.5e5)
"""References at which a law is tried: it must be defined at one of them, as a root is not at all."""


def check_kind(kind: Any) -> None:
    """Check a component of another package; KindError with file and line for the first fault."""
    settings = getattr(kind, "settings", None) or getattr(kind, "parameters", None)
    # The parameters that a plan computes are not the settings.
    if settings is None or getattr(kind, "plan", None) is not None:
        return
    at_fault = settings
    try:
        for item in kind.quantities:
            default = item.minimum if item.default is None else item.default
            if not item.minimum <= default <= item.maximum:
                raise ValueError(
                    f"{item.name}: {item.minimum}, {default}, {item.maximum} must rise: its limits and default"
                )
            if base_value(1.0, str(item.unit)) != 1.0:
                raise ValueError(f"{item.name}: the unit {item.unit!r} is not SI")
        if not is_row(settings) or len(leaf_paths(settings, "")) != len(kind.quantities):
            declaration = "name: Annotated[float, Number(unit, summary, default, minimum, maximum)]"
            raise ValueError(f"must be a NamedTuple with each of its numbers declared, as {declaration}")
        fields = [item.name for item in quantities_of(settings)]
        named = [item.name for item in kind.quantities]
        if named != fields and sorted(named) == sorted(fields):
            raise ValueError(f"its fields are in the order {', '.join(fields)}, its quantities {', '.join(named)}")
        if isinstance(kind, Effect) and (problem := effect_problem(kind)):
            raise ValueError(problem)
        defaults = [item.default for item in kind.quantities]
        if isinstance(kind, ControllerKind) and None not in defaults:
            if not isinstance(kind.update, FunctionType):
                raise ValueError(f"update = {kind.update!r} must be a plain function defined with 'def'")
            at_fault = kind.update
            # A misspelt name is refused, with the nearest one, where the law is compiled.
            with contextlib.suppress(AttributeError, NameError):
                _check_law(kind, settings)
    except (ArithmeticError, AttributeError, TypeError, ValueError, UnitError) as error:
        where = ""
        with contextlib.suppress(OSError, TypeError):  # it is no class, or in no file
            where = f"{place(inspect.getfile(at_fault), inspect.getsourcelines(at_fault)[1])}: {at_fault.__name__}: "
        raise KindError(f"{where}{error}") from error


def _check_law(kind: ControllerKind, settings: type) -> None:
    """Check what a law returns for one sample. Raises ValueError unless it is a command and the next state.

    A default of 0 may be no number to divide by, so that the law is tried with numbers near 1 too.
    """
    ones = [min(max(1.0, item.minimum), item.maximum) for item in kind.quantities]
    defaults = [item.default or 0.0 for item in kind.quantities]
    for numbers, reference in product((defaults, ones), _REFERENCES):
        arguments = (rebuilt(settings, map(float, numbers)), kind.initial, reference, _MEASUREMENT, 1.0e-3)
        with contextlib.suppress(ArithmeticError, ValueError):
            command, after = kind.update(*arguments)
            break
    else:
        command, after = kind.update(*arguments)
    is_state = type(after) is type(kind.initial) and all(isinstance(number, float) for number in leaves(after))
    if not is_state or not isinstance(command, float) or not -1.0 <= command <= VENT:
        raise ValueError(
            "update(parameters, state, reference, measurement, period) must return a command from -1 to 1 or VENT, and "
            f"a state of floats, not {command!r} and {after!r}"
        )
