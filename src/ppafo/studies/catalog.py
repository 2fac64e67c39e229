"""Every study by name and what it asks. Package ``ppafo.studies.NAME`` holds each one. To add one: one line here."""

STUDIES: dict[str, str] = {
    "bench": "how fast are the lanes and the command line beside other solvers on this machine?",
    "league": "how good is each controller on a task, and how far is it from the best that is possible?",
    "reproduction": "which of the paper's claims hold when its experiments are run again?",
    "unreported_settings": "which settings of its torque task does the paper imply, and how firm is its conclusion?",
    "sweep": "what comes of many runs of a study file, and how do the metrics hang on what varies?",
    "comparison": "which configuration is better, by how much, and how surely?",
    "sensitivity": "which uncertain value matters?",
    "monte_carlo": "how sure is a number, and how many runs does it take?",
    "tuning": "which gains are best, also for a device that is not known exactly?",
    "design": "which parts and settings does no other design beat in error, gas and mass?",
    "sizing": "which valve, supply pressure and bottle are just enough for a torque profile and hours of use?",
    "endurance": "how long does one bottle of gas last, how cold does it get, and why does it end?",
}
