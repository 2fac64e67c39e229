"""The subcommands and what each does, in the order of the help. Module ``ppafo.cli.NAME`` holds each one."""

COMMANDS: dict[str, str] = {
    "reproduce": "run the paper's experiments and report against its claims",
    "simulate": "run a scenario and write its recording, metrics and figure",
    "league": "rank every controller on a task, with the best that is possible",
    "validate": "hold a parameter set against recordings, channel by channel",
    "rig": "record synthetic bench data on the virtual test rig",
    "identify": "bench recordings in, parameter set with uncertainty out",
    "plot": "draw a result folder again",
    "sets": "list parameter sets, or show one with the source of every value",
    "audit": "check a parameter set for contradictions",
    "schema": "print the JSON Schema of a file format",
    "bench": "measure speed against other solvers in the same run",
}
