"""Is the model good enough? A parameter set compared with recordings, channel by channel."""

from ppafo.questions.question import SET, Argument, Question, quantity

QUESTION = Question(
    name="validate",
    summary="compare a parameter set with recordings, channel by channel",
    group="from bench to model",
    solve="ppafo.questions.validate.solve:validate",
    arguments=(
        Argument(("PARAMETERS",), "parameter_set", "name of a parameter set, or a .toml file", "PARAMETERS"),
        Argument(
            ("RECORDING",),
            "recordings",
            "a .csv or .nc file, or a result folder; several may be given",
            "RECORDING",
            nargs="+",
        ),
        Argument(("--valve",), "valve", "valve of the parameter set; default: its default valve", "NAME"),
        SET,
        Argument(
            ("--motion",),
            "motion",
            "free: the model moves the vane; measured: the vane follows the recorded angle; held: the vane stays "
            "at its initial angle; leg: the model moves vane and foot on the fixture of step-response (default free)",
            metavar="free|measured|held|leg",
            default="free",
        ),
        Argument(
            ("--volume",),
            "volume",
            "no vane: the valve fills and vents chamber 1 of this fixed volume, for example '60 cm^3'; pressure_1 "
            "is compared",
            metavar="VOLUME",
            type=quantity("m^3"),
        ),
        Argument(
            ("--initial",),
            "initial",
            "initial value of a channel that was not recorded, for example 'pressure_2=0 psi_g'",
            metavar="CHANNEL=VALUE",
            action="append",
            default=(),
        ),
        Argument(
            ("--threshold",),
            "thresholds",
            "maximum RMS error, as a fraction of full range or with a unit: 5%%, angle=10%%, 'pressure_1=3.7 "
            "psi_d'; default: 10%%, and half of the variance of the signal is explained",
            metavar="[CHANNEL=]LIMIT",
            action="append",
            default=(),
        ),
        Argument(
            ("--longest-delay",),
            "longest_delay",
            "maximum delay of the measurement to estimate; default '20 ms', '0 s' for none",
            metavar="TIME",
            type=quantity("s"),
            default=0.02,
        ),
        Argument(
            ("--columns",),
            "columns",
            "file with a column map [columns.NAME], for recordings with other column names; a problem file may "
            "contain it",
            metavar="FILE.toml[:NAME]",
        ),
    ),
)
