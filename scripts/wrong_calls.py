"""Calls of the public functions with values that no argument takes: which are accepted, and which errors name it not.

    python scripts/wrong_calls.py                 3,075 of 4,500 calls, drawn with seed 1
    python scripts/wrong_calls.py --calls 300     fewer of them
    python scripts/wrong_calls.py --show          each accepted call, and each error that does not name the argument

Every function is called with arguments that are right, one of them replaced. What each argument takes is declared here,
and not read from the package.
"""

import argparse
import contextlib
import os
import random
import re
import signal
import sys
import tempfile
import warnings
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from datetime import timedelta
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pint
import xarray

import ppafo
from ppafo.wording import one_line

SEED, CALLS, SECONDS, LONGEST = 1, 3075, 20, 2000
TASK, SET, STUDY, WALK = "torque-task-proportional", "ppafo2011", "torque-task-uncertainty", "solenoid"


def _raising(*names: str, base: type = object) -> Any:
    """Return an object that raises where it is asked for one of these methods."""

    def raising(*_: object, **__: object) -> Any:
        raise RuntimeError("first line\nsecond \x1b[31mred" + "d" * 3000)

    return type("Raising\n", (base,), {name: raising for name in names})()


WRONG: Mapping[str, Callable[[], Any]] = {
    "None": lambda: None,
    "True": lambda: True,
    "False": lambda: False,
    "zero": lambda: 0,
    "minus one": lambda: -1,
    "huge": lambda: 2**200,
    "one and a half": lambda: 1.5,
    "nan": lambda: float("nan"),
    "infinity": lambda: float("inf"),
    "minus a million": lambda: -1e6,
    "complex": lambda: 1j,
    "empty text": lambda: "",
    "blank": lambda: "  ",
    "no such name": lambda: "no-such-thing",
    "'False'": lambda: "False",
    "'-3'": lambda: "-3",
    "'nan'": lambda: "nan",
    "wrong unit": lambda: "3 furlongs",
    "zero byte": lambda: "a\0b",
    "bytes": lambda: b"bytes",
    "no such file": lambda: Path("no-such-file.toml"),
    "list of None": lambda: [None],
    "list of numbers": lambda: [1, 2.5],
    "list of an empty text": lambda: [""],
    "list of lists": lambda: [["a"]],
    "dictionary of None": lambda: {"no.path": None},
    "dictionary by number": lambda: {1: 2},
    "object": object,
    "array": lambda: np.array([1.0, 2.0]),
    "text array": lambda: np.array(["a"]),
    "NumPy minus one": lambda: np.int64(-1),
    "NumPy nan": lambda: np.float64("nan"),
    "set of numbers": lambda: {1},
    "generator of None": lambda: (each for each in [None]),
    "class": lambda: int,
    "ellipsis": lambda: ...,
    "time difference": lambda: timedelta(seconds=1),
    "raises when asked for an attribute": lambda: _raising("__getattr__"),
    "raises when iterated": lambda: _raising("__iter__", "__len__", "__repr__"),
    "raises when made an array": lambda: _raising("__array__", "__float__", "__fspath__"),
    "dictionary that raises": lambda: _raising("__getitem__", "items", "__iter__", "__repr__", base=dict),
    "300 letters": lambda: "x" * 300,
    "100,000 letters": lambda: "x" * 100_000,
    "escape codes": lambda: "a\n\x1b[31mb.c=1",
    "array with a unit": lambda: xarray.DataArray(1.0, attrs={"units": "furlong"}),
    "quantity of pint": lambda: pint.UnitRegistry().Quantity(1.0, "kelvin/mole"),
}
"""Values by what a list calls them; made anew for each call, as a generator can be gone through once."""

_NUMBERS = ("zero", "huge", "one and a half", "minus one", "minus a million", "NumPy minus one")
RIGHT: Mapping[str, tuple[str, ...]] = {
    "object": (),
    "name": (),
    "names": (),
    "overrides": (),
    "flag": ("True", "False"),
    "seed": ("zero",),
    "count": (),
    "fraction": ("zero",),
    "number": _NUMBERS,
    "positive": ("one and a half", "huge"),
    "from zero": ("zero", "one and a half", "huge"),
    "function": ("class",),
    "path": ("no such name", "no such file", "'False'", "'-3'", "'nan'", "wrong unit", "300 letters", "escape codes"),
    "content": (),
}
"""The values above that are right, by the kind of an argument; None besides where it is the default."""


PLUGINS = (
    "audit",
    "bottle",
    "compare",
    "design",
    "find",
    "identify",
    "linearise",
    "load_design",
    "load_device",
    "load_parameter_set",
    "load_scenario",
    "load_study",
    "load_tuning",
    "load_walk",
    "reproduce",
    "scenario_from_dict",
    "sensitivity",
    "simulate",
    "simulate_many",
    "start",
    "sweep",
    "tune",
    "validate",
    "walk",
    "workbench",
)
"""The functions that take modules of the person's own."""


class Function(NamedTuple):
    """A public function: arguments that are right, and the kind of each argument; optional ones take None."""

    given: Mapping[str, Any]
    kinds: Mapping[str, str]
    optional: frozenset[str] = frozenset()


KINDS: Mapping[str, str] = {
    "object": "executor parameter_set parent recording result scenario study tuning",
    "overrides": "overrides",
    "name": (
        "baseline bottle columns configuration folder gait method motion path problem profile such_that valve vary"
    ),
    "names": "configurations initial metrics recordings scenarios thresholds",
    "positive": "atmosphere gas_per_stride minutes peak_flow stride_time volume",
    "from zero": "longest longest_delay rest walk",
    "seed": "seed",
    "count": "draws grid samples threads",
    "function": "progress",
    "fraction": "confidence maximum_failed",
    "content": "content tasks",
    "flag": "agreed check highest independent",
    "number": "at",
    "path": "out",
}
"""Arguments by the kind that they have where a function does not say another one."""

ARGUMENTS: Mapping[str, str] = {
    "apply_overrides": "parameter_set overrides valve?",
    "audit": "parameter_set parent?",
    "bottle": "recordings gas_per_stride? stride_time? peak_flow? bottle? walk? rest? longest overrides",
    "compare": (
        "overrides seed? threads? progress? confidence maximum_failed configurations? study? tasks "
        "baseline? draws? check"
    ),
    "compare_walks": "scenario minutes? progress",
    "design": "problem:object profile? threads? progress?",
    "evaluate": "recording columns?",
    "find": "scenario vary such_that highest grid overrides threads? progress?",
    "identify": "problem progress",
    "linearise": "scenario at overrides",
    "load_design": "problem profile?",
    "load_device": "parameter_set overrides valve?",
    "load_gait": "gait",
    "load_parameter_set": "parameter_set:name",
    "load_scenario": "scenario:name overrides parameter_set?",
    "load_study": "study overrides draws? seed?",
    "load_study_results": "folder",
    "load_tuning": "tuning overrides",
    "load_walk": "scenario:name overrides gait? bottle? parameter_set?",
    "read_recording": "path atmosphere columns?",
    "read_result": "folder",
    "reproduce": "study:name overrides progress?",
    "scenario_from_dict": "content overrides",
    "sensitivity": (
        "overrides seed? threads? executor? progress? confidence maximum_failed study method? metrics samples? "
        "configuration independent"
    ),
    "simulate": "scenario overrides",
    "simulate_many": "scenarios threads?",
    "start": "scenario overrides",
    "sweep": "overrides seed? threads? executor? progress? study draws? out? agreed",
    "tune": "overrides seed? threads? executor? progress? tuning",
    "validate": (
        "parameter_set:name recordings valve? overrides motion volume? initial thresholds longest_delay "
        "columns? progress?"
    ),
    "walk": "scenario overrides gait? bottle? minutes? progress",
    "workbench": "scenarios overrides sliders:names",
}
"""Arguments of every public function that takes some; ``?`` where None is right too, ``:KIND`` for another kind."""


def right_values(recording: Path) -> dict[str, dict[str, Any]]:
    """Arguments that are right, by function; ``recording`` is a file that can be read."""
    return {
        "apply_overrides": {"parameter_set": ppafo.load_parameter_set(SET), "overrides": ()},
        "audit": {"parameter_set": SET},
        "bottle": {"gas_per_stride": 3e-4},
        "compare": {"configurations": [TASK, "torque-task-solenoid"], "draws": 64},
        "compare_walks": {"scenario": WALK},
        "design": {"problem": "push-off"},
        "evaluate": {"recording": recording},
        "find": {
            "scenario": TASK,
            "vary": "supply.pressure=20..90 psi_g",
            "such_that": "rms_error <= 0.3 N m",
            "grid": 4,
        },
        "identify": {"problem": recording},
        "linearise": {"scenario": TASK},
        "load_design": {"problem": "push-off"},
        "load_device": {"parameter_set": SET},
        "load_parameter_set": {"parameter_set": SET},
        "load_scenario": {"scenario": TASK},
        "load_study": {"study": STUDY},
        "load_study_results": {"folder": "no-such-folder"},
        "load_tuning": {"tuning": "pid-gains"},
        "load_walk": {"scenario": WALK},
        "read_recording": {"path": recording},
        "read_result": {"folder": "no-such-folder"},
        "scenario_from_dict": {"content": {}},
        "sensitivity": {"study": STUDY, "samples": 64, "configuration": "proportional"},
        "simulate": {"scenario": TASK},
        "simulate_many": {"scenarios": [TASK]},
        "start": {"scenario": TASK},
        "sweep": {"study": STUDY, "draws": 8},
        "tune": {"tuning": "pid-gains"},
        "validate": {"parameter_set": SET, "recordings": [recording]},
        "walk": {"scenario": WALK, "minutes": 0.05},
    }


def functions(recording: Path) -> dict[str, Function]:
    """Every public function that takes arguments; ``recording`` is a file that can be read."""
    right, known = right_values(recording), {}
    kind_of = {name: kind for kind, names in KINDS.items() for name in names.split()}
    for function, words in ARGUMENTS.items():
        optional = frozenset(word.partition(":")[0].removesuffix("?") for word in words.split() if word.endswith("?"))
        parts = [word.removesuffix("?").partition(":") for word in words.split()]
        kinds = {name: kind or kind_of[name] for name, _, kind in parts}
        if function in PLUGINS:
            kinds["plugins"] = "names"
        known[function] = Function(right.get(function, {}), kinds, optional)
    return known


class Call(NamedTuple):
    """A call with one wrong argument."""

    function: str
    argument: str
    value: str


def calls(known: Mapping[str, Function]) -> list[Call]:
    """Return every wrong call."""
    found = []
    for name, function in known.items():
        for argument, kind in function.kinds.items():
            right = {*RIGHT[kind], *(["None"] if argument in function.optional else [])}
            found += [Call(name, argument, value) for value in WRONG if value not in right]
    return found


class Outcome(NamedTuple):
    """What a wrong call came to: ``named``, ``unnamed`` or ``accepted``, and the error."""

    kind: str
    error: str


def tried(call: Call, known: Mapping[str, Function]) -> Outcome:
    """Make a wrong call."""
    function = known[call.function]
    value = WRONG[call.value]()
    try:
        with _at_most(SECONDS):
            getattr(ppafo, call.function)(**{**function.given, call.argument: value})
    except ppafo.PpafoError as error:
        message = str(error)
        is_clear = message.isprintable() and len(message) < LONGEST
        is_named = is_clear and (names(message, call.argument) or begins(message, value))
        return Outcome("named" if is_named else "unnamed", message)
    except _TooLongError:
        return Outcome("accepted", "it runs on")
    except Exception as error:  # whatever else comes is what is counted here
        return Outcome("unnamed", f"{type(error).__name__}: {error}")
    return Outcome("accepted", "")


def names(message: str, argument: str) -> bool:
    """Tell whether a message has an argument in it, as it is written or in words, one of several too."""
    words = argument.replace("_", "[_ -]")
    return re.search(rf"\b{words.removesuffix('s')}s?\b", message, re.IGNORECASE) is not None


def begins(message: str, value: Any) -> bool:
    """Tell whether a message begins with the path that was given, the first of several, or a file below that folder."""
    first = next(iter(value), None) if isinstance(value, list) else value
    return isinstance(first, str | Path) and re.match(rf"{re.escape(one_line(first))}[:/,]", message) is not None


class _TooLongError(Exception):
    """A call was not refused in time."""


@contextlib.contextmanager
def _at_most(seconds: int) -> Iterator[None]:
    """Raise where a block takes more CPU time: it computes what nobody should have asked."""

    def stop(*_: object) -> None:
        raise _TooLongError

    before = signal.signal(signal.SIGVTALRM, stop)
    signal.setitimer(signal.ITIMER_VIRTUAL, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0)
        signal.signal(signal.SIGVTALRM, before)


def drawn(known: Mapping[str, Function], count: int, seed: int) -> list[Call]:
    """Return so many of the wrong calls, each at most once, in the order of the list."""
    every = calls(known)
    chosen = set(random.Random(seed).sample(range(len(every)), min(count, len(every))))
    return [call for number, call in enumerate(every) if number in chosen]


@contextlib.contextmanager
def workplace() -> Iterator[Path]:
    """Work in an empty folder, where no name of a file is by chance one that is there; give a recording in it."""
    here = Path.cwd()
    with tempfile.TemporaryDirectory(prefix="ppafo-wrong-calls-") as folder:
        os.chdir(folder)
        try:
            ppafo.simulate("step-response").save("recorded")
            yield Path("recorded")
        finally:
            os.chdir(here)


def main() -> int:
    """Print how many wrong calls came to what; exit code 1 where one is accepted or does not name the argument."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--calls", type=int, default=CALLS)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--show", action="store_true")
    parsed = parser.parse_args()
    warnings.simplefilter("ignore")
    counted: Counter[str] = Counter()
    with workplace() as recording:
        known = functions(recording)
        chosen = drawn(known, parsed.calls, parsed.seed)
        for call in chosen:
            outcome = tried(call, known)
            counted[outcome.kind] += 1
            if parsed.show and outcome.kind != "named":
                print(f"{outcome.kind}: {call.function}({call.argument}: {call.value}) {outcome.error}", flush=True)
    print(f"{len(chosen)} calls of {len(known)} functions, seed {parsed.seed}:")
    for kind in ("named", "unnamed", "accepted"):
        print(f"  {kind:<10}{counted[kind]:6}")
    return 0 if counted["named"] == len(chosen) else 1


if __name__ == "__main__":
    sys.exit(main())
