"""Suggestions for a missing column: same joint, marker and side in a different spelling."""

import difflib
import re
from collections.abc import Iterable

_NEAR_WORD, _NEAR_WHOLE = 0.75, 0.85
_PLUG_IN = re.compile(r"[RL][A-Z]\w*")
"""Pattern of a Plug-in Gait marker or output: side and name."""
_AXIS = re.compile(r"(.*)\.([xyz])")


def nearest_column(missing: str, known: Iterable[str]) -> str:
    """Return ``, did you mean 'ankle_angle_r'?``, or an empty text without a column of the same kind, side and axis.

    All words of a name must be similar and the side must match: RKNE is not similar to RTOE, nor a knee to an ankle.
    """
    near = [(likeness, name) for name in known if (likeness := _likeness(missing, name)) > 0.0]
    return f", did you mean '{max(near)[1]}'?" if near else ""


def _likeness(missing: str, name: str) -> float:
    """Return the similarity of two names [-], 0 if they cannot have the same meaning."""
    parts = (match.groups() if (match := _AXIS.fullmatch(text)) else (text, "") for text in (missing, name))
    (wanted, axis), (found, other_axis) = parts
    if axis != other_axis:
        return 0.0
    (words, side), (others, other_side) = _words(wanted), _words(found)
    if side != other_side:
        # The same of the other foot says that only that one was recorded.
        return float(words == others)
    if len(words) == len(others) > 1:
        ratios = [_ratio(*pair) for pair in zip(words, others, strict=True)]
        return min(ratios) if min(ratios) >= _NEAR_WORD else 0.0
    whole = _ratio("".join(words), "".join(others))
    return whole if whole >= _NEAR_WHOLE else 0.0


def _words(name: str) -> tuple[list[str], str]:
    """Return the words of a name without its side, and the side: r, l or empty."""
    words: list[str] = re.findall(r"[a-z]+|\d+", name.lower())
    for index, word in enumerate(words):
        if word in ("r", "right", "l", "left"):
            return [*words[:index], *words[index + 1 :]], word[0]
    if _PLUG_IN.fullmatch(name):
        return [words[0][1:], *words[1:]], words[0][0]
    return words, ""


def _ratio(word: str, other: str) -> float:
    # Of words of three or four letters, as RKNE and RANK without their side, none is near another.
    if min(len(word), len(other)) < 4:
        return float(word == other)
    return difflib.SequenceMatcher(None, word, other).ratio()
