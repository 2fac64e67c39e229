"""Every study by name and what it asks. Package ``ppafo.studies.NAME`` holds each one. To add one: one line here."""

STUDIES: dict[str, str] = {
    "bench": "how fast are the lanes and the command line beside other solvers on this machine?",
    "comparison": "which configuration is better, by how much, and how surely?",
    "monte_carlo": "how sure is a number, and how many runs does it take?",
    "reproduction": "which of the paper's claims hold when its experiments are run again?",
    "sensitivity": "which uncertain value matters?",
    "tuning": "which gains are best, also for a device that is not known exactly?",
}
