"""Which device has the torque and lasts the minutes for a wearer, or is just enough for a torque profile?"""

from ppafo.questions.question import THREADS, Argument, Question, minutes, quantity

QUESTION = Question(
    name="size",
    summary="find the device for a wearer and minutes of walking, or for a torque profile",
    group="decide",
    solve="ppafo.questions.size.answer:size",
    arguments=(
        Argument(("SIZING",), "problem", "name of a sizing file, or a .toml file", "SIZING", nargs="?"),
        THREADS,
        Argument(("--mass",), "mass", "body mass of the wearer, '72.5 kg'", "MASS", quantity("kg")),
        Argument(("--stature",), "stature", "height of the wearer, '1.75 m'", "LENGTH", quantity("m")),
        Argument(("--torque",), "torque", "peak torque of push-off, '2.5 N m'", "TORQUE", quantity("N m")),
        Argument(("--pressure",), "pressure", "supply pressure, '50 psi_g'", "PRESSURE", quantity("Pa_a")),
        Argument(("--minutes",), "minutes", "minutes of walking on one bottle", "N", minutes),
    ),
    instead_of_file=("mass", "stature", "torque", "pressure", "minutes"),
    library="ppafo.questions.size.problem:FILE",
)
