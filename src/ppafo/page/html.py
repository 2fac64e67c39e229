"""HTML file of a page: content, modules, script and style, with a strict content security policy."""

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
"""Length of the start of a page that contains its generator mark [bytes]."""


def bundled(name: str) -> str:
    """Read a bundled script (``loader.js``, ``page.js``) or ``page.css``, built from ``page/`` of the repository."""
    return files("ppafo.page").joinpath("bundle", name).read_text(encoding="utf-8").strip()


def is_page(path: Path) -> bool:
    """Return whether a file is a page of this program, which may be overwritten."""
    try:
        # A pipe would be waited for.
        if not path.is_file():
            return False
        with path.open("rb") as file:
            return _MARK in file.read(_MARKED)
    except OSError:
        return False


def page_of(title: str, content: Mapping[str, Any], modules: Mapping[str, str], still: str) -> bytes:
    """Return the HTML of a page; ``modules`` maps names in the content to packed programs.

    ``still`` is an SVG picture for browsers without scripts.
    """
    script, style = bundled("loader.js"), bundled("page.css")
    policy = _POLICY.format(script=digest(script), style=digest(style))
    filled = _PAGE.format(
        policy=policy, title=escape(title), style=style, script=script, data=data_of(content, modules), still=still
    )
    return filled.encode()


def block_of(content: Mapping[str, Any], modules: Mapping[str, str]) -> tuple[str, str]:
    """Return an HTML block to embed (container, data, style, script), and the security policy for its page.

    The policy allows this script and inline styles, and no network access.
    """
    place, script = '<div id="workbench"></div>', bundled("loader.js")
    style = f"<style>{bundled('page.css')}</style>"
    policy = _POLICY.format(script=digest(script), style="").replace("'sha256-'", "'unsafe-inline'")
    return "\n".join([style, place, data_of(content, modules), f"<script>{script}</script>"]), policy


def data_of(content: Mapping[str, Any], modules: Mapping[str, str]) -> str:
    """Return the HTML elements of script, content and programs, compressed in base 85."""
    text = json.dumps(content, ensure_ascii=False, separators=(",", ":"))
    texts = {SCRIPT: packed_once(bundled("page.js").encode()), CONTENT: packed(text.encode()), **modules}
    return "\n".join(f'<script type="text/plain" id="{escape(name)}">{text}</script>' for name, text in texts.items())


def digest(text: str) -> str:
    """Return the SHA-256 of a script or style in the form of a content security policy."""
    return base64.b64encode(hashlib.sha256(text.encode()).digest()).decode("ascii")


def packed_once(content: bytes) -> str:
    """Compress content shared by many pages to base-85 text, cached on disk."""
    return kept_bytes("packed", hashlib.sha256(content).hexdigest(), lambda: packed(content).encode()).decode()


def packed(content: bytes) -> str:
    """Compress bytes to base-85 text, which cannot end its HTML element."""
    # Without the time of packing: the same content gives the same page.
    return base64.b85encode(gzip.compress(content, 9, mtime=0)).decode("ascii")
