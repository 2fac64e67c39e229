"""Every study by name and what it asks. Package ``ppafo.studies.NAME`` holds each one. To add one: one line here."""

STUDIES: dict[str, str] = {
    "bench": "how fast are the lanes and the command line beside other solvers on this machine?",
    "league": "how good is each controller on a task, and how far is it from the best that is possible?",
    "reproduction": "which of the paper's claims hold when its experiments are run again?",
}
