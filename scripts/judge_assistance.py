"""Has published trials of powered ankles judge what a device does to the effort of a wearer who reacts and adapts.

    python scripts/judge_assistance.py timing --out out/timing
    python scripts/judge_assistance.py timing --device-on both --out out/timing-both
    python scripts/judge_assistance.py trial --out out/trial

``timing`` moves the onset of push-off through the stride, as P. Malcolm et al. (PLoS One 8(2):e56137, 2013) and
S. Galle et al. (J NeuroEng Rehabil 14:35, 2017) did, and prints the change of the metabolic rate against the same
device switched off. ``trial`` draws 16 weak wearers, as many as M. Boes et al. (Arch Phys Med Rehabil 99(3):484, 2018)
had, who found no difference in the cost of transport. Every wearer adapts to each condition with searches of its own;
those that are done are kept in --out, and the same command goes on.
"""

import argparse
import math
import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from ppafo.questions.adapt.answer import Adaptation, Walked
from ppafo.questions.adapt.solve import adapt_into_folder
from ppafo.walking.reacting_wearer import LEFT, LEGS

MODELS = (("metabolic_power_umberger", "Umberger 2010"), ("metabolic_power_bhargava", "Bhargava 2004"))
MALCOLM = {0.13: -5.0, 0.23: -12.0, 0.34: -15.0, 0.43: -17.0, 0.54: -2.0}
"""Change of the metabolic rate [%] against the device switched off, by onset [fraction of the stride]."""

GALLE = {0.36: "-14 to -18", 0.42: "-16 to -21", 0.48: "-16 to -17", 0.54: "-8"}
TOE_OFF = 0.63
"""End of the push-off [fraction of the stride], about where the toes leave the ground."""

NO_LIFT = "supply.dorsiflexion_pressure=6 psi_g"
"""Those devices assisted plantarflexion alone; this one lifts the foot too, unless it has hardly any pressure to."""

WEARERS = 16
TIBIALIS, CALF = (0.15, 0.6), (0.5, 0.9)
"""Strengths of the drawn wearers' left leg: an assumption, for the trial's abstract has no strengths."""


def adapted(folder: Path, overrides: Sequence[str], arguments: argparse.Namespace, restarts: int) -> Adaptation:
    """The searches of a condition, from the folder where they are done."""
    return adapt_into_folder(
        "reacting",
        folder,
        restarts=restarts,
        generations=arguments.generations,
        seed=arguments.seed,
        overrides=[
            f"wearer.reacts={arguments.wearer}",
            f"wearer.device_on={arguments.device_on}",
            "run.duration=12 s",
            *overrides,
        ],
    )


def cost(walked: Walked, model: str) -> float:
    """Metabolic cost of transport [J/m], of the walks without a fall; not a number where there is none."""
    power, speed = walked.mean(model), walked.mean("walking_speed")
    return math.nan if power is None or speed is None else power / speed


def costs(found: Adaptation) -> dict[str, np.ndarray]:
    """Costs of transport [J/m] by model, of each restart that walks on from every start."""
    walks_on = [one.walked for one in found.restarts if one.walked.share == 1.0]
    return {model: np.array([cost(walked, model) for walked in walks_on]) for model, _ in MODELS}


def change(these: np.ndarray, those: np.ndarray) -> tuple[float, float]:
    """Change of the mean against those [%], and its standard error."""
    if min(these.size, those.size) < 2:
        return math.nan, math.nan
    ratio = these.mean() / those.mean()
    share = sum(values.var(ddof=1) / values.size / values.mean() ** 2 for values in (these, those))
    return 100.0 * (ratio - 1.0), 100.0 * ratio * math.sqrt(share)


def timing(arguments: argparse.Namespace) -> None:
    """Print the change of the cost of transport by onset."""
    pressure = f"supply.pressure={arguments.pressure} psi_g"
    off = adapted(arguments.out / "off", ["controller.kind=off", pressure, NO_LIFT], arguments, arguments.restarts)
    onsets = sorted({*MALCOLM, *GALLE})
    powered = {
        onset: adapted(
            arguments.out / f"{100.0 * onset:.0f}",
            [pressure, NO_LIFT, f"controller.push_off_start={onset}", f"controller.push_off_end={TOE_OFF}"],
            arguments,
            arguments.restarts,
        )
        for onset in onsets
    }
    print(f"| onset | searches that walk on | {' | '.join(words for _, words in MODELS)} | Malcolm 2013 | Galle 2017 |")
    print("|---|---|---|---|---|---|")
    first, reference = MODELS[0][0], costs(off)
    print(f"| off | {reference[first].size} of {len(off.restarts)} | 0 | 0 | 0 | 0 |")
    for onset, found in powered.items():
        own, cells = costs(found), []
        for model, values in own.items():
            mean, error = change(values, reference[model])
            cells.append(f"{mean:+.1f} +- {error:.1f} %" if math.isfinite(error) else "too few")
        walk_on = f"{own[first].size} of {len(found.restarts)}"
        published = f"{MALCOLM[onset]:+.0f} %" if onset in MALCOLM else "-"
        others = f"{GALLE[onset]} %" if onset in GALLE else "-"
        print(f"| {100.0 * onset:.0f} % | {walk_on} | {' | '.join(cells)} | {published} | {others} |")


def trial(arguments: argparse.Namespace) -> None:
    """Print the paired differences of the cost of transport of drawn weak wearers, with the device and without."""
    generator = np.random.default_rng(arguments.seed)
    strengths = [(generator.uniform(*TIBIALIS), generator.uniform(*CALF)) for _ in range(WEARERS)]
    differences: dict[str, list[float]] = {model: [] for model, _ in MODELS}
    print("| tibialis | soleus and gastrocnemius | walks on with | without | Umberger (J/m) with | without |")
    print("|---|---|---|---|---|---|")
    for number, (tibialis, calf) in enumerate(strengths):
        weak = [
            f"wearer.tibialis_strength={tibialis:.3f}",
            f"wearer.soleus_strength={calf:.3f}",
            f"wearer.gastrocnemius_strength={calf:.3f}",
        ]
        worn = adapted(arguments.out / f"{number + 1}-with", weak, arguments, 1).best.walked
        off = adapted(arguments.out / f"{number + 1}-off", [*weak, "controller.kind=off"], arguments, 1).best.walked
        with_it, without = (cost(walked, MODELS[0][0]) for walked in (worn, off))
        shares = f"{100.0 * worn.share:.0f} % | {100.0 * off.share:.0f} %"
        print(f"| {tibialis:.2f} | {calf:.2f} | {shares} | {with_it:.0f} | {without:.0f} |", flush=True)
        if worn.share == off.share == 1.0:
            for model, values in differences.items():
                values.append(100.0 * (cost(worn, model) / cost(off, model) - 1.0))
    for model, words in MODELS:
        found = np.array(differences[model])
        error = found.std(ddof=1) / math.sqrt(found.size)
        print(f"\n{words}: {found.mean():+.1f} +- {error:.1f} % (mean and standard error of {found.size} wearers)")


def main() -> int:
    """Run one of the judges."""
    parser = argparse.ArgumentParser(description="Compare effort with a device with published trials")
    parser.add_argument("judge", choices=("timing", "trial"))
    parser.add_argument("--out", type=Path, required=True, help="folder of the searches")
    parser.add_argument("--wearer", default="geyer-herr", help="wearer to begin with")
    parser.add_argument("--device-on", choices=LEGS, default=LEFT, help="legs with a device")
    parser.add_argument("--pressure", type=float, default=90.0, help="supply of push-off (psi_g), in 'timing'")
    parser.add_argument("--restarts", type=int, default=5, help="searches of a condition, in 'timing'")
    parser.add_argument("--generations", type=int, default=20)
    parser.add_argument("--seed", type=int, default=1)
    arguments = parser.parse_args()
    {"timing": timing, "trial": trial}[arguments.judge](arguments)
    return 0


if __name__ == "__main__":
    sys.exit(main())
