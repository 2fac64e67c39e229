"""What does the device do for a wearer who walks: with it, without it, and as the healthy gait would have it?"""

from ppafo.questions.question import SET, Argument, Question, counting_number, minutes, whole_number

QUESTION = Question(
    name="walk",
    summary="simulate walking with the device, without it, and healthy",
    group="walk",
    solve="ppafo.questions.walk.answer:walk_with_and_without",
    arguments=(
        Argument(
            ("WALK",),
            "configuration",
            "name of a walk configuration, or a .toml file; default solenoid",
            metavar="WALK",
            nargs="?",
            default="solenoid",
        ),
        Argument(("--gait",), "gait", "name of a gait, or a gait file; default: the gait of the configuration", "GAIT"),
        Argument(
            ("--course",),
            "course",
            "what the wearer does one after the other: a name or a .toml file; 'ppafo walk --list' has the names",
            "COURSE",
        ),
        Argument(
            ("--bottle",),
            "bottle",
            "hang the device on a bottle: a name ('ppafo endurance --list') or a .toml file; the walk ends with it",
            "BOTTLE",
        ),
        Argument(
            ("--minutes",),
            "minutes",
            "time to walk; default 1, up to 10 on a bottle, or a whole course",
            "N",
            minutes,
        ),
        Argument(
            ("--wearers",), "wearers", "number of different wearers to simulate instead of one", "N", counting_number
        ),
        Argument(("--seed",), "seed", "random seed of the wearers; default 1", "N", whole_number, 1),
        SET,
    ),
    library="ppafo.walking.loading:FILE",
    listing="ppafo.questions.walk.answer:list_files",
    default_folder="ppafo.questions.walk.answer:default_folder",
)
