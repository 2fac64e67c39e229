"""``ppafo workbench``: scenarios as one page that simulates."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from ppafo.arguments import File, Overrides, Scenario

if TYPE_CHECKING:
    from ppafo.cli.output import CommandOutput


def workbench(
    scenarios: Sequence[Scenario] = (), *, overrides: Overrides = (), out: File = Path("out/workbench.html")
) -> CommandOutput:
    """Write scenarios as one page that simulates them while sliders are dragged.

    scenarios: names of scenarios and walks, or .toml files; default: the torque task, step response and a walk
    out: the page to write; default out/workbench.html

    >>> print(workbench(["step-response"], out=Path("page.html")).text)
    written: page.html (... kB, step-response)
    """
    from ppafo.cli.output import CommandOutput, check_new_file
    from ppafo.page.html import is_page
    from ppafo.page.workbench import DEFAULT, workbench
    from ppafo.storage.files import write_file

    if not is_page(out):
        check_new_file(out)
    names = list(scenarios) or list(DEFAULT)
    page = workbench(names, overrides=overrides)
    write_file(out, page)
    document = {"file": str(out), "bytes": len(page), "scenarios": names}
    return CommandOutput(f"written: {out} ({len(page) / 1e3:.0f} kB, {', '.join(names)})", document)
