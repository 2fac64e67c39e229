"""The default page in a file, and a headless Chromium that opens it."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ppafo.page.workbench import workbench
from scripts.live_page import browser


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("page") / "workbench.html"
    made.write_bytes(workbench())
    return made


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    with browser() as found:
        yield found
