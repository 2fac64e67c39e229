"""From the rows of the engine to the course of a walk, for the wearer of a task and for one that differs from them."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ppafo.engine.lanes import Floats
from ppafo.gait import Gait
from ppafo.model.gait import GaitTiming
from ppafo.model.plant import PlantParameters, chamber_pressures
from ppafo.studies.league.walking.measures import Course
from ppafo.walking.followed_gait import followed, gait_timing
from ppafo.walking.posture import AnklePath, ankle_path
from ppafo.walking.recorded import SAFE_ROW
from ppafo.walking.wearer import Wearer

_PHASES = np.linspace(0.0, 1.0, 1001)


@dataclass(frozen=True, slots=True, eq=False)
class Toes:
    """Where the toes of a wearer are: the path of the ankle, and the healthy toes over the ground [m] by phase."""

    path: AnklePath
    toe_off: float
    healthy: Floats

    def heights(
        self, timing: GaitTiming, stature: float, phase: Floats, shank: Floats, angles: tuple[Floats, Floats]
    ) -> Floats:
        """Toes over the ground [m] in the swing of a wearer with a gait and a stature of their own.

        The healthy toes are at the same share of the swing as high as those of the gait that is varied; ``angles`` are
        the ankle's and the healthy one [rad].
        """
        share = (phase - timing.toe_off) / (1.0 - timing.toe_off)
        healthy = np.interp(self.toe_off + share * (1.0 - self.toe_off), _PHASES, self.healthy)
        path = replace(
            self.path,
            toe_lever=stature * self.path.toe_lever,
            height=stature * self.path.height,
            ground_angle=timing.ground_angle,
        )
        lifted, measured = (path.toe_height(phase, shank, angle) for angle in angles)
        return np.asarray(healthy + lifted - measured)


def toes_of(gait: Gait, wearer: Wearer) -> Toes:
    """The toes of a wearer with a gait."""
    timing = gait_timing(gait)
    path = ankle_path(gait, timing, wearer)
    shank, ankle = followed(gait.shank_angle).sampled(_PHASES), followed(gait.ankle_angle).sampled(_PHASES)
    # The path repeats: at its very end it is that of the next heel strike.
    return Toes(path, timing.toe_off, path.toe_height(np.minimum(_PHASES, 1.0 - 1.0e-9), shank, ankle))


def course_of(
    record: Mapping[str, Floats], plant: PlantParameters, timing: GaitTiming, toes: Toes, stature: float = 1.0
) -> Course:
    """The course of a walk from its rows (samples,) by path; ``stature`` over that of the wearer of ``toes``."""
    angle, healthy, phase = record["state.angle"], record["walk.now.ankle"], record["walk.now.phase"]
    pressures = chamber_pressures(plant, angle, record["state.mass_1"], record["state.mass_2"])  # type: ignore[arg-type]
    return Course(
        phase=phase,
        contact=record["walk.contact"],
        angle=angle,
        healthy_angle=healthy,
        torque=plant.torque_constant * np.subtract(*pressures),
        command=record["result.command"],
        toe_height=toes.heights(timing, stature, phase, record["walk.now.shank"], (angle, healthy)),
        gas=record["state.supplied_mass"],
        slap_rates=record["walk.slap_rates"],
        landings=record["walk.landings"],
        toe_landings=record["walk.toe_landings"],
        push_off_work=record["walk.push_off_work"],
        vented=record.get(SAFE_ROW, np.zeros_like(phase)),
    )
