"""Damaged set files end in one clear line or in a set that every later step can take."""

import json
from importlib import resources

from hypothesis import example, given, settings
from hypothesis import strategies as st

from ppafo.errors import ParameterError
from ppafo.parameters import build_device
from ppafo.parameters.audit import audit
from ppafo.parameters.loading import parse_parameter_set

LINES = (resources.files("ppafo.parameters") / "sets" / "ppafo2011.toml").read_text(encoding="utf-8").splitlines()
NUMBERS = ["0", "-1", "0.5", "1e308", "-1e308", "1e-308", "1e400", "nan", "inf", "10" * 200]
TEXTS = ["", "psi", "psi_g", "psi_d", "mm^2", "s/m", "deg", "k", "(((((", "m" * 300, r"\u0000", r"\n"]
JUNK = [*NUMBERS, *(f'"{text}"' for text in TEXTS), "true", "[]", "{}", "[[[[", "1979-05-27"]

places = st.integers(0, len(LINES) - 1)
mutations = st.one_of(
    st.tuples(st.just("delete"), places, st.just("")),
    st.tuples(st.just("repeat"), places, st.just("")),
    st.tuples(st.just("value"), places, st.sampled_from(JUNK)),
    st.tuples(st.just("key"), places, st.text("abcdefghij_.[]=", min_size=1, max_size=8)),
    st.tuples(st.just("insert"), places, st.text(max_size=20)),
)


def damaged(changes: list[tuple[str, int, str]]) -> bytes:
    lines = list(LINES)
    for action, place, text in changes:
        line = lines[place]
        key, equals, _ = line.partition("=")
        replacement = {
            "delete": "",
            "repeat": f"{line}\n{line}",
            "value": f"{key}= {text}" if equals else line,
            "key": f"{text} = {line.partition('=')[2]}" if equals else f"[{text}]",
            "insert": f"{line[: len(line) // 2]}{text}{line[len(line) // 2 :]}",
        }
        lines[place] = replacement[action]
    return "\n".join(lines).encode("utf-8", "surrogatepass")


@settings(max_examples=500)
@example([("value", LINES.index('value = "CO2"'), r'"\n"')])
@given(st.lists(mutations, min_size=1, max_size=4))
def test_a_damaged_file_gives_a_clear_error_or_a_usable_set(changes: list[tuple[str, int, str]]) -> None:
    try:
        parameter_set = parse_parameter_set(damaged(changes), "damaged.toml")
        json.dumps([finding.document() for finding in audit(parameter_set)], allow_nan=False)
        for valve in parameter_set.valve_kinds:
            build_device(parameter_set, valve)
    except ParameterError as error:
        assert str(error).startswith("damaged.toml: ")
        assert "\n" not in str(error)


@settings(max_examples=200)
@given(content=st.binary(max_size=200))
@example(b"")
@example(b"\xef\xbb\xbf")
def test_any_bytes_are_a_clear_error(content: bytes) -> None:
    try:
        parse_parameter_set(content, "bytes.toml")
    except ParameterError as error:
        assert "\n" not in str(error)
    else:
        raise AssertionError("random bytes were taken for a parameter set")
