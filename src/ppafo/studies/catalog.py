"""Every study by name and what it asks. Package ``ppafo.studies.NAME`` holds each one. To add one: one line here."""

STUDIES: dict[str, str] = {
    "bench": "how fast are the lanes and the command line beside other solvers on this machine?",
    "reproduction": "which of the paper's claims hold when its experiments are run again?",
    "unreported_settings": "which settings of its torque task does the paper imply, and how firm is its conclusion?",
}
