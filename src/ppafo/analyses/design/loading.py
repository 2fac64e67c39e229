"""Loading of a design file: a torque profile and the requirements on a device."""

from functools import partial
from importlib import resources
from pathlib import Path

from ppafo.analyses.design.problem import SizingFile, SizingProblem, sizing_problem
from ppafo.arguments import checked
from ppafo.documents.models import make_schema, validate
from ppafo.documents.toml_text import TomlKind, label
from ppafo.errors import StudyError, at_fault
from ppafo.plugins import Plugins, name_plugins

FILE = TomlKind("design", "design", resources.files("ppafo.analyses.design") / "library", StudyError)


@checked
def load_design(problem: str | Path, *, profile: str | Path | None = None, plugins: Plugins = ()) -> SizingProblem:
    """Load the sizing problem of a design file with a torque profile, by its name in the package or by its path.

    ``profile`` replaces the profile of the file: a recording, or a share of a wearer's ankle moment such as
    ``gait:falisse2019-subject1,mass=72.6 kg,share=0.05``. Paths in a design file are relative to its folder.
    ``plugins`` are modules of your own whose objects files may name, as in ``simulate``.

    Raises StudyError or ParameterError, in one line, for an invalid file.

    >>> import ppafo
    >>> ppafo.load_design("push-off").name
    'push-off'
    """
    name_plugins(plugins)
    file = label(str(problem))
    with at_fault("problem"):
        content = FILE.read(problem)
    document = validate(SizingFile, FILE.parse(content, file), file, StudyError)
    return sizing_problem(document, file, Path(problem).parent, str(profile or ""))


json_schema = partial(make_schema, SizingFile, "ppafo design")
"""JSON Schema of a design file."""
