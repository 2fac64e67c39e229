"""A design file: one with tasks is searched for a front, one with a profile is sized for it."""

from importlib import resources
from pathlib import Path
from typing import Any

from pydantic import TypeAdapter

from ppafo.analyses.design.front.problem import DesignFile, DesignProblem, design_problem
from ppafo.analyses.design.profile.problem import SizingFile, SizingProblem, sizing_problem
from ppafo.arguments import Seed, checked
from ppafo.documents.models import SCHEMA, validate
from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import StudyError
from ppafo.plugins import Plugins, name_plugins

FILE = TomlKind("design", "design", resources.files("ppafo.analyses.design") / "library", StudyError)


def read_design_file(name_or_path: str | Path) -> tuple[DesignFile | SizingFile, str]:
    """Return a design file by its name in the package or by its path, and what messages call it."""
    file = label(str(name_or_path))
    document = FILE.parse(FILE.read(name_or_path), file)
    known = {*DesignFile.model_fields, *SizingFile.model_fields}
    # Both layouts would refuse it, each for what only the other has: say what decides between them.
    if document.keys() <= known - {"profile", "task"}:
        raise StudyError(
            f"{file}: says neither which torque is wanted nor in which tasks; write a table [profile] with time and "
            "torque or recording, or tables [[task]]; 'ppafo doctor --schema design' prints the format of both"
        )
    if "profile" in document:
        return validate(SizingFile, document, file, StudyError), file
    return validate(DesignFile, document, file, StudyError), file


@checked("problem", "seed", name_or_path="problem")
def load_design(
    problem: str | Path, *, seed: Seed | None = None, plugins: Plugins = ()
) -> DesignProblem | SizingProblem:
    """Return the problem of a design file, by its name in the package or by its path; paths in it begin in its folder.

    ``seed`` replaces the seed of a file with tasks. StudyError or ParameterError for what is not usable, in one line.

    ``plugins`` are modules of your own whose objects files may name, as of ``simulate``.

    >>> import ppafo
    >>> [task.name for task in ppafo.load_design("torque-task").tasks]
    ['ramp to 6 N m', 'ramp to 3 N m']
    """
    name_plugins(plugins)
    document, file = read_design_file(problem)
    folder = Path(problem).parent
    if isinstance(document, DesignFile):
        return design_problem(document, file, folder, seed)
    if seed is not None:
        raise StudyError(f"{file}: nothing is drawn for a profile, so there is no random seed to change")
    return sizing_problem(document, file, folder)


def json_schema() -> dict[str, Any]:
    """Return the JSON Schema of a design file, with tasks or with a profile."""
    either: TypeAdapter[Any] = TypeAdapter(DesignFile | SizingFile)
    return {"$schema": SCHEMA, **either.json_schema(), "title": "ppafo design"}
