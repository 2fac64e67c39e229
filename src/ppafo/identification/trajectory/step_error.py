"""Are the steps of time fine enough for recordings with this little noise? Half the step answers."""

import numpy as np

from ppafo.identification.trajectory.columns import numbers_in, trajectories
from ppafo.identification.trajectory.preparation import Floats, Prepared, halved
from ppafo.identification.trajectory.residuals import Residuals

LARGE = 0.3
"""RMS change over the noise, when steps are halved, from which the steps are said to be too long."""


def step_remarks(residuals: Residuals, point: Floats, signals: list[dict[str, Floats]]) -> tuple[str, ...]:
    """Return a sentence for each experiment whose steps are too long; ``signals`` are its runs by channel."""
    remarks = []
    for prepared, coarse in zip(residuals.experiments, signals, strict=True):
        finer = halved(prepared, numbers_in(prepared, residuals.ranges, point))
        fine = trajectories([finer], residuals.ranges, point[None, :])[0]
        moved = {
            channel.name: float(np.sqrt(np.mean(np.square(fine[channel.name][:, 0] - coarse[channel.name]))))
            / channel.noise
            for channel in prepared.channels
        }
        worst = max(moved, key=lambda name: moved[name])
        if moved[worst] > LARGE:
            remarks.append(_remark(prepared, finer, worst, moved[worst]))
    return tuple(remarks)


def _remark(prepared: Prepared, finer: Prepared, channel: str, moved: float) -> str:
    return (
        f"{prepared.label}: steps of {1e3 * prepared.run.step:.3g} ms are long for so little noise: half of that moves "
        f"{channel} by {moved:.2g} times its noise; give step = '{1e3 * finer.run.step:.3g} ms' or less"
    )
