"""Which of the paper's claims hold when its experiments are run again, and which of other publications?"""

from ppafo.questions.question import SET, Argument, Question

QUESTION = Question(
    name="reproduce",
    summary="reproduce the paper's experiments and check its claims",
    group="the paper",
    solve="ppafo.questions.reproduce.solve:reproduce",
    arguments=(
        Argument(
            ("--study",),
            "study",
            "publication to run again: a name, a .toml file of claims, or 'all'; default ppafo-2011, the paper",
            "NAME",
            default="ppafo-2011",
        ),
        SET,
    ),
    library="ppafo.questions.reproduce.publication:FILE",
    listing="ppafo.questions.reproduce.publication:list_studies",
)
