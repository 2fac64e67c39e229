"""Damaged gait files and gait maps are read or refused in one line; nothing else ever comes out."""

from hypothesis import given, settings
from hypothesis import strategies as st

from ppafo.errors import DataError
from ppafo.gait import Gait, load_gait
from ppafo.gait.document import gait_toml, parse_gait

GOOD = gait_toml(load_gait()).encode()
PIECES = [
    b"nan",
    b"inf",
    b"-1e999",
    b"[",
    b"]",
    b'"',
    b"\n",
    b"\xff",
    b"= 5\n",
    b"deg",
    b"0 s",
    b"",
    b"true",
    b"stride",
]


@settings(max_examples=150)
@given(st.data())
def test_a_gait_file_with_pieces_put_in_cut_out_or_changed(data: st.DataObject) -> None:
    content = GOOD
    for _ in range(data.draw(st.integers(1, 3))):
        first = data.draw(st.integers(0, len(content)))
        last = data.draw(st.integers(first, min(len(content), first + 30)))
        content = content[:first] + data.draw(st.sampled_from(PIECES)) + content[last:]
    try:
        gait = parse_gait(content, "mutated.toml")
    except DataError as error:
        assert str(error).startswith("mutated.toml: ")
        assert "\n" not in str(error)
        return
    assert isinstance(gait, Gait)
    assert all(curve.value(0.3) == curve.value(0.3) for curve in gait.curves.values()), "a value that is not NaN"
