"""A parameter set that is written reads back as the same set."""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ppafo.parameters.loading import list_sets, load_parameter_set, parameter_set_toml, parse_parameter_set
from ppafo.parameters.parameter_set import Entry

_TEXT = st.text(st.characters(blacklist_categories=("Cs",)), min_size=1)


@pytest.mark.parametrize("name", list_sets())
def test_every_set_reads_back_as_it_was(name: str) -> None:
    before = load_parameter_set(name)
    assert parse_parameter_set(parameter_set_toml(before).encode(), before.file) == before


@given(
    source=_TEXT,
    value=st.floats(allow_nan=False, allow_infinity=False),
    uncertainty=st.none() | st.floats(min_value=0.0, allow_infinity=False),
)
def test_any_text_and_any_number_read_back_exactly(source: str, value: float, uncertainty: float | None) -> None:
    before = load_parameter_set("ppafo2011")
    entry = Entry(value=value, unit="m^3", origin="identified", source=source, note=source, uncertainty=uncertainty)
    changed = replace(before, title=source, numbers={**before.numbers, "actuator.torque_constant": entry})
    assert parse_parameter_set(parameter_set_toml(changed).encode(), before.file) == changed
