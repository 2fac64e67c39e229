"""Which device: for a wearer, for a torque profile, or beaten by no other in error, gas and mass?"""

from ppafo.questions.question import SEED, THREADS, Argument, Question, minutes, quantity

QUESTION = Question(
    name="design",
    summary="find a device: for a wearer, for a torque profile, or Pareto-optimal in error, gas and mass",
    group="decide",
    solve="ppafo.questions.design.solve:design",
    arguments=(
        Argument(("DESIGN",), "problem", "name of a design file, or a .toml file", "DESIGN", nargs="?"),
        SEED,
        THREADS,
        Argument(("--mass",), "mass", "body mass of the wearer, '72.5 kg'", "MASS", quantity("kg")),
        Argument(("--stature",), "stature", "height of the wearer, '1.75 m'", "LENGTH", quantity("m")),
        Argument(("--torque",), "torque", "peak torque of push-off, '2.5 N m'", "TORQUE", quantity("N m")),
        Argument(("--pressure",), "pressure", "supply pressure, '50 psi_g'", "PRESSURE", quantity("Pa_a")),
        Argument(("--minutes",), "minutes", "minutes of walking on one bottle", "N", minutes),
    ),
    instead_of_file=("mass", "stature", "torque", "pressure", "minutes"),
    library="ppafo.questions.design.loading:FILE",
)
