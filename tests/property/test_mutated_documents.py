"""Damaged files of every format that comes with the package end in one clear line or in something that can be used."""

import re
from collections.abc import Callable
from importlib import resources
from importlib.resources.abc import Traversable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ppafo.analyses.design.loading import load_design
from ppafo.analyses.tune.problem import load_tuning
from ppafo.errors import PpafoError
from ppafo.gait.document import load_gait
from ppafo.parameters.bottles.bottle import load_bottle
from ppafo.parameters.parts import load_catalogue
from ppafo.rig.preset import load_preset
from ppafo.studies.loading import load_study
from ppafo.walking.loading import load_walk

PACKAGE = resources.files("ppafo")
FORMATS: dict[str, tuple[Callable[[str], Any], Traversable]] = {
    "study": (load_study, PACKAGE / "studies" / "library"),
    "tuning": (load_tuning, PACKAGE / "analyses" / "tune" / "library"),
    "design": (load_design, PACKAGE / "analyses" / "design" / "library"),
    "walk": (load_walk, PACKAGE / "walking" / "configurations"),
    "bottle": (load_bottle, PACKAGE / "parameters" / "bottles" / "files"),
    "parts": (load_catalogue, PACKAGE / "parameters" / "parts" / "catalogues"),
    "rig": (load_preset, PACKAGE / "rig" / "presets"),
    "gait": (load_gait, PACKAGE / "gait" / "normative"),
}
UNITS = [
    "",
    "s",
    "mm^0",
    "degC^0",
    "1/m^0",
    "psi",
    "psi_g",
    "psi_a",
    "psi_d",
    "deg",
    "N m",
    "%",
    "kg",
    "((",
    "\\u0000",
    "mm^9",
]
NUMBERS = ["0", "-1", "0.5", "1e308", "-1e-308", "1e400", "nan", "inf", "9" * 400]
TEXTS = [
    "",
    "..",
    "/dev/zero",
    "/dev/null",
    "/",
    "nowhere.toml",
    "a" * 5_000,
    "\\ud7ff",
    "\\n",
    "\\u0000",
    "-\\u202e",
    "~",
    "s3://x",
]
QUOTED = [f'"{number} {unit}"' for number in NUMBERS for unit in UNITS] + [f'"{text}"' for text in TEXTS]
RAW = [
    *NUMBERS,
    "true",
    "[]",
    "{}",
    "[[]]",
    "[" * 60 + "]" * 60,
    "{a = " * 60 + "1" + "}" * 60,
    "1979-05-27",
    '["a", 1]',
]
SECTIONS = ["[a]", "[[vary]]", "[device]", f"[{'.'.join('a' * 600)}]", "[vary]", "[variables.x]", "[run]", "[[parts]]"]

changes = st.lists(
    st.one_of(
        st.tuples(st.just("value"), st.integers(0, 500), st.sampled_from([*QUOTED, *RAW])),
        st.tuples(st.just("unit"), st.integers(0, 500), st.sampled_from(UNITS)),
        st.tuples(st.just("key"), st.integers(0, 500), st.text("abcelmoprstu_.-", min_size=1, max_size=6)),
        st.tuples(st.just("line"), st.integers(0, 500), st.sampled_from([*SECTIONS, "", "x = 1", "\x00", "\ufeff"])),
        st.tuples(st.just("repeat"), st.integers(0, 500), st.just("")),
        st.tuples(st.just("delete"), st.integers(0, 500), st.just("")),
    ),
    min_size=1,
    max_size=3,
)


def damaged(text: str, wanted: list[tuple[str, int, str]]) -> str:
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    for action, place, new in wanted:
        number = place % len(lines)
        key, equals, value = lines[number].partition("=")
        lines[number] = {
            "value": f"{key}= {new}" if equals else lines[number],
            "unit": re.sub(r'"([-+0-9.e]+)[^"]*"', rf'"\1 {new.replace(chr(92), chr(92) * 2)}"', lines[number]),
            "key": f"{new} ={value}" if equals else f"[{new}]",
            "line": f"{lines[number]}\n{new}",
            "repeat": f"{lines[number]}\n{lines[number]}",
            "delete": "",
        }[action]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("name", FORMATS)
def test_damaged_file_is_refused_in_one_line_or_can_be_used(name: str, tmp_path: Path) -> None:
    load, folder = FORMATS[name]
    originals = [item.read_text(encoding="utf-8") for item in folder.iterdir() if item.name.endswith(".toml")]
    path = tmp_path / "damaged.toml"

    @settings(max_examples=60, suppress_health_check=list(HealthCheck))
    @given(text=st.sampled_from(originals), wanted=changes)
    def check(text: str, wanted: list[tuple[str, int, str]]) -> None:
        path.write_text(damaged(text, wanted), encoding="utf-8")
        try:
            load(str(path))
        except PpafoError as error:
            assert len(str(error).splitlines()) == 1
            assert len(str(error)) < 8_000

    check()
