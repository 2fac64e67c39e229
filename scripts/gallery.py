"""Writes the ready workbenches of ``live/gallery.toml`` as pages: ``python scripts/gallery.py out/gallery``."""

import argparse
from pathlib import Path

from ppafo.live.workbench import gallery
from ppafo.storage.files import write_file


def main() -> int:
    """Write all of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", nargs="?", type=Path, default=Path("out/gallery"))
    folder = parser.parse_args().folder
    for name, page in gallery().items():
        print(write_file(folder / name, page))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
