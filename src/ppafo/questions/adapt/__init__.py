"""With which reflexes does a wearer walk on, and how, once they have adapted to a weak muscle or to the device?"""

from ppafo.questions.question import SET, THREADS, Argument, Question, counting_number, quantity, whole_number

QUESTION = Question(
    name="adapt",
    summary="search the reflex gains of a wearer who reacts, from several random starts; resumable",
    group="walk",
    solve="ppafo.questions.adapt.solve:adapt_into_folder",
    arguments=(
        Argument(
            ("WALK",),
            "walk",
            "name of a walk whose wearer reacts, or a .toml file; default reacting",
            "WALK",
            nargs="?",
        ),
        Argument(("--out",), "out", "folder for the results; default out/adapt-NAME with the name of the walk", "DIR"),
        SET,
        Argument(
            ("--speed",),
            "speed",
            "walking speed to aim at, such as '1.3 m/s'; default: the start speed of the wearer",
            "SPEED",
            quantity("m/s"),
        ),
        Argument(
            ("--gains",),
            "adapts",
            "whose gains adapt: those of both legs alike, of each leg apart, or of the leg with the device",
            choices=("alike", "apart", "left"),
            default="alike",
        ),
        Argument(("--restarts",), "restarts", "independent searches; default 3", "N", counting_number, 3),
        Argument(("--generations",), "generations", "generations of each; default 30", "N", counting_number, 30),
        Argument(("--population",), "population", "candidates of a generation; default 16", "N", counting_number, 16),
        Argument(("--seed",), "seed", "random seed; default 1", "N", whole_number, 1),
        THREADS,
    ),
    fills_folder=True,
)
