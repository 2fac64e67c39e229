"""How long does one bottle of gas last, how cold does it get, and why does it end?"""

from pathlib import Path

from ppafo.questions.question import SET, Argument, Question, quantity

QUESTION = Question(
    name="endurance",
    summary="compute how long a bottle of gas lasts, and why it ends",
    group="decide",
    solve="ppafo.questions.endurance.solve:endurance",
    arguments=(
        Argument(
            ("RECORDING",),
            "recordings",
            "a .csv or .nc file with supplied_mass, or the result folder of a run or a walk; repeated until the "
            "bottle ends; several are compared side by side",
            metavar="RECORDING",
            type=Path,
            nargs="*",
        ),
        Argument(
            ("--gas-per-stride",), "gas_per_stride", "gas per stride, for example '0.3 g'", "MASS", type=quantity("kg")
        ),
        Argument(
            ("--stride-time",),
            "stride_time",
            "time of one stride; default: '1.1 s', the whole recording, one stride of a walk, or its whole course",
            metavar="TIME",
            type=quantity("s"),
        ),
        Argument(
            ("--peak-flow",),
            "peak_flow",
            "largest flow, for example '4.5 g/s'; default: the mean flow",
            metavar="FLOW",
            type=quantity("kg/s"),
        ),
        Argument(
            ("--bottle",),
            "bottle",
            "name of a bottle or a .toml file; default: that of the walk, or the paper's bottle",
            metavar="BOTTLE",
        ),
        Argument(
            ("--walk",),
            "walk",
            "time of walking between two rests, with --rest; default '10 min'",
            "TIME",
            quantity("s"),
        ),
        Argument(("--rest",), "rest", "time of each rest; default '0 s' (no rest)", "TIME", quantity("s")),
        Argument(
            ("--longest",),
            "longest",
            "maximum simulated time; default '1440 min'",
            metavar="TIME",
            type=quantity("s"),
            default=86400.0,
        ),
        SET,
    ),
    library="ppafo.parameters.bottles.bottle:FILE",
)
