"""Documents, help texts, messages and the texts of shipped files use the words of the field."""

import ast
import re
from collections.abc import Iterator, Mapping
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SOURCE = ROOT / "src" / "ppafo"
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "SECURITY.md")),
    *sorted((ROOT / "docs").rglob("*.md")),
]
PRIVATE_WORDS = (
    "answers?",
    "attitudes?",
    "chatters?",
    "chips?",
    "comes? down",
    "courses?",
    "dump",
    "free vanes?",
    "hangs? (?:the device )?on",
    "held",
    "hunts?",
    "judge[ds]?",
    "lanes?",
    "left open",
    "planted",
    "printed",
    "quantum",
    "takes? back",
    "that of",
    "those of",
    "time in the stride",
    "virtual rig",
    "volume per angle",
    "whole numbers?",
    "worlds",
    "worn",
    "woven",
)
"""Words of our own for which the field has others; names of files and keys, in code or links, may have them."""
ALLOWED_IN_PAGES: Mapping[str, tuple[str, str]] = {
    "SECURITY.md": ("answer", "a reply to a person"),
    "docs/architecture.md": ("lane|lanes|pieces", "lanes of a processor, in the engine"),
    "docs/decisions/0001-batched-runs.md": ("lanes", "lanes of a processor, in the engine"),
    "docs/evidence.md": ("FitVariable vanes|answered", "a group of benchmarks, by its name"),
    "docs/measured.md": ("printed", "by a 3D printer"),
}
"""By page: words that stand there for something else, and for what."""

COMPOSED = ("engine/", "translation/")
"""Strings there are source text, in which a lane is a lane of a processor."""
SOMETHING_ELSE = ("answers?", "whole numbers?")
"""Words that messages need for something else: an answer of a board, 'must be a whole number'."""
ALLOWED_IN_MESSAGES: Mapping[str, tuple[str, str]] = {
    "analyses/endurance/walk_gas.py": ("'course'", "the old key of a walk"),
    "exports/c_library/program.py": ("'course'|course=", "source text, in which it is the time course of a reference"),
    "identification/trajectory/layout.py": ("held: is now locked", "the old key of a problem file"),
}
"""By file: what stands there as a name, and of what."""
ALLOWED_IN_FILES: Mapping[str, tuple[str, str]] = {
    "examples/measured-cylinder/chamber.toml": ("3D-printed", "by a 3D printer"),
    "parameters/sets/cylinder-lever.toml": ("3D-printed", "by a 3D printer"),
    "parameters/bottles/files/paper-co2-9oz.toml": ("Worn against the body", "a bottle that somebody wears"),
    "parameters/parts/catalogues/parts.toml": ("worn at the waist", "a bottle that somebody wears"),
    "rig/presets/worn-seals.toml": ("worn seals", "by wear"),
}
"""By shipped file: what stands there for something else, and for what."""


def private(text: str, words: tuple[str, ...] = PRIVATE_WORDS) -> list[str]:
    """Words of our own in a text."""
    return re.findall(rf"(?<![\w.-])(?:{'|'.join(words)})(?![\w-])", text, re.IGNORECASE)


def prose(page: Path) -> str:
    """A page without code, links and blocks."""
    text = page.read_text(encoding="utf-8")
    return re.sub(r"```.*?```|`[^`]*`|\]\([^)]*\)|^ {4}.*$", "", text, flags=re.DOTALL | re.MULTILINE)


def without(allowed: Mapping[str, tuple[str, str]], name: str, text: str) -> str:
    """A text less the words that are allowed in its file."""
    return re.sub(allowed[name][0], "", text) if name in allowed else text


def messages(path: Path) -> Iterator[str]:
    """Texts of several words in a module: messages, captions and descriptions; of commands their help too."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    bodies = [node.body for node in ast.walk(tree) if isinstance(getattr(node, "body", None), list)]
    docstrings = {id(item.value) for body in bodies for item in body if isinstance(item, ast.Expr)}
    texts = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and isinstance(node.value, str)]
    for node in texts:
        if " " in node.value.strip() and (id(node) not in docstrings or "verbs" in path.parts):
            yield node.value


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_documents_use_the_words_of_the_field(page: Path) -> None:
    name = page.relative_to(ROOT).as_posix()
    assert private(without(ALLOWED_IN_PAGES, name, prose(page))) == []


def test_help_and_messages_use_the_words_of_the_field() -> None:
    words = tuple(word for word in PRIVATE_WORDS if word not in SOMETHING_ELSE)
    found = []
    for path in sorted(SOURCE.rglob("*.py")):
        name = path.relative_to(SOURCE).as_posix()
        if not name.startswith(COMPOSED):
            texts = (without(ALLOWED_IN_MESSAGES, name, text) for text in messages(path))
            found += [f"{name}: {word} in {text!r}" for text in texts for word in private(text, words)]
    assert found == []


def test_texts_of_shipped_files_use_the_words_of_the_field() -> None:
    words = tuple(word for word in PRIVATE_WORDS if word not in SOMETHING_ELSE)
    found = []
    for path in sorted(SOURCE.rglob("*.toml")):
        name = path.relative_to(SOURCE).as_posix()
        text = re.sub(r'"[\w.-]+"', "", without(ALLOWED_IN_FILES, name, path.read_text(encoding="utf-8")))
        found += [f"{name}: {word}" for word in private(text, words)]
    assert found == []


def test_a_word_of_our_own_is_found() -> None:
    assert private("The vane is held while the printed value, that of the lanes, stays; `held`-up") == [
        "held",
        "printed",
        "that of",
        "lanes",
        "held",
    ]
