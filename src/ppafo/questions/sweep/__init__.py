"""How are the metrics of a study distributed over many runs, and how do they depend on what varies?"""

from ppafo.questions.question import SEED, SET, THREADS, Argument, Question, counting_number

QUESTION = Question(
    name="sweep",
    summary="run a study: many runs, one row each, resumable",
    group="decide",
    solve="ppafo.questions.sweep.solve:sweep_into_folder",
    arguments=(
        Argument(("STUDY",), "study", "name of a study, or a .toml file", "STUDY", nargs="?"),
        Argument(
            ("--out",), "out", "folder or address for the results; default out/NAME with the name of the study", "DIR"
        ),
        SET,
        Argument(("--draws",), "draws", "number of draws, instead of the number in the file", "N", counting_number),
        SEED,
        THREADS,
        Argument(
            ("--scheduler",), "scheduler", "address of a Dask scheduler whose workers compute the chunks", "ADDRESS"
        ),
        Argument(
            ("--yes",),
            "agreed",
            "start even if the results will fill much of the disk",
            action="store_true",
            default=False,
        ),
    ),
    library="ppafo.studies.loading:STUDY_FILES",
    listing="ppafo.questions.sweep.solve:studies_of_the_package",
    fills_folder=True,
)
