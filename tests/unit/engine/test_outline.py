"""The outline of a module changes with whatever its text is made from, and with nothing else."""

import importlib.util
import math
import os
import subprocess
import sys
import types
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest

from ppafo.control.catalog import CONTROLLERS, PROFILES
from ppafo.engine import lanes
from ppafo.engine.lane_source import INLINE, write_lanes
from ppafo.engine.outline import Outline
from ppafo.engine.program import Program
from ppafo.engine.source_text import SourceCollector
from ppafo.errors import ProgramError
from ppafo.model.valves.proportional import IDEAL
from tests.composed_programs import drawn_programs

LAW = '''"""A law of somebody."""

import math
import other_module
from typing import NamedTuple

GAIN = 2.0
LIMITS = (0.0, 1.0)


class Limits(NamedTuple):
    """Limits of something."""

    low: float
    high: float = 5.0


def held(value, most=1.0):
    return min(value, most)


def law(error, *, share=0.5):
    within = Limits(LIMITS[0])
    return GAIN * held(error) * other_module.FACTOR * share + math.pi * within.high
'''

PROGRAM = Program(IDEAL, PROFILES["ramp_hold"], CONTROLLERS["pid"], PROFILES["constant"], True, False)


@pytest.fixture
def write(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Callable[[str], types.ModuleType]:
    """Writes the law, or another text in its place, and imports it beside the module that it reads."""
    other = types.ModuleType("other_module")
    other.__dict__["FACTOR"] = 3.0
    monkeypatch.setitem(sys.modules, "other_module", other)

    def module_of(text: str) -> types.ModuleType:
        file = tmp_path / "my_law.py"
        file.write_text(text)
        spec = importlib.util.spec_from_file_location("my_law", file)
        assert spec is not None
        assert spec.loader is not None
        module = importlib.util.module_from_spec(spec)
        monkeypatch.setitem(sys.modules, "my_law", module)
        monkeypatch.setattr(sys, "dont_write_bytecode", True)
        spec.loader.exec_module(module)
        return module

    return module_of


def outlined(function: Any) -> str:
    outline = Outline("")
    assert outline.add(function) == SourceCollector("").add(function)
    assert outline.made_from.is_current()
    return outline.text()


@pytest.mark.parametrize(
    "change",
    [
        "GAIN = 2.0000000000000004",
        "GAIN = 2",
        "GAIN = -2.0",
        "LIMITS = (-0.0, 1.0)",
        "other_module.FACTOR = 4.0",
        "held.__defaults__ = (2.0,)",
        "law.__kwdefaults__ = {'share': 0.25}",
        "held.__code__ = (lambda value, most: max(value, most)).__code__",
        "held = law",
        "Limits = NamedTuple('Limits', [('low', float), ('high', float)])",
        "Limits._field_defaults['high'] = 6.0",
    ],
)
def test_whatever_a_function_reads_is_in_the_outline(write: Callable[[str], types.ModuleType], change: str) -> None:
    module = write(LAW)
    outline = Outline("")
    outline.add(module.law)
    exec(change, vars(module))
    assert outlined_or_refused(module.law) != outline.text()


def outlined_or_refused(function: Any) -> str:
    outline = Outline("")
    outline.add(function)
    return outline.text()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("GAIN * held(error)", "held(error) * GAIN"),
        ("min(value, most)", "max(value, most)"),
        ("high: float = 5.0", "high: float = 6.0"),
        ("share=0.5", "share=0.75"),
        ("math.pi", "math.e"),
        ("A law of somebody", "A law of somebody else"),
        ("2.0\n", "(1.0 + 1.0)\n"),
    ],
)
def test_another_file_is_another_outline(write: Callable[[str], types.ModuleType], old: str, new: str) -> None:
    assert old in LAW
    before = outlined(write(LAW).law)
    assert outlined(write(LAW).law) == before
    assert outlined(write(LAW.replace(old, new)).law) != before


def test_a_number_that_a_package_loads_when_it_is_read_is_followed(
    write: Callable[[str], types.ModuleType], monkeypatch: pytest.MonkeyPatch
) -> None:
    late = types.ModuleType("other_module")
    monkeypatch.setitem(sys.modules, "other_module", late)
    found = []
    for value in (3.0, 4.0):
        late.__dict__["__getattr__"] = partial(loaded_late, FACTOR=value)
        found.append(outlined_or_refused(write(LAW).law))
    assert found[0] != found[1]


def loaded_late(name: str, **known: float) -> float:
    """The number of a name; AttributeError for any other, as a module says it."""
    if name not in known:
        raise AttributeError(name)
    return known[name]


def test_what_is_linked_to_another_function_is_that_one(write: Callable[[str], types.ModuleType]) -> None:
    module = write(LAW)
    plain, linked, direct = Outline(""), Outline("", links={module.held: math_free}), Outline("")
    plain.add(module.law)
    linked.add(module.law)
    direct.add(math_free)
    assert plain.text() != linked.text()
    assert linked.add(module.held) == direct.add(math_free)


def math_free(value: float, most: float = 1.0) -> float:
    """Stands for another function."""
    return value + most


def test_what_is_no_plain_function_is_refused_as_by_the_composer() -> None:
    for outline in (Outline(""), SourceCollector("")):
        with pytest.raises(ProgramError, match="its source text is not available"):
            outline.add(math.sin)


def test_a_rebound_name_is_noticed(write: Callable[[str], types.ModuleType]) -> None:
    module = write(LAW)
    outline = Outline("")
    outline.add(module.law)
    assert outline.made_from.is_current()
    module.__dict__["GAIN"] = 5.0
    assert not outline.made_from.is_current()


def outline_of(program: Program, count: int = 0) -> str:
    return write_lanes(program, Outline(INLINE), count)


def programs() -> Iterator[Program]:
    """Programs of every kind, and each with one thing changed."""
    for program in drawn_programs(7):
        yield program
        yield replace(program, late_commands=not program.late_commands)


def test_two_programs_have_one_outline_only_where_they_have_one_text() -> None:
    texts: dict[str, str] = {}
    for program in programs():
        text = write_lanes(program, SourceCollector(INLINE))
        assert texts.setdefault(outline_of(program), text) == text
    assert len(texts) == 14
    assert len(set(texts.values())) == len(texts)


def test_a_number_deep_in_the_physics_gives_another_program(monkeypatch: pytest.MonkeyPatch) -> None:
    from ppafo.engine.scheme import pneumatics

    before = outline_of(PROGRAM)
    monkeypatch.setattr(pneumatics, "GAMMA", 0.3)
    assert outline_of(PROGRAM) != before


def test_another_law_or_another_number_of_lanes_is_another_program() -> None:
    assert outline_of(replace(PROGRAM, controller=CONTROLLERS["on_off"])) != outline_of(PROGRAM)
    assert outline_of(PROGRAM, 1) != outline_of(PROGRAM)


def test_every_function_of_a_program_that_changes_gives_another_program(monkeypatch: pytest.MonkeyPatch) -> None:
    outline = Outline(INLINE)
    before = write_lanes(PROGRAM, outline)
    assert len(outline.made_from.functions) > 30
    for made in outline.made_from.functions:
        with monkeypatch.context() as patch:
            patch.setattr(made.function, "__code__", (lambda *_given: 0.0).__code__)
            assert outline_of(PROGRAM) != before, made.function.__qualname__
    assert outline_of(PROGRAM) == before


def test_another_composer_writes_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    from ppafo.engine import outline

    before = outline_of(PROGRAM)
    monkeypatch.setattr(outline, "file_hash", lambda file: f"other {Path(file).name}")
    assert outline_of(PROGRAM) != before


def test_outlines_are_the_same_in_every_process() -> None:
    code = (
        "from tests.unit.engine.test_outline import PROGRAM, outline_of\n"
        "import hashlib\nprint(hashlib.sha256(outline_of(PROGRAM).encode()).hexdigest())"
    )
    seeds = ("1", "2")
    found = [
        subprocess.run(
            [sys.executable, "-c", code],
            env={**os.environ, "PYTHONHASHSEED": seed},
            cwd=Path(__file__).parents[3],
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        for seed in seeds
    ]
    assert found[0] == found[1]


def test_a_second_process_writes_no_function_and_has_the_same_text(
    fresh_cache: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    lanes.write_source.cache_clear()
    _, first = lanes.write_source(PROGRAM)
    assert first == write_lanes(PROGRAM, SourceCollector(INLINE))
    lanes.write_source.cache_clear()
    monkeypatch.setattr(SourceCollector, "add", lambda *_given: pytest.fail("a function was written"))
    assert lanes.write_source(PROGRAM)[1] == first
    lanes.write_source.cache_clear()
