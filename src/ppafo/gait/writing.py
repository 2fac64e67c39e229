"""A gait as the text of a gait file."""

import json
from collections.abc import Iterator

from ppafo.gait.gait import CURVES, Curve, Gait, plain_unit
from ppafo.units import from_si

WRITTEN_UNITS: dict[str, str] = {"rad": "deg"}
"""Angles are written in degrees; every other curve in its own unit."""

_DIGITS = 12
"""Written of a coefficient; degrees made of radians carry noise behind these."""


def gait_toml(gait: Gait) -> str:
    """Return the text of a gait file; reading it back gives the same gait, to rounding of the angles."""
    return "\n".join(_lines(gait)) + "\n"


def _lines(gait: Gait) -> Iterator[str]:
    yield "schema_version = 1"
    texts = {"name": gait.name, "title": gait.title, "origin": gait.origin, "source": gait.source, "notes": gait.notes}
    yield from (f"{key} = {_text(value)}" for key, value in texts.items() if value)
    yield from ("", "[subject]", f'body_mass = "{gait.body_mass!r} kg"')
    if gait.stature is not None:
        yield f'stature = "{gait.stature!r} m"'
    for key in ("walking_speed", "recorded_speed"):
        speed = getattr(gait, key)
        if speed is not None:
            yield f'{key} = "{speed!r} m/s"'
    yield from ("", "[stride]", f'time = "{gait.stride_time!r} s"', f'stance_share = "{gait.stance_share!r}"')
    if gait.stride_time_deviation:
        yield f'time_deviation = "{gait.stride_time_deviation!r} s"'
    if gait.stance_share_deviation:
        yield f'stance_share_deviation = "{gait.stance_share_deviation!r}"'
    yield f"count = {gait.strides}"
    for name, curve in gait.curves.items():
        yield from ("", f"[{name}]", *_series(curve, CURVES[name]))


def _series(curve: Curve, si_unit: str) -> Iterator[str]:
    unit = WRITTEN_UNITS.get(si_unit, si_unit)

    def number_text(value: float) -> str:
        return repr(float(f"{from_si(value, plain_unit(unit), plain_unit(si_unit)):.{_DIGITS}g}"))

    yield f"unit = {_text(unit)}"
    yield f"mean = {number_text(curve.mean)}"
    yield f"cosine = [{', '.join(map(number_text, curve.cosines))}]"
    yield f"sine = [{', '.join(map(number_text, curve.sines))}]"
    yield f"deviation = {number_text(curve.deviation)}"


def _text(text: str) -> str:
    """Return a basic string of TOML; what JSON escapes is escaped in the same way there, but for DEL."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")
