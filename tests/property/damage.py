"""Damage to a TOML file by chance: other values, units and keys, lines that are put in, repeated and taken out."""

import re

from hypothesis import strategies as st

Change = tuple[str, int, str]
"""What is done, to which line, and the text that it takes."""

NUMBERS = ["0", "-1", "-0.0", "0.5", "1e308", "-1e308", "-1e-308", "1e400", "nan", "-inf", "inf", "9" * 400, "0x1F"]
UNITS = [
    *("s", "ms", "us", "min", "Hz", "kHz", "deg", "rad", "rad/s", "s/m", "K", "degC", "kg", "%", "furlong", "((("),
    *("psi", "psi_g", "psi_a", "psi_d", "psi_x", "Pa_a", "bar_g", "mm^2"),
    *("", "N m", "1/(N m)", "1/(N m s)", "s/(N m)", "mm^0", "degC^0", "1/m^0", "mm^9", "m" * 300, "\\u0000", "\\n"),
]
WORDS = [
    *("supply", "atmosphere", "pid", "on_off", "free", "locked", "prescribed", "sine", "ramp_hold", "solenoid"),
    *(
        "",
        "ppafo2011-printed",
        "nowhere.toml",
        "..",
        "/",
        "/dev/null",
        "/dev/zero",
        "~",
        "s3://x",
        "a/" * 2500,
        "b" * 5000,
    ),
    *("\\u0000", "\\ud7ff", "-\\u202e", "\\n\\r\\u2028"),
]
QUOTED = [f'"{text}"' for text in [*(f"{number} {unit}" for number in NUMBERS for unit in UNITS), *WORDS]]
DEEP = ("[" * 60 + "]" * 60, "{a = " * 60 + "1" + "}" * 60)
RAW = [*NUMBERS, "true", "[]", "{}", "[[]]", "[[[[", "{a=1}", "1979-05-27", "07:32:00", '["a", 1]', "'''", '"""', *DEEP]
LINES = ["[a]", "[[vary]]", "[device]", f"[{'.'.join('a' * 600)}]", "[run]", "[[parts]]", "", "x = 1", "\x00", "\ufeff"]

_PLACES = st.integers(0, 500)
CHANGES = st.lists(
    st.one_of(
        st.tuples(st.just("value"), _PLACES, st.sampled_from([*QUOTED, *RAW])),
        st.tuples(st.just("unit"), _PLACES, st.sampled_from(UNITS)),
        st.tuples(st.just("key"), _PLACES, st.text("abcdeklmnoprstuv_.-[]=\"'", min_size=1, max_size=8)),
        st.tuples(st.just("misspell"), _PLACES, st.sampled_from("aeioust_")),
        st.tuples(st.just("insert"), _PLACES, st.text(max_size=20)),
        st.tuples(st.just("line"), _PLACES, st.sampled_from(LINES)),
        st.tuples(st.just("repeat"), _PLACES, st.just("")),
        st.tuples(st.just("delete"), _PLACES, st.just("")),
    ),
    min_size=1,
    max_size=4,
)


def damaged(text: str, changes: list[Change]) -> bytes:
    """The lines of a file that are no remarks, with changes; a place beyond the last line counts on from the first."""
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    for action, place, new in changes:
        number = place % len(lines)
        line = lines[number]
        key, equals, value = line.partition("=")
        middle = len(line) // 2
        letter = place % (len(line) + 1)
        lines[number] = {
            "value": f"{key}= {new}" if equals else line,
            "unit": re.sub(r'"([-+0-9.e]+)[^"]*"', lambda found, new=new: f'"{found[1]} {new}"', line),
            "key": f"{new} ={value}" if equals else f"[{new}]",
            "misspell": f"{line[:letter]}{new}{line[letter + 1 :]}",
            "insert": f"{line[:middle]}{new}{line[middle:]}",
            "line": f"{line}\n{new}",
            "repeat": f"{line}\n{line}",
            "delete": "",
        }[action]
    return "\n".join([*lines, ""]).encode("utf-8", "surrogatepass")
