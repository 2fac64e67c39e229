"""Several devices of one kind: what do they have in common, how do they spread, where will the next one lie?"""

from pathlib import Path

from ppafo.questions.question import CONFIDENCE, Argument, Question

QUESTION = Question(
    name="devices",
    summary="find what several devices of one kind have in common, and how they spread",
    group="from bench to model",
    solve="ppafo.questions.devices.solve:pool_devices",
    arguments=(
        Argument(
            ("DEVICE",),
            "devices",
            "three or more devices: each an identified parameter set (.toml), a folder that 'ppafo identify' wrote, "
            "or with --problem a folder of recordings",
            "DEVICE",
            nargs="+",
        ),
        Argument(
            ("--problem",),
            "problem",
            "identify each device first: a problem file whose recordings are in the folder of each device, under the "
            "same names",
            "PROBLEM",
            Path,
        ),
        CONFIDENCE,
    ),
)
