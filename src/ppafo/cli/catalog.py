"""The subcommands and what each does. Module ``ppafo.cli.NAME`` holds each one."""

from ppafo.questions.catalogue import QUESTIONS

COMMANDS: dict[str, str] = {
    "reproduce": QUESTIONS["reproduce"],
    "simulate": "run a scenario and write its recording, metrics and figure",
    "workbench": "write scenarios as one page that simulates them while sliders are dragged",
    "unreported": QUESTIONS["unreported"],
    "sweep": QUESTIONS["sweep"],
    "compare": QUESTIONS["compare"],
    "sensitivity": QUESTIONS["sensitivity"],
    "montecarlo": QUESTIONS["montecarlo"],
    "find": QUESTIONS["find"],
    "tune": QUESTIONS["tune"],
    "linearise": QUESTIONS["linearise"],
    "walk": QUESTIONS["walk"],
    "league": QUESTIONS["league"],
    "timing": QUESTIONS["timing"],
    "validate": QUESTIONS["validate"],
    "record": "record a bench that speaks the protocol of 'ppafo hil'",
    "rig": "record synthetic bench data on the virtual test rig",
    "identify": QUESTIONS["identify"],
    "gait": "list, show and import gaits; export recordings for OpenSim",
    "endurance": QUESTIONS["endurance"],
    "design": QUESTIONS["design"],
    "size": QUESTIONS["size"],
    "new": "write an input file to start from: a template, or a copy of a shipped one",
    "examples": "list the examples of the how-to pages, or write one into a folder, ready to run",
    "plot": "redraw the figures of a result folder",
    "sets": "list parameter sets, or show one with the source of every value",
    "parts": QUESTIONS["parts"],
    "audit": "check a parameter set for contradictions",
    "export": "write a scenario or a walk for other tools: a library in C, an FMU, a controller for 'ppafo hil'",
    "firmware": "write the controller of a scenario or a walk, or a plant, as firmware for a small processor",
    "chip": "run a scenario or a walk with its controller on the simulator of a small processor",
    "hil": "run a scenario's plant in real time against a controller at a serial port or over UDP",
    "bits": QUESTIONS["bits"],
    "cache": "show, compile or remove the compiled models of this computer",
    "schema": "print the JSON Schema of a file format",
}

GROUPS: dict[str, tuple[str, ...]] = {
    "the paper": ("reproduce", "unreported"),
    "your device": ("new", "examples", "simulate", "workbench", "plot", "sets", "parts", "audit"),
    "from bench to model": ("record", "rig", "identify", "validate"),
    "decide": (
        "sweep",
        "compare",
        "sensitivity",
        "montecarlo",
        "find",
        "tune",
        "linearise",
        "design",
        "size",
        "endurance",
        "league",
    ),
    "walk": ("walk", "gait", "timing"),
    "tools": ("export", "firmware", "chip", "hil", "bits", "cache", "schema"),
}
"""The commands as the help shows them, by what somebody has come for."""

MOVED: dict[str, str] = {
    "bench": "'python -m benchmarks' or 'make bench'",
    "coverage": "'python scripts/interval_coverage.py'",
}
"""Commands that the package had once, and what does the same in a checkout of the repository."""
