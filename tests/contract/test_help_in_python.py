"""Help of every public name, as ``help()`` prints it."""

import inspect
import pydoc
import re

import pytest

import ppafo

MOST_USED = (
    "simulate",
    "simulate_many",
    "compare",
    "tune",
    "find",
    "sweep",
    "identify",
    "validate",
    "walk",
    "design",
    "read_recording",
    "evaluate",
    "load_device",
    "load_scenario",
    "bottle",
    "linearise",
    "parts",
    "reproduce",
    "sensitivity",
)


@pytest.mark.parametrize("name", ppafo.__all__)
def test_help_of_a_public_name_shows_plain_types_and_no_object_of_the_interpreter(name: str) -> None:
    text = pydoc.plain(pydoc.render_doc(getattr(ppafo, name)))
    # Python lists what a NamedTuple is made of as data of the class, a function of typing.
    lines = [line for line in text.splitlines() if "__orig_bases__" not in line]
    assert [line for line in lines if re.search(r"Annotated|<function|object at 0x|<factory>|Word\(", line)] == []


def test_a_signature_has_names_of_classes_and_functions_alone() -> None:
    assert str(inspect.signature(ppafo.simulate)) == (
        "(scenario: Scenario | str | Path, overrides: Mapping[str, Any] | Iterable[str] = (), *, "
        "plugins: Iterable[str | Path] = ()) -> Result"
    )
    assert "progress: Callable[[float, float], None] = silent" in str(inspect.signature(ppafo.walk))


@pytest.mark.parametrize("name", MOST_USED)
def test_help_of_a_function_that_is_much_used_lists_every_argument_what_it_returns_and_raises(name: str) -> None:
    function = getattr(ppafo, name)
    paragraphs = dict.fromkeys(("Arguments", "Returns", "Raises"), "")
    for paragraph in (inspect.getdoc(function) or "").split("\n\n"):
        heading, _, below = paragraph.partition(":\n")
        if heading in paragraphs:
            paragraphs[heading] = below
    said = re.findall(r"^ {4}(\w+): ", paragraphs["Arguments"], re.MULTILINE)
    assert sorted(said) == sorted(inspect.signature(function).parameters)
    assert paragraphs["Returns"]
    assert all(hasattr(ppafo, error) for error in re.findall(r"^ {4}(\w+): ", paragraphs["Raises"], re.MULTILINE))
    assert paragraphs["Raises"]
