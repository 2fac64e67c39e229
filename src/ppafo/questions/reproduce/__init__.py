"""Which of the paper's claims hold when its experiments are run again?"""

from ppafo.questions.question import SET, Question

QUESTION = Question(solve="ppafo.questions.reproduce.solve:reproduce", arguments=(SET,))
