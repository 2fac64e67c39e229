"""Every study by name and what it asks. Package ``ppafo.studies.NAME`` holds each one. To add one: one line here."""

STUDIES: dict[str, str] = {
    "bench": "how fast are the lanes and the command line beside other solvers on this machine?",
    "design": "which parts and settings does no other design beat in error, gas and mass?",
    "reproduction": "which of the paper's claims hold when its experiments are run again?",
    "sizing": "which valve, supply pressure and bottle are just enough for a torque profile and hours of use?",
}
