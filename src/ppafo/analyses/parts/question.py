"""Public function ``parts``: catalogue of real parts."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ppafo.arguments import Word, checked

if TYPE_CHECKING:
    from ppafo.analyses.parts.answer import Parts
    from ppafo.report.finding import Finding


@checked
def parts(
    part: Annotated[str, Word("PART")] | None = None, *, catalogue: Annotated[str | Path, Word("FILE")] = "parts"
) -> Finding[Parts]:
    """List real parts with the origin of every figure.

    Arguments:
        part: name of a part, for all its figures and their sources
        catalogue: a .toml file; default: the catalogue of the package

    Returns:
        a Finding whose ``found`` is the Parts: the catalogue, and the part if it is named

    Raises:
        ParameterError: a part that does not exist, or a catalogue that cannot be used

    >>> import ppafo
    >>> ppafo.parts("festo-mpye-5-m5-010-b").said[0]
    'festo-mpye-5-m5-010-b: Festo MPYE-5-M5-010-B (valves, proportional)'
    """
    from ppafo.analyses.parts.answer import finding_of_catalogue, finding_of_part
    from ppafo.errors import ParameterError
    from ppafo.parameters.parts import load_catalogue
    from ppafo.wording import known_names

    loaded = load_catalogue(catalogue)
    if part is None:
        return finding_of_catalogue(loaded)
    by_name = {known.name: known for known in loaded.parts}
    if part not in by_name:
        raise ParameterError(f"{loaded.file}: there is no part '{part}'{known_names(part, by_name)}")
    return finding_of_part(loaded, by_name[part])
