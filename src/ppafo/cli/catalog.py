"""The subcommands and what each does, in the order of the help. Module ``ppafo.cli.NAME`` holds each one."""

COMMANDS: dict[str, str] = {
    "reproduce": "run the paper's experiments and report against its claims",
    "simulate": "run a scenario and write its recording, metrics and figure",
    "sweep": "run a study: many runs, a row for each, resumable",
    "compare": "hold configurations against each other, over an uncertain device too",
    "sensitivity": "say which uncertain value matters: Morris or Sobol indices",
    "montecarlo": "draw until a statistic is known well enough",
    "tune": "search gains for a goal under constraints, robust where asked",
    "validate": "hold a parameter set against recordings, channel by channel",
    "rig": "record synthetic bench data on the virtual test rig",
    "identify": "bench recordings in, parameter set with uncertainty out",
    "gait": "list, show and import gaits; export recordings for OpenSim",
    "endurance": "how long a bottle of gas lasts for a gas use, and why it ends",
    "design": "find the parts and settings that no others beat in error, gas and mass",
    "size": "torque profile and hours of use in, smallest valve, pressure and bottle out",
    "plot": "draw a result folder again",
    "sets": "list parameter sets, or show one with the source of every value",
    "parts": "list real parts with the origin of every figure",
    "audit": "check a parameter set for contradictions",
    "schema": "print the JSON Schema of a file format",
    "bench": "measure speed against other solvers in the same run",
}
