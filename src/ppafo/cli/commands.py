"""List of all commands under the headings of the help.

Commands of other packages are plain functions, found by entry points of the group ``ppafo.commands``.
"""

from types import FunctionType

from ppafo.cli.command_line import Command, CommandGroup, UsageError
from ppafo.kinds import Kinds, is_installed, package_of
from ppafo.plugins import name_modules_in
from ppafo.wording import known_names

_ANALYSES = "ppafo.analyses"
_VERBS = "ppafo.cli.verbs"
_SETS = f"{_VERBS}:sets_list"
_GAITS = f"{_VERBS}:gait_list"
_STUDIES = "ppafo.analyses.study_results:studies_of_the_package", "study"


def _of_scenario(verb: str) -> Command:
    """Declare a command that takes scenarios and walks by name."""
    return Command(verb, listing="ppafo.cli.simulate:list_descriptions", listed="scenario")


_ALL_HEADINGS: dict[str, dict[str, Command | CommandGroup]] = {
    "the paper": {
        "reproduce": Command(
            f"{_ANALYSES}.reproduce.question:reproduce",
            listing="ppafo.analyses.reproduce.claims:list_studies",
            listed="publication",
        ),
    },
    "your device": {
        "new": Command("ppafo.cli.new:new", listing="ppafo.cli.new:list_kinds", listed="kind"),
        "simulate": _of_scenario("ppafo.cli.simulate:simulate"),
        "workbench": _of_scenario("ppafo.page.commands:workbench"),
        "sets": CommandGroup(
            "list, show and audit parameter sets",
            {
                "list": Command(f"{_VERBS}:sets_list"),
                "show": Command(f"{_VERBS}:sets_show", listing=_SETS),
                "audit": Command(f"{_VERBS}:sets_audit", listing=_SETS),
            },
        ),
    },
    "from bench to model": {
        "rig": CommandGroup(
            "record synthetic data on the simulated test bench",
            {"simulate": Command(f"{_VERBS}:rig_simulate", listing=f"{_VERBS}:list_rig", listed="experiment")},
        ),
        "identify": Command(f"{_ANALYSES}.identify:identify"),
        "validate": Command(f"{_ANALYSES}.validate:validate", listing=_SETS),
    },
    "decide": {
        "sweep": Command(f"{_ANALYSES}.sweep:sweep_into_folder", *_STUDIES),
        "compare": _of_scenario(f"{_ANALYSES}.compare:compare"),
        "sensitivity": Command(f"{_ANALYSES}.sensitivity:sensitivity", *_STUDIES),
        "find": _of_scenario(f"{_ANALYSES}.find:find"),
        "tune": Command(f"{_ANALYSES}.tune:tune", listing="ppafo.analyses.tuning:TUNING"),
        "linearise": _of_scenario(f"{_ANALYSES}.linearise.question:linearise"),
        "design": Command(f"{_ANALYSES}.design.question:design", listing="ppafo.analyses.design.problem:FILE"),
        "bottle": Command(f"{_ANALYSES}.endurance.question:bottle", listing="ppafo.parameters.bottles.bottle:FILE"),
    },
    "walk": {
        "gait": CommandGroup(
            "list, show and import gaits",
            {
                "list": Command(f"{_VERBS}:gait_list"),
                "show": Command(f"{_VERBS}:gait_show", listing=_GAITS),
                "import": Command(f"{_VERBS}:gait_import"),
                "record": Command(f"{_VERBS}:gait_record", listing=_GAITS),
            },
        ),
        "walk": Command(
            f"{_ANALYSES}.walk.question:walk_with_and_without",
            listing="ppafo.walking.loading:FILE",
            default_folder="ppafo.analyses.walk.question:default_folder",
        ),
    },
    "tools": {
        "export": CommandGroup(
            "write a scenario or a walk for other tools: C, an FMU, OpenSim, firmware; figures of a result",
            {
                "c": _of_scenario(f"{_VERBS}:export_c"),
                "firmware": _of_scenario("ppafo.processor.commands:export_firmware"),
                "fmu": _of_scenario(f"{_VERBS}:export_fmu"),
                "opensim": Command("ppafo.cli.opensim:export_opensim", listing="ppafo.walking.loading:FILE"),
                "figure": Command("ppafo.cli.figure:export_figure"),
            },
        ),
        "doctor": Command("ppafo.cli.doctor:doctor"),
    },
}
"""Headings of the help with their commands, installed or not."""


def _installed(entry: Command | CommandGroup) -> Command | CommandGroup | None:
    """Return a command if installed, a group with its installed commands, or None if nothing remains."""
    if isinstance(entry, Command):
        return entry if is_installed(entry.verb) else None
    return CommandGroup(
        entry.summary, {name: action for name, action in entry.actions.items() if is_installed(action.verb)}
    )


HEADINGS: dict[str, dict[str, Command | CommandGroup]] = {
    heading: {name: entry for name, listed in group.items() if (entry := _installed(listed)) is not None}
    for heading, group in _ALL_HEADINGS.items()
}
"""Headings of the help with their installed commands."""

COMMANDS: dict[str, Command | CommandGroup] = {
    name: entry for group in HEADINGS.values() for name, entry in group.items()
}
"""Installed commands of this package by name."""

OTHERS: Kinds[FunctionType] = Kinds("ppafo.commands", "command", FunctionType, {})
"""Commands of other packages, loaded only for a name unknown in this package."""


def check_words(words: list[str]) -> None:
    """Raise UsageError for words that match no command, with the nearest name.

    Raises KindError for a command of another package that is installed and cannot be used.
    """
    named = [word for word in words if not word.startswith("-")]
    # Options alone, such as --version, are for the parser.
    if not named:
        return
    entry = next((group[named[0]] for group in _ALL_HEADINGS.values() if named[0] in group), None)
    shown = named[: 2 if isinstance(entry, CommandGroup) else 1]
    if isinstance(entry, CommandGroup):
        entry = entry.actions.get(shown[-1])
    if entry is not None and not is_installed(entry.verb):
        raise UsageError(f"'ppafo {' '.join(shown)}' is part of {package_of(entry.verb)}, which is not installed")
    word = named[0]
    name_modules_in(word)
    # A command of a module that the person names is known before it is listed.
    if word not in COMMANDS and word not in OTHERS:
        known = tuple(dict.fromkeys((*COMMANDS, *OTHERS)))
        raise UsageError(f"there is no command '{word}'{known_names(word, known)}")
    command = COMMANDS.get(word)
    # A group alone is a mistake, unless its help is asked for, which the parser prints.
    if isinstance(command, CommandGroup) and "-h" not in words and "--help" not in words:
        actions = list(command.actions)
        action = named[1] if len(named) > 1 else None
        if action is None and "--list" in words and "list" in actions:
            raise UsageError(f"{word}: there is no option '--list'; use 'ppafo {word} list'")
        if action is None:
            raise UsageError(f"{word}: give one of {', '.join(actions)}; see 'ppafo {word} --help'")
        if action not in actions:
            tables = "; a result folder has its table as recording.csv and recording.nc" if word == "export" else ""
            raise UsageError(f"there is no 'ppafo {word} {action}'{known_names(action, actions)}{tables}")


def list_commands() -> str:
    """Format the list of commands with summaries, by heading, including commands of other packages."""
    # The summary of a command is in its function, so that the ones of other packages are loaded here.
    OTHERS.load_all()
    groups = {heading: {name: entry.summary for name, entry in group.items()} for heading, group in HEADINGS.items()}
    others = {name: Command("", loaded_verb=verb).summary for name, verb in OTHERS.loaded().items()}
    if others:
        groups["of other packages"] = others
    width = max(len(name) for group in groups.values() for name in group)
    return "\n\n".join(
        "\n".join([f"{heading}:", *(f"  {name:<{width}}  {summary}" for name, summary in group.items())])
        for heading, group in groups.items()
    )
