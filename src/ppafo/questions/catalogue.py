"""The questions, in the order of the help. To add one: a package here and one line below.

Those of other packages are found by an entry point, and are commands like these.
"""

from ppafo.kinds import Kinds
from ppafo.questions.question import Question

QUESTIONS: Kinds[Question] = Kinds(
    "ppafo.questions",
    "question",
    Question,
    {
        "reproduce": "ppafo.questions.reproduce:QUESTION",
        "parts": "ppafo.questions.parts:QUESTION",
        "identify": "ppafo.questions.identify:QUESTION",
        "validate": "ppafo.questions.validate:QUESTION",
        "sweep": "ppafo.questions.sweep:QUESTION",
        "compare": "ppafo.questions.compare:QUESTION",
        "sensitivity": "ppafo.questions.sensitivity:QUESTION",
        "find": "ppafo.questions.find:QUESTION",
        "tune": "ppafo.questions.tune:QUESTION",
        "linearise": "ppafo.questions.linearise:QUESTION",
        "design": "ppafo.questions.design:QUESTION",
        "endurance": "ppafo.questions.endurance:QUESTION",
        "walk": "ppafo.questions.walk:QUESTION",
    },
)
