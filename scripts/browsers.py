"""Firefox, by Marionette, and WebKit, by WebKitWebDriver: both headless, both with the commands of W3C WebDriver.

Playwright drives Chromium; of these two it knows builds of its own only. A ``DrivenPage`` has what the checks of
``live_page.py`` ask of a page: ``evaluate``, ``wait_for_selector``, ``wait_for_timeout``, ``said``. It needs
``firefox-esr`` or ``firefox``, or ``WebKitWebDriver`` with its MiniBrowser and ``Xvfb``, on the path.
"""

import contextlib
import json
import os
import shutil
import signal
import socket
import subprocess
import tempfile
import time
import urllib.request
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, final

Send = Callable[[str, Mapping[str, Any]], Any]
"""Sends a command of WebDriver with its arguments, returns what came back."""

NAMES = ("firefox", "webkit")
_START_SECONDS = 120.0
_SCRIPT_MILLISECONDS = 300_000
_KEYS = {"Tab": "\ue004", "Enter": "\ue007", "ArrowLeft": "\ue012", "ArrowRight": "\ue014"}
_PATHS = {
    "Navigate": "url",
    "ExecuteAsyncScript": "execute/async",
    "SetTimeouts": "timeouts",
    "SetWindowRect": "window/rect",
    "PerformActions": "actions",
}
_CALL = """const done = arguments[arguments.length - 1];
const given = () => (SCRIPT);
Promise.resolve().then(given).then(found => typeof found === "function" ? found(arguments[0]) : found)
    .then(value => done({value}), error => done({error: String(error)}));"""
_CONSOLE = """return Services.console.getMessageArray()
    .filter(one => one instanceof Ci.nsIScriptError && /^(file|blob):/.test(one.sourceName))
    .map(one => one.errorMessage);"""


def missing(name: str) -> str:
    """Return what is missing for a browser; empty where nothing is."""
    if name == "firefox":
        return "" if _firefox() else "there is no firefox on the path"
    wanted = [program for program in ("WebKitWebDriver", "Xvfb") if shutil.which(program) is None]
    wanted += [] if _mini_browser() else ["MiniBrowser of WebKitGTK"]
    return f"there is no {' and no '.join(wanted)}" if wanted else ""


def _firefox() -> str | None:
    return shutil.which("firefox-esr") or shutil.which("firefox")


def _mini_browser() -> Path | None:
    found = sorted(Path("/usr/lib").glob("*/webkit2gtk-4.?/MiniBrowser"))
    return found[-1] if found else None


@final
class DrivenPage:
    """A page in a browser that is driven by WebDriver."""

    def __init__(self, send: Send, console: Callable[[], list[str]]) -> None:
        """``send`` sends a command, ``console`` gives what the console of the browser has said so far."""
        self._send, self._console = send, console

    @property
    def said(self) -> list[str]:
        """What the console has said of the page: errors, and in WebKit everything."""
        return self._console()

    def open(self, address: str, width: int = 1400, height: int = 1000) -> None:
        """Open an address, and wait until the page has drawn its first runs."""
        self._send("SetTimeouts", {"script": _SCRIPT_MILLISECONDS, "pageLoad": _SCRIPT_MILLISECONDS})
        self._send("SetWindowRect", {"width": width, "height": height, "x": 0, "y": 0})
        self._send("Navigate", {"url": address})
        self.wait_for_selector('[data-ready="true"]')

    def evaluate(self, script: str, given: object = None) -> Any:
        """Return the value of an expression, or of a function called with an argument; RuntimeError for a fault."""
        found = self._send("ExecuteAsyncScript", {"script": _CALL.replace("SCRIPT", script), "args": [given]})
        if "error" in found:
            raise RuntimeError(found["error"])
        return found.get("value")

    def wait_for_selector(self, selector: str, state: str = "attached") -> None:
        """Wait until the page has such an element; TimeoutError where it has none for a long time."""
        assert state == "attached", "that an element is there is all that is asked for"
        end = time.monotonic() + _START_SECONDS
        while not self.evaluate("wanted => document.querySelector(wanted) !== null", selector):
            if time.monotonic() > end:
                raise TimeoutError(f"there is no {selector}")
            time.sleep(0.02)

    def wait_for_timeout(self, milliseconds: float) -> None:
        """Wait."""
        time.sleep(milliseconds / 1000.0)

    def press(self, *keys: str) -> None:
        """Press keys, by name or letter, one after the other."""
        strokes = [{"type": kind, "value": _KEYS.get(key, key)} for key in keys for kind in ("keyDown", "keyUp")]
        self._send("PerformActions", {"actions": [{"type": "key", "id": "keyboard", "actions": strokes}]})

    def drag(self, selector: str, shares: tuple[float, ...]) -> None:
        """Drag a slider with the mouse over shares of its width, from the first to the last."""
        box = self.evaluate(
            """wanted => { const slider = document.querySelector(wanted); slider.scrollIntoView({block: "center"});
            const {left, top, width, height} = slider.getBoundingClientRect(); return [left, top, width, height]; }""",
            selector,
        )
        left, top, width, height = box
        places = [(round(left + share * width), round(top + height / 2)) for share in shares]
        moves = [{"type": "pointerMove", "duration": 30, "x": x, "y": y, "origin": "viewport"} for x, y in places]
        steps = [moves[0], {"type": "pointerDown", "button": 0}, *moves[1:], {"type": "pointerUp", "button": 0}]
        self._send("PerformActions", {"actions": [{"type": "pointer", "id": "mouse", "actions": steps}]})


@contextlib.contextmanager
def driven(name: str) -> Iterator[DrivenPage]:
    """Give a page in a headless browser, ``firefox`` or ``webkit``, for a while."""
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as place, contextlib.ExitStack() as stack:
        yield stack.enter_context((_in_firefox if name == "firefox" else _in_webkit)(Path(place)))


@contextlib.contextmanager
def _in_firefox(place: Path) -> Iterator[DrivenPage]:
    port = _free_port()
    settings = {
        "marionette.port": port,
        "browser.shell.checkDefaultBrowser": False,
        "datareporting.policy.dataSubmissionEnabled": False,
    }
    lines = [f"user_pref({json.dumps(name)}, {json.dumps(value)});" for name, value in settings.items()]
    (place / "user.js").write_text("\n".join(lines), encoding="utf-8")
    words = [
        str(_firefox()),
        "--headless",
        "--no-remote",
        "--marionette",
        "--remote-allow-system-access",
        "--profile",
        str(place),
    ]
    with _running(words, place / "log.txt"), contextlib.closing(_connected(port)) as wire:
        _received(wire)
        count = 0

        def send(command: str, given: Mapping[str, Any]) -> Any:
            nonlocal count
            count += 1
            text = json.dumps([0, count, command if ":" in command else f"WebDriver:{command}", given]).encode()
            wire.sendall(f"{len(text)}:".encode() + text)
            _, _, fault, found = _received(wire)
            return _unwrapped(fault, found)

        def console() -> list[str]:
            send("Marionette:SetContext", {"value": "chrome"})
            said = send("ExecuteScript", {"script": _CONSOLE, "args": []})
            send("Marionette:SetContext", {"value": "content"})
            return list(said)

        send("NewSession", {"capabilities": {"alwaysMatch": {"unhandledPromptBehavior": "dismiss"}}})
        yield DrivenPage(send, console)


@contextlib.contextmanager
def _in_webkit(place: Path) -> Iterator[DrivenPage]:
    port, log = _free_port(), place / "log.txt"
    options = {
        "binary": str(_mini_browser()),
        "args": ["--automation", "--enable-write-console-messages-to-stdout=true"],
    }
    match = {"alwaysMatch": {"webkitgtk:browserOptions": options}}
    with _display(place) as display:
        words = [str(shutil.which("WebKitWebDriver")), f"--port={port}"]
        with _running(
            words,
            log,
            {"DISPLAY": display, "WEBKIT_DISABLE_SANDBOX_THIS_IS_DANGEROUS": "1", "XDG_RUNTIME_DIR": str(place)},
        ):
            _connected(port).close()
            base = f"http://127.0.0.1:{port}/session"
            session = f"{base}/{_posted(base, {'capabilities': match})['sessionId']}"

            def send(command: str, given: Mapping[str, Any]) -> Any:
                return _posted(f"{session}/{_PATHS[command]}", given)

            def console() -> list[str]:
                lines = log.read_text(encoding="utf-8", errors="replace").splitlines()
                return [line for line in lines if line.startswith("CONSOLE")]

            try:
                yield DrivenPage(send, console)
            finally:
                urllib.request.urlopen(urllib.request.Request(session, method="DELETE"), timeout=20).close()


@contextlib.contextmanager
def _display(place: Path) -> Iterator[str]:
    """Give a display without a screen."""
    told, tells = os.pipe()
    words = [str(shutil.which("Xvfb")), "-displayfd", str(tells), "-screen", "0", "1600x1200x24", "-nolisten", "tcp"]
    with _running(words, place / "display.txt", handed=(tells,)):
        os.close(tells)
        with os.fdopen(told) as number:
            yield f":{number.readline().strip()}"


@contextlib.contextmanager
def _running(
    words: list[str], log: Path, given: Mapping[str, str] | None = None, handed: tuple[int, ...] = ()
) -> Iterator[None]:
    """Run a program with all that it starts, and end them."""
    with log.open("wb") as told:
        program = subprocess.Popen(
            words,
            stdout=told,
            stderr=subprocess.STDOUT,
            env={**os.environ, **(given or {})},
            pass_fds=handed,
            start_new_session=True,
        )
        try:
            yield
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(program.pid, signal.SIGTERM)
            try:
                program.wait(timeout=20)
            except subprocess.TimeoutExpired:
                os.killpg(program.pid, signal.SIGKILL)
                program.wait()


def _free_port() -> int:
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return int(found.getsockname()[1])


def _connected(port: int) -> socket.socket:
    """Connect as soon as somebody listens."""
    end = time.monotonic() + _START_SECONDS
    while True:
        try:
            return socket.create_connection(("127.0.0.1", port), timeout=_SCRIPT_MILLISECONDS / 1000.0)
        except ConnectionRefusedError:
            if time.monotonic() > end:
                raise
            time.sleep(0.1)


def _received(wire: socket.socket) -> Any:
    """Return the next message of Marionette: its length, a colon, JSON."""
    head = b""
    while not head.endswith(b":"):
        head += wire.recv(1)
    left, parts = int(head[:-1]), []
    while left:
        parts.append(wire.recv(min(left, 1 << 20)))
        left -= len(parts[-1])
    return json.loads(b"".join(parts))


def _posted(address: str, given: Mapping[str, Any]) -> Any:
    request = urllib.request.Request(address, json.dumps(given).encode(), {"Content-Type": "application/json"})
    with urllib.request.urlopen(request, timeout=_SCRIPT_MILLISECONDS / 1000.0) as answer:
        return json.load(answer)["value"]


def _unwrapped(fault: Mapping[str, Any] | None, found: Any) -> Any:
    if fault is not None:
        raise RuntimeError(f"{fault['error']}: {fault['message']}")
    return found["value"] if isinstance(found, dict) and set(found) == {"value"} else found
