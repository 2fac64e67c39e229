"""``ppafo workbench SCENARIO...``: scenarios and walks as one page that simulates in the browser."""

from collections.abc import Sequence
from pathlib import Path

from ppafo.cli import output
from ppafo.cli.output import Said


def write_workbench(names: Sequence[str], overrides: Sequence[str], out: Path) -> Said:
    """Write a page, in the place of an earlier one of this command but of no other file."""
    from ppafo.live.page import is_page
    from ppafo.live.workbench import DEFAULT, workbench
    from ppafo.storage.files import write_file

    if not is_page(out):
        output.check_new_file(out)
    scenarios = list(names) or list(DEFAULT)
    page = workbench(scenarios, overrides)
    write_file(out, page)
    document = {"file": str(out), "bytes": len(page), "scenarios": scenarios}
    return Said(f"written: {out} ({len(page) / 1e3:.0f} kB, {', '.join(scenarios)})", document)
