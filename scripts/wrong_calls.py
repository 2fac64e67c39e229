"""Calls of the public functions with values that no argument takes: which are accepted, and which errors name it not.

    python scripts/wrong_calls.py                 3,075 calls, drawn with seed 1
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
from collections.abc import Callable, Iterable, Iterator, Mapping
from datetime import timedelta
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

import ppafo

SEED, CALLS, SECONDS = 1, 3075, 20
TASK, SET, STUDY, WALK = "torque-task-proportional", "ppafo2011", "torque-task-uncertainty", "solenoid"

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
}
"""Values by what a list calls them; made anew for each call, as a generator can be gone through once."""

_NUMBERS = ("zero", "huge", "one and a half", "minus one", "minus a million", "NumPy minus one")
RIGHT: Mapping[str, tuple[str, ...]] = {
    "object": (),
    "name": (),
    "names": (),
    "overrides": (),
    "flag": ("True", "False"),
    "whole": ("zero",),
    "seed": ("zero",),
    "count": (),
    "fraction": ("zero",),
    "number": _NUMBERS,
    "positive": ("one and a half", "huge"),
    "from zero": ("zero", "one and a half", "huge"),
    "function": ("class",),
    "path": ("no such name", "no such file", "'False'", "'-3'", "'nan'", "wrong unit"),
    "address": (),
    "content": (),
}
"""The values above that are right, by the kind of an argument; None besides where it is the default."""


PLUGINS = (
    "audit",
    "bottle",
    "compare",
    "design",
    "estimate",
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
    alone: str = ""
    """The argument that takes the place of all others."""


def _function(given: Mapping[str, Any], optional: str = "", alone: str = "", **kinds: str) -> Function:
    return Function(given, kinds, frozenset(optional.split()), alone)


def functions(recording: Path) -> dict[str, Function]:
    """Every public function that takes arguments; ``recording`` is a file that can be read."""
    study = {"overrides": "overrides", "seed": "seed", "threads": "count", "progress": "function"}
    drawn = {**study, "confidence": "fraction", "maximum_failed": "fraction"}
    none = "seed threads progress"
    known = {
        "apply_overrides": _function(
            {"parameter_set": ppafo.load_parameter_set(SET), "overrides": ()},
            "valve",
            parameter_set="object",
            overrides="overrides",
            valve="name",
        ),
        "audit": _function({"parameter_set": SET}, "parent", parameter_set="object", parent="object"),
        "bottle": _function(
            {"gas_per_stride": 3e-4},
            "gas_per_stride stride_time peak_flow bottle walk rest",
            recordings="names",
            gas_per_stride="positive",
            stride_time="positive",
            peak_flow="positive",
            bottle="name",
            walk="from zero",
            rest="from zero",
            longest="from zero",
            overrides="overrides",
        ),
        "compare": _function(
            {"configurations": [TASK, "torque-task-solenoid"], "draws": 64},
            f"{none} configurations study baseline",
            **drawn,
            configurations="names",
            study="object",
            tasks="content",
            baseline="name",
            draws="count",
            check="flag",
        ),
        "compare_walks": _function(
            {"scenario": WALK}, "minutes", scenario="object", minutes="positive", progress="function"
        ),
        "design": _function(
            {"mass": 72.5, "torque": 2.5, "pressure": 4.46e5, "minutes": 5.0},
            "problem seed threads mass stature torque pressure minutes toes catalogue progress",
            problem="object",
            seed="seed",
            threads="count",
            mass="positive",
            stature="positive",
            torque="positive",
            pressure="positive",
            minutes="positive",
            toes="number",
            catalogue="name",
            progress="function",
            alone="problem",
        ),
        "endurance_of_walk": _function(
            {"result": ppafo.walk(WALK, minutes=0.1)}, "bottle", result="object", bottle="name"
        ),
        "estimate": _function(
            {"study": STUDY, "metric": "rms_error", "draws": 512, "configuration": "proportional"},
            f"{none} width",
            **drawn,
            study="object",
            metric="name",
            statistic="name",
            width="name",
            also="names",
            configuration="name",
            first_draws="count",
            draws="count",
        ),
        "evaluate": _function({"recording": recording}, recording="object"),
        "find": _function(
            {"scenario": TASK, "vary": "supply.pressure=20..90 psi_g", "such_that": "rms_error <= 0.3 N m", "grid": 4},
            "threads progress",
            scenario="object",
            vary="name",
            such_that="name",
            highest="flag",
            grid="count",
            overrides="overrides",
            threads="count",
            progress="function",
        ),
        "identify": _function({"problem": recording}, "", problem="name", progress="function"),
        "linearise": _function({"scenario": TASK}, "", scenario="object", at="number", overrides="overrides"),
        "load_catalogue": _function({}, "", catalogue="name"),
        "load_design": _function({"problem": "push-off"}, "seed", problem="name", seed="seed"),
        "load_device": _function(
            {"parameter_set": SET}, "valve", parameter_set="object", overrides="overrides", valve="name"
        ),
        "load_gait": _function({}, "", gait="name"),
        "load_parameter_set": _function({"parameter_set": SET}, "", parameter_set="name"),
        "load_scenario": _function(
            {"scenario": TASK}, "parameter_set", scenario="name", overrides="overrides", parameter_set="object"
        ),
        "load_study": _function(
            {"study": STUDY}, "draws seed", study="object", overrides="overrides", draws="count", seed="seed"
        ),
        "load_study_results": _function({"folder": "no-such-folder"}, "", folder="name"),
        "load_tuning": _function({"tuning": "pid-gains"}, "", tuning="object", overrides="overrides"),
        "load_walk": _function(
            {"scenario": WALK},
            "gait task_sequence bottle parameter_set",
            scenario="name",
            overrides="overrides",
            gait="name",
            task_sequence="name",
            bottle="name",
            parameter_set="object",
        ),
        "parts": _function({}, "part", part="name", catalogue="name"),
        "read_recording": _function({"path": recording}, "", path="name", atmosphere="positive"),
        "read_result": _function({"folder": "no-such-folder"}, "", folder="name"),
        "reproduce": _function({}, "progress", study="name", overrides="overrides", progress="function"),
        "scenario_from_dict": _function({"content": {}}, "", content="content", overrides="overrides"),
        "sensitivity": _function(
            {"study": STUDY, "samples": 64, "configuration": "proportional"},
            f"{none} method samples",
            **drawn,
            study="object",
            method="name",
            metrics="names",
            samples="count",
            configuration="name",
            independent="flag",
        ),
        "simulate": _function({"scenario": TASK}, "", scenario="object", overrides="overrides"),
        "simulate_many": _function({"scenarios": [TASK]}, "threads", scenarios="names", threads="count"),
        "sweep": _function(
            {"study": STUDY, "draws": 8},
            f"{none} draws out scheduler",
            **study,
            study="object",
            draws="count",
            out="path",
            scheduler="address",
            agreed="flag",
        ),
        "tune": _function({"tuning": "pid-gains"}, none, **study, tuning="object"),
        "validate": _function(
            {"parameter_set": SET, "recordings": [recording]},
            "valve volume columns progress",
            parameter_set="name",
            recordings="names",
            valve="name",
            overrides="overrides",
            motion="name",
            volume="positive",
            initial="names",
            thresholds="names",
            longest_delay="from zero",
            columns="name",
            progress="function",
        ),
        "walk": _function(
            {"scenario": WALK, "minutes": 0.05},
            "gait task_sequence bottle minutes",
            scenario="object",
            overrides="overrides",
            gait="name",
            task_sequence="name",
            bottle="name",
            minutes="positive",
            progress="function",
        ),
        "walk_population": _function(
            {"scenario": WALK, "wearers": 2, "minutes": 0.05},
            "minutes",
            scenario="object",
            wearers="count",
            minutes="positive",
            seed="seed",
            progress="function",
        ),
        "workbench": _function({}, "", scenarios="names", overrides="overrides"),
    }
    for name in PLUGINS:
        function = known[name]
        known[name] = function._replace(kinds={**function.kinds, "plugins": "names"})
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
            given = {} if call.argument == function.alone else function.given
            getattr(ppafo, call.function)(**{**given, call.argument: value})
    except ppafo.PpafoError as error:
        is_named = names(str(error), call.argument) or begins(str(error), value)
        return Outcome("named" if is_named else "unnamed", str(error))
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
    first = value if isinstance(value, str | Path) else next(iter(value), None) if isinstance(value, Iterable) else None
    return isinstance(first, str | Path) and re.match(rf"{re.escape(str(first))}[:/,]", message) is not None


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
