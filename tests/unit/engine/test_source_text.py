"""The composer compiles what Python runs, or refuses it by file and line."""

import functools
import importlib.util
import re
import sys
import types
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from ppafo.engine.entries import INLINE
from ppafo.engine.loading import load_generated
from ppafo.engine.source_text import SourceCollector
from ppafo.errors import PpafoError, ProgramError
from tests.compilers_here import first_compiler

HEADER = "import math\nfrom collections import namedtuple\n\n\n"
Write = Callable[..., types.ModuleType]


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Write:
    """Writes a module, imports it, and returns it."""

    def module_of(text: str, name: str = "my_law") -> types.ModuleType:
        file = tmp_path / f"{name}.py"
        file.write_text(text)
        spec = importlib.util.spec_from_file_location(name, file)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, name, module)
        spec.loader.exec_module(module)
        return module

    return module_of


def generated(function: Any) -> Callable[..., Any]:
    """The function as the generated text has it, run by Python."""
    collector = SourceCollector("")
    name = collector.add(function)
    names: dict[str, Any] = {}
    exec(HEADER + collector.text(), names)
    return names[name]


def refused(function: Any) -> str:
    """What the composer says about a function that it refuses."""
    with pytest.raises(ProgramError) as caught:
        SourceCollector("").add(function)
    message = str(caught.value)
    assert "\n" not in message
    return message


def test_a_wrapped_function_is_refused(write: Write) -> None:
    module = write(
        "import functools\n\n\ndef half(f):\n    @functools.wraps(f)\n    def inner(x):\n        return 0.5 * f(x)\n\n"
        "    return inner\n\n\n@half\ndef law(x):\n    return 3.0 * x\n"
    )
    assert module.law(1.0) == 1.5
    assert refused(module.law).startswith("my_law.py:")
    assert "'law' is wrapped by a decorator" in refused(module.law)


def test_a_function_of_a_function_is_refused_by_the_names_that_it_takes_from_there(write: Write) -> None:
    module = write("def make(gain):\n    def law(x):\n        return gain * x\n\n    return law\n")
    assert refused(module.make(2.0)) == (
        "my_law.py:2: 'make.<locals>.law' uses 'gain' of the enclosing function; such variables cannot be "
        "compiled: pass them as parameters"
    )


def test_bound_methods_partial_functions_and_objects_are_refused(write: Write) -> None:
    module = write(
        "class Law:\n    def update(self, x=1.0):\n        return x\n\n    def __call__(self):\n        return 1.0\n"
    )
    for candidate in (module.Law().update, functools.partial(module.Law.update, None), module.Law()):
        assert "plain function" in refused(candidate)


def test_defaults_are_those_that_the_function_has(write: Write) -> None:
    text = "GAIN = 2.0\n\n\ndef law(x, gain=GAIN, *, offset=GAIN):\n    return gain * x + offset * GAIN\n\n\n"
    module = write(f"{text}def called(x):\n    return law(x) + law(x, offset=x)\n")
    module.GAIN = 100.0
    assert generated(module.called)(1.0) == module.called(1.0) == 304.0
    module.law.__defaults__ = (7.0,)
    module.law.__kwdefaults__ = {"offset": -0.5}
    assert generated(module.called)(1.0) == module.called(1.0) == 64.0


def test_a_function_redefined_under_one_name_is_refused_beside_the_first(write: Write) -> None:
    module = write("def law(x):\n    return x\n\n\nfirst = law\n\n\ndef law(x):\n    return 2.0 * x\n")
    collector = SourceCollector("")
    collector.add(module.first)
    with pytest.raises(ProgramError, match="would both be named"):
        collector.add(module.law)
    assert generated(module.first)(3.0) == 3.0
    assert generated(module.law)(3.0) == 6.0


@pytest.mark.parametrize(
    "value",
    [-1.5, -0.0, 0.0, 1e400, -1e400, 5e-324, 0.1, 1 / 3, -7, 2, True, (1.0, -2.0), ((1, 2.5), -0.0)],
    ids=repr,
)
def test_constants_are_written_to_the_last_bit_whatever_stands_around_them(write: Write, value: Any) -> None:
    module = write("import math\n\nVALUE = 0.0\n\n\ndef law(x):\n    return VALUE\n")
    module.VALUE = value
    assert repr(generated(module.law)(1.0)) == repr(module.law(1.0))
    assert type(generated(module.law)(1.0)) is type(value)


@pytest.mark.parametrize(
    ("power", "remedy"),
    [
        ("x**2", "write 'x * x'"),
        ("x**3.0", "write 'x * x * x'"),
        ("x**SQUARE", "write 'x * x'"),
        ("x**0.5", "pass base and exponent as parameters"),
        ("2.0**x", "pass base and exponent as parameters"),
    ],
)
def test_a_power_with_a_number_that_is_written_out_is_refused_with_what_to_write(
    power: str, remedy: str, write: Write
) -> None:
    module = write(f"SQUARE = 2\n\n\ndef law(x):\n    return {power}\n")
    written = power.replace("**", " ** ")
    assert refused(module.law) == f"my_law.py:5: '{written}' cannot be compiled; {remedy}"


def test_a_module_under_another_name_and_functions_of_math_are_found(write: Write) -> None:
    module = write(
        "import math as m\nfrom math import pi, sqrt\nfrom math import *\n\n\ndef law(x):\n"
        "    return sqrt(x) + m.sin(pi) + m.tau + floor(x) + m.inf * 0.0 * 0.0 if x < 0.0 else cos(x)\n"
    )
    for value in (-0.0, 2.5):
        assert generated(module.law)(value) == module.law(value)


def test_a_local_name_that_hides_what_is_needed_is_refused(write: Write) -> None:
    module = write(
        "from math import sqrt\n\n\ndef other(x):\n    return x\n\n\n"
        "def law(x):\n    math = 2.0\n    return sqrt(x) * math\n\n\n"
        "def second(foreign_my_law_other):\n    return other(foreign_my_law_other)\n"
    )
    assert "the local name 'math' hides 'sqrt'" in refused(module.law)
    assert "hides 'other'" in refused(module.second)


def test_a_function_that_hides_a_builtin_one_is_taken(write: Write) -> None:
    module = write("def min(a, b):\n    return a * b\n\n\ndef law(x):\n    return min(x, 2.0) + max(x, 2.0)\n")
    assert generated(module.law)(3.0) == module.law(3.0) == 9.0


def test_defaults_of_a_named_tuple_are_written_where_it_is_made(write: Write) -> None:
    module = write(
        "from typing import NamedTuple\n\nGAIN = 2.0\n\n\nclass Row(NamedTuple):\n    a: float\n    b: float = GAIN\n"
        "    c: float = -1.0\n\n\ndef law(x):\n    return Row(x), Row(a=x), Row(x, c=4.0), Row(x, 5.0, 6.0)\n"
    )
    module.GAIN = 9.0
    assert generated(module.law)(1.0) == module.law(1.0) == ((1, 2, -1), (1, 2, -1), (1, 2, 4), (1, 5, 6))


ROWS = """
from typing import NamedTuple
from ppafo.engine.composer import each

class Inner(NamedTuple):
    a: float
    b: float

class Outer(NamedTuple):
    inner: Inner
    c: float

def made(x: float) -> tuple[float, Outer]:
    return x, Outer(Inner(x, 2.5), 3.5)

def law(row: Outer, x: float) -> Outer:
    first, other = made(x)
    other = other._replace(inner=other.inner._replace(b=first))
    return row._replace(c=row.c + other.inner.b, inner=each(int, other).inner)
"""
"""A law whose rows are changed in some fields, and converted number by number."""


def test_rows_changed_in_some_fields_and_converted_are_what_python_makes_of_them(write: Write) -> None:
    module = write(ROWS)
    row = module.Outer(module.Inner(0.5, 1.5), 2.0)
    assert generated(module.law)(row, 4.75) == module.law(row, 4.75) == ((4, 4), 6.75)
    whole = module.each(int, row)
    assert whole == ((0, 1), 2)
    assert [type(item) for item in (*whole.inner, whole.c)] == [int] * 3


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("row._replace(c", "row._replace(d", "Outer(inner, c): has no 'd'"),
        ("row: Outer", "row", "'row' must be a name that is annotated with its NamedTuple class"),
        ("each(int, other).inner", "each(int, made(x)[1]).inner", "'made(x)[1]' must be a name that is annotated"),
    ],
)
def test_a_row_that_cannot_be_changed_so_is_refused(write: Write, old: str, new: str, said: str) -> None:
    assert said in refused(write(ROWS.replace(old, new)).law)


def test_a_named_tuple_that_does_more_than_hold_numbers_is_refused(write: Write) -> None:
    module = write(
        "from typing import NamedTuple\n\n\nclass Vector(NamedTuple):\n    x: float\n\n    def __add__(self, other):\n"
        "        return Vector(self.x + other.x)\n\n\nclass Base(NamedTuple):\n    x: float\n\n\nclass Doubled(Base):\n"
        "    def __new__(cls, x):\n        return super().__new__(cls, 2.0 * x)\n\n\ndef law(x):\n"
        "    return Vector(x) + Vector(x)\n\n\ndef doubled(x):\n    return Doubled(x)\n"
    )
    assert "redefines __add__" in refused(module.law)
    assert "must be a NamedTuple, not a subclass" in refused(module.doubled)


def test_attributes_of_classes_are_refused(write: Write) -> None:
    module = write(
        "from typing import NamedTuple\n\n\nclass Row(NamedTuple):\n    a: float\n\n\n"
        "class Config:\n    gain = 2.0\n\n\n"
        "def law(x):\n    return Config.gain * x\n\n\ndef other(x):\n    return Row._make((x,))\n"
    )
    assert refused(module.law).startswith("my_law.py:13: 'Config.gain'")
    assert refused(module.other).startswith("my_law.py:17: 'Row._make")


def test_a_file_that_changed_since_it_was_loaded_is_refused(write: Write) -> None:
    module = write("def law(x):\n    return 2.0 * x\n")
    Path(module.__file__ or "").write_text("def law(x):\n    return 3.0 * x\n")
    assert "the file changed after it was loaded" in refused(module.law)


def test_functions_that_call_themselves_are_refused(write: Write) -> None:
    module = write(
        "def law(x):\n    return law(x - 1.0) if x > 0.0 else 0.0\n\n\ndef one(x):\n    return two(x)\n\n\n"
        "def two(x):\n    return one(x)\n"
    )
    assert "'law' calls itself" in refused(module.law)
    assert "'one' calls itself" in refused(module.one)


@pytest.mark.parametrize(
    ("body", "word"),
    [
        ("return {1: x}[1]", "'{1: x}' cannot be compiled"),
        ("return [x][0]", "'[x]'"),
        ("return sum([y for y in (x, x)])", "'[y for y in (x, x)]'"),
        ("return sum(y for y in (x, x))", "'(y for y in (x, x))'"),
        ("return (lambda y: y)(x)", "'lambda y: y'"),
        ("return len(f'{x}')", "f'{x}'"),
        ("return len('text')", "'text'"),
        ("return len(b'text')", "b'text'"),
        ("return (y := x)", "(y := x)"),
        ("a, *b = x, x\n    return a", "'*b'"),
        ("return max(**{})", "'**{}'"),
        ("global LEVEL\n    LEVEL = x\n    return x", "'global LEVEL'"),
        ("import math\n    return math.sin(x)", "'import math'"),
        ("try:\n        return x\n    except ValueError:\n        return x", "'try:'"),
        ("with x:\n        return x", "'with x:'"),
        ("assert x > 0.0\n    return x", "'assert x > 0.0'"),
        ("raise ValueError", "'raise ValueError'"),
        ("yield x", "yield x"),
        ("match x:\n        case _:\n            return x", "'match x:'"),
        ("def inner():\n        return x\n    return inner()", "'def inner():'"),
        ("print(x)\n    return x", "'print'"),
        ("x.real = 1.0\n    return x", "cannot be assigned"),
        ("return x.is_integer()", "is a method"),
    ],
)
def test_what_is_not_compiled_is_named_with_its_line(write: Write, body: str, word: str) -> None:
    module = write(f"LEVEL = 1.0\n\n\ndef law(x):\n    {body}\n")
    message = refused(module.law)
    assert re.match(r"my_law\.py:\d+: ", message)
    assert word in message


def test_a_rebound_number_or_function_is_noticed(write: Write) -> None:
    text = "import math\n\nGAIN = 2.0\n\n\ndef other(x, y=1.0):\n    return x\n\n\n"
    text += "def law(x):\n    return GAIN * other(x)\n"
    for change in ("GAIN = 3.0", "other = math.sin", "other.__defaults__ = (3.0,)", "other.__code__ = law.__code__"):
        module = write(text)
        collector = SourceCollector("")
        collector.add(module.law)
        assert collector.made_from.is_current()
        exec(change, vars(module))
        assert not collector.made_from.is_current(), change


def compiled_law(module: types.ModuleType, call: str = "law(measurement, x[0])") -> None:
    """Compile ``law`` as a model does: called from a loop with a measurement and a number."""
    collector = SourceCollector(INLINE)
    row, law = collector.add(module.Measurement), collector.add(module.law)
    call = call.replace("law", law)
    loop = f'@entry("void(float64[::1])")\ndef advance(x):\n    measurement = {row}(x[0], x[1])\n    x[0] = {call}\n'
    load_generated(f"{HEADER}{collector.text()}\n\n\n{loop}", first_compiler())


MEASUREMENT = (
    "import math\nfrom typing import NamedTuple\n\nimport numpy as np\n\n\nclass Measurement(NamedTuple):\n"
    "    angle: float\n    torque: float\n\n\n"
)


@pytest.mark.parametrize(
    ("law", "line", "said"),
    [
        (
            "def law(measurement, x):\n    return (\n        x\n        - measurement.torqe\n    )\n",
            15,
            "did you mean 'torque'?",
        ),
        ("def law(measurement, x):\n    return mat.sin(x)\n", 13, "'mat' is not defined, did you mean 'math'?"),
        (
            "def clamp(x, low):\n    return x\n\n\ndef law(measurement, x):\n    return clamp(x)\n",
            17,
            "argument: 'low'",
        ),
        ("def law(measurement, x):\n    if x > 0.0:\n        return x\n", 12, "'law' can end without 'return'"),
        ("def law(measurement, x):\n    if x > 0.0:\n        return x, x\n    return x\n", 14, "a number or a tuple"),
        ("def law(measurement, x):\n    return {0: x}[0]\n", 13, "'{0: x}' cannot be compiled"),
        ("def law(measurement, x):\n    return np.clip(x, 0.0, 1.0)\n", 13, "'np.clip' is from numpy"),
        ("def law(measurement, x):\n    return measurement / x\n", 13, "applies '/' to a Measurement and a number"),
        ("def law(measurement, x):\n    return Measurement(x, torqe=x).torque\n", 13, "did you mean 'torque'?"),
        ("def law(measurement, x):\n    if x > 0.0:\n        y = x\n    return y\n", 15, "'y' may be unassigned here"),
        ("def law(measurement, x):\n    a, b = x\n    return a\n", 13, "the value is a number"),
        ("def law(measurement, x, y):\n    return x\n", 12, "missing a required argument: 'y'"),
    ],
)
@pytest.mark.usefixtures("fresh_cache")
def test_the_commonest_mistakes_in_a_law_are_one_line_about_its_file(
    write: Write, law: str, line: int, said: str
) -> None:
    with pytest.raises(PpafoError) as caught:
        compiled_law(write(MEASUREMENT + law))
    message = str(caught.value)
    assert message.startswith(f"my_law.py:{line}: ")
    assert said in message
    assert "\n" not in message
