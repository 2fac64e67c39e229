"""States of the page that simulates, random, hard and damaged ones, and whether page and Python refuse the same.

Each setting gets values at and beyond both ends of its range, nothing, tiny, huge and negative ones, and texts that are
no numbers; then the settings of each relation are put the wrong way round, and draws set several at once. The page says
whether it opens and runs a state; Python loads the scenario with the same overrides, and the file that the page writes
of a state which it runs. ``live_page.py`` asks for them.
"""

import math
import random
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from ppafo.errors import PpafoError
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.plan import plan_run
from ppafo.walking.loading import load_walk

_TEXTS = (
    "nan",
    "inf",
    "-inf",
    "1_000",
    "0x10",
    "1,5",
    "+5",
    ".5",
    "5.",
    "1e400",
    "-0",
    "five",
    "1e-320",
    "\u0665",
    "5 5",
)
_SIZES = (0.0, 1e-300, 1e-12, 1e12, 1e300)
MOST_STEPS = 100_000
"""Steps of a run that is tried; longer ones only take time."""
AT_ONCE = 50
"""States that the page judges before it is asked for more: its browser takes one that works for minutes for dead."""
_SHORT = {"scenario": "0.1 s", "walk": "6 s"}
_TIMES = ("run.duration", "run.step", "run.output_interval", "controller.period")

_VERDICTS = """addresses => addresses.map(address => {
    const refused = workbench.open(address);
    if (refused) return {refused, scenario: ""};
    const values = workbench.values(0);
    if (values["run.duration"] / Math.min(values["run.step"], values["run.output_interval"]) > MOST) return null;
    const run = workbench.run(0);
    const refusal = run.ending === "refused" ? run.fault : "";
    return {refused: refusal, isFull: run.ending === "no memory", scenario: workbench.scenario(0)};
})""".replace("MOST", str(MOST_STEPS))

Changes = dict[str, str]


def random_changes(program: Mapping[str, Any], rng: random.Random) -> dict[str, str]:
    """Return texts for some settings, anywhere on their sliders; times so that samples divide the run."""
    changes = {}
    share = rng.choice((0.1, 0.3, 0.8))
    for setting in program["settings"]:
        key, (low, high) = setting["key"], setting["slider"]
        if setting["kept"] == "zero" or rng.random() > share:
            continue
        value = rng.uniform(low, high)
        number = f"{int(value)}" if key.endswith(".seed") else f"{value:.{rng.randint(6, 12)}g}"
        changes[key] = f"{number} {setting['shown']}".strip()
    for key in ("run.step", "run.output_interval", "controller.period"):
        changes.pop(key, None)
    shortest, longest = (50, 1500) if program["kind"] == "scenario" else (6000, 9000)
    changes["run.duration"] = f"{rng.randint(shortest, longest)} ms"
    return changes


def address_of(tab: int, program: str, changes: Mapping[str, str]) -> str:
    """Return the address of a state with one configuration."""
    texts = ";".join([program, *(f"{key}={text}" for key, text in changes.items())])
    return f"tab={tab}&{tab}={texts.replace('%', '%25').replace('+', '%2B').replace('&', '%26')}"


def hard_states(
    program: Mapping[str, Any], units: Mapping[str, Any], draws: int, rng: random.Random
) -> Iterator[Changes]:
    """Hard states of a program, as texts by key."""
    settings = {one["key"]: one for one in program["settings"]}
    for key, setting in settings.items():
        texts = _TEXTS if not key.endswith(".seed") else ()
        for number in (*texts, *map(repr, _numbers(setting, units))):
            yield {key: f"{number} {setting['shown']}".strip()}
        if setting["shown"]:
            yield {key: repr(setting["slider"][1])}
            yield {key: f"{setting['slider'][1]!r} {'s' if setting['shown'] != 's' else 'Pa_a'}"}
    for one in program["relations"]:
        left, right = settings.get(one["key"]), settings.get(one["other"])
        if left is not None and right is not None:
            for share in (0.9, 1.0, 1.0 + 1e-7, 1.1):
                yield {left["key"]: f"{right['value'] * share!r} {left['unit']}".strip()}
                yield {right["key"]: f"{left['value'] / share!r} {right['unit']}".strip()}
    for times in _times(rng, draws):
        yield {key: f"{value!r} s" for key, value in times.items() if key in settings}
    for _ in range(draws):
        chosen = rng.sample(sorted(settings), min(len(settings), rng.randint(2, 6)))
        yield {
            key: f"{rng.choice(_numbers(settings[key], units))!r} {settings[key]['shown']}".strip() for key in chosen
        }


def _numbers(setting: Mapping[str, Any], units: Mapping[str, Any]) -> list[float]:
    """Numbers in the unit that is shown: round the ends, nothing, tiny, huge, negative, and some on the slider."""
    scale = next(one for one in units[setting["unit"]] if one["unit"] == setting["shown"])
    zero = 101325.0 if scale["isGauge"] else 0.0
    ends = [
        (end - zero - float(scale["offset"])) / float(scale["scale"])
        for end in (setting["low"], setting["high"])
        if end is not None
    ]
    near = [
        number
        for end in ends
        for number in (
            end,
            math.nextafter(end, -math.inf),
            math.nextafter(end, math.inf),
            end * 1.01 - 0.01,
            end * 0.99 + 0.01,
        )
    ]
    low, high = setting["slider"]
    inside = [low, high, 0.5 * (low + high), 0.3 * low + 0.7 * high, -high, 3.0 * high]
    return [*near, *inside, *_SIZES, *(-size for size in _SIZES[1:])]


def _times(rng: random.Random, draws: int) -> Iterator[dict[str, float]]:
    """Times that divide each other or do not."""
    for _ in range(draws):
        step = rng.choice((1e-3, 5e-4, 1e-4, 7e-4))
        yield {
            "run.duration": rng.choice((1.0, 0.5, 0.35, 0.7001)),
            "run.step": step,
            "run.output_interval": step * rng.choice((0.5, 1.0, 2.0, 2.5, 10.0, 1e4)),
            "controller.period": step * rng.choice((0.5, 1.0, 2.0, 2.5, 3.0, 10.0, 1e4)),
        }


def python_refusal(program: Mapping[str, Any], overrides: Sequence[str], file: Path | None = None) -> str:
    """What Python says of a scenario with overrides, or of a file; empty where it takes it."""
    name = program["name"] if file is None else str(file)
    try:
        if program["kind"] == "walk":
            load_walk(name, overrides)
        else:
            plan_run(load_scenario(name, overrides))
    except PpafoError as error:
        return str(error)
    return ""


def disagreements(page: Any, tab: int, program: Mapping[str, Any], given: Sequence[Changes], folder: Path) -> list[str]:
    """States of which page and Python do not say the same."""
    shortened = [{"run.duration": _SHORT[program["kind"]], **one} for one in given]
    page.evaluate("address => workbench.open(address)", address_of(tab, program["name"], {}))
    while page.evaluate("workbench.run(0) === null"):
        page.wait_for_timeout(20)
    addresses = [address_of(tab, program["name"], one) for one in shortened]
    verdicts = [
        verdict
        for first in range(0, len(addresses), AT_ONCE)
        for verdict in page.evaluate(_VERDICTS, addresses[first : first + AT_ONCE])
    ]
    found, file = [], folder / "state.toml"
    for one, changes, verdict in zip(given, shortened, verdicts, strict=True):
        if verdict is None or verdict.get("isFull") or "different compiled program" in verdict["refused"]:
            continue
        if verdict["refused"]:
            # The file of a walk has no length: only the page can refuse one.
            texts = [f"{key}={text}" for key, text in changes.items() if not is_of_page(program, key)]
            said = python_refusal(program, texts)
            if not said and not any(is_of_page(program, key) for key in one):
                found.append(f"{program['name']}: only the page refuses {changes}: {verdict['refused']}")
            continue
        file.write_text(verdict["scenario"], encoding="utf-8")
        said = python_refusal(program, (), file)
        if said:
            found.append(f"{program['name']}: only Python refuses {changes}: {said}")
    return found


def is_of_page(program: Mapping[str, Any], key: str) -> bool:
    """Whether only the page knows a setting: the file of a walk has no length."""
    return program["kind"] == "walk" and key in ("run.duration", "run.output_interval")


def mutated(text: str, rng: random.Random) -> str:
    """Return a text with some damage: cut, doubled, letters changed, lines moved."""
    kind = rng.randrange(6)
    at = rng.randrange(len(text))
    if kind == 0:
        return text[:at]
    if kind == 1:
        return text[:at] + text[at + rng.randint(1, 30) :]
    if kind == 2:
        return text[:at] + rng.choice("\0\"'{}[],;:=%#é\n\t-e9") * rng.randint(1, 5) + text[at:]
    if kind == 3:
        lines = text.split("\n")
        rng.shuffle(lines)
        return "\n".join(lines)
    if kind == 4:
        return text.replace(rng.choice(text), rng.choice("0aZ,;\n[]"), rng.randint(1, 8))
    return text * 2
