"""Which real parts are there, and where does each figure come from?"""

from ppafo.questions.question import Argument, Question

QUESTION = Question(
    name="parts",
    summary="list real parts with the origin of every figure",
    group="your device",
    solve="ppafo.questions.parts.solve:parts",
    arguments=(
        Argument(("PART",), "part", "name of a part, for all its figures and their sources", "PART", nargs="?"),
        Argument(
            ("--catalogue",),
            "catalogue",
            "a .toml file; default: the catalogue of the package",
            "FILE",
            default="parts",
        ),
    ),
)
