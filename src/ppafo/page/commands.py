"""``ppafo workbench``: scenarios as one page that simulates."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ppafo.arguments import File, Overrides, Scenario

if TYPE_CHECKING:
    from ppafo.cli.output import CommandOutput

_MARK = b'content="ppafo workbench"'


def workbench(
    scenarios: Sequence[Scenario] = (),
    *,
    overrides: Overrides = (),
    sliders: Sequence[str] = (),
    out: File = Path("out/workbench.html"),
) -> CommandOutput:
    """Write scenarios as one page that simulates them while sliders are dragged.

    scenarios: names of scenarios and walks, or .toml files; default: the torque task with both valves
    sliders: settings that come first, such as valve.area
    out: the page to write; default out/workbench.html

    >>> print(workbench(["step-response"], out=Path("page.html")).text)
    written: page.html (... kB, step-response)
    """
    from ppafo.cli.output import CommandOutput, check_new_file
    from ppafo.page.workbench import DEFAULT, workbench
    from ppafo.storage.files import write_file

    # A page may be written again; another file is not lost.
    if not (out.is_file() and _MARK in out.read_bytes()[:2000]):
        check_new_file(out)
    names = list(scenarios) or list(DEFAULT)
    page = workbench(names, overrides=overrides, sliders=sliders)
    write_file(out, page)
    document = {"file": str(out), "bytes": len(page), "scenarios": names}
    return CommandOutput(f"written: {out} ({len(page) / 1e3:.0f} kB, {', '.join(names)})", document)
