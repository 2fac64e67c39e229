"""The file that a browser opens: content, modules, script and style in one page with a strict policy."""

import base64
import gzip
import hashlib
import json
from collections.abc import Mapping
from html import escape
from importlib.resources import files
from pathlib import Path
from typing import Any

from ppafo.engine.cache.texts import kept_bytes

_POLICY = (
    "default-src 'none'; script-src 'sha256-{script}' 'strict-dynamic' 'wasm-unsafe-eval'; style-src 'sha256-{style}'; "
    "worker-src blob:; img-src data: blob:; base-uri 'none'; form-action 'none'"
)
_PAGE = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<meta name="generator" content="ppafo workbench">
<title>{title}</title>
<link rel="icon" href="data:,">
<style>{style}</style>
</head>
<body class="live-page">
<div id="workbench"><noscript><h1>{title}</h1>
<p>This page simulates in the browser and needs JavaScript for it. This is what it opens with:</p>
{still}</noscript></div>
{data}
<script>{script}</script>
</body>
</html>
"""
SCRIPT, CONTENT = "workbench-script", "workbench-content"
_MARK = b'content="ppafo workbench"'
_MARKED = 2000
"""Bytes from the beginning in which a page says what made it."""


def bundled(name: str) -> str:
    """Return a script (``loader.js``, ``page.js``) or ``page.css``; their source is ``page/`` of the repository."""
    return files("ppafo.page").joinpath("bundle", name).read_text(encoding="utf-8").strip()


def is_page(path: Path) -> bool:
    """Tell whether a file is such a page, which may be written anew."""
    try:
        # A pipe would be waited for.
        if not path.is_file():
            return False
        with path.open("rb") as file:
            return _MARK in file.read(_MARKED)
    except OSError:
        return False


def page_of(title: str, content: Mapping[str, Any], modules: Mapping[str, str], still: str) -> bytes:
    """Return a page; ``modules`` has the packed programs by the name that the content has for them.

    ``still`` is the picture, as SVG, for readers whose browser runs no scripts.
    """
    script, style = bundled("loader.js"), bundled("page.css")
    policy = _POLICY.format(script=digest(script), style=digest(style))
    filled = _PAGE.format(
        policy=policy, title=escape(title), style=style, script=script, data=data_of(content, modules), still=still
    )
    return filled.encode()


def block_of(content: Mapping[str, Any], modules: Mapping[str, str]) -> tuple[str, str]:
    """Return a part of a page, place, data, style and script, and the policy that the page has in its head.

    That allows the one script, nothing fetched, and styles of the page's own.
    """
    place, script = '<div id="workbench"></div>', bundled("loader.js")
    style = f"<style>{bundled('page.css')}</style>"
    policy = _POLICY.format(script=digest(script), style="").replace("'sha256-'", "'unsafe-inline'")
    return "\n".join([style, place, data_of(content, modules), f"<script>{script}</script>"]), policy


def data_of(content: Mapping[str, Any], modules: Mapping[str, str]) -> str:
    """Return the elements that hold the script and what it reads, content and programs: compressed, in base 85."""
    text = json.dumps(content, ensure_ascii=False, separators=(",", ":"))
    texts = {SCRIPT: packed_once(bundled("page.js").encode()), CONTENT: packed(text.encode()), **modules}
    return "\n".join(f'<script type="text/plain" id="{escape(name)}">{text}</script>' for name, text in texts.items())


def digest(text: str) -> str:
    """Return the SHA-256 of a script or style as a policy names it."""
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")


def packed_once(content: bytes) -> str:
    """Return content that many pages hold, compressed, in base 85; from the disk where it was packed before."""
    return kept_bytes("packed", hashlib.sha256(content).hexdigest(), lambda: packed(content).encode()).decode()


def packed(content: bytes) -> str:
    """Return bytes as a page holds them: compressed, in base 85; no such text can end the element that it is in."""
    # Without the time of packing: the same content gives the same page.
    return base64.b85encode(gzip.compress(content, 9, mtime=0)).decode("ascii")
