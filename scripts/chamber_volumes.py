"""Which dead volumes give what the paper reports, where the vane displaces its torque constant per radian.

    python scripts/chamber_volumes.py
    python scripts/chamber_volumes.py --dead 33.5 34 39 39.5
    python scripts/chamber_volumes.py --displacement 23.5 --dead 26.5

Prints a row for each dead volume [cm^3], the same of both chambers: the numbers of the torque task, what the text tells
of figure 7, and how many of the six fitted rows of ``ppafo reproduce`` are met. The table of docs/decisions/0014.
"""

import argparse

from ppafo.analyses.reproduce.paper import (
    phased_runs,
    step_observations,
    torque_task_claims,
    torque_task_observations,
)
from ppafo.simulation.loading import load_scenario
from ppafo.simulation.simulate import simulate

DEAD = (20.0, 25.0, 30.0, 33.0, 33.5, 34.0, 35.0, 36.0, 37.0, 38.0, 39.0, 39.5, 40.0, 45.0)
"""Dead volumes of each chamber [cm^3]."""


def row(dead: float, displacement: float | None) -> str:
    """Return numbers and count for a dead volume [cm^3], at the torque constant or a displacement [cm^3/rad]."""
    overrides = [f"actuator.dead_volume_{chamber}={dead} cm^3" for chamber in (1, 2)]
    overrides += [] if displacement is None else [f"actuator.displacement_per_radian={displacement} cm^3/rad"]
    names = ("step-response", "torque-task-solenoid", "torque-task-proportional")
    step, solenoid, proportional = (simulate(load_scenario(name, overrides)) for name in names)
    supply = step.scenario.device.supply
    told = step_observations(step.recording, supply)
    swings = torque_task_observations(solenoid, proportional)
    claims = torque_task_claims(*phased_runs(solenoid), proportional, ())
    met = [not claim.is_missed for claim in claims]
    met += [all(seen.verdict != "undetermined" for seen in texts) for texts in (told, swings)]
    better, pair, spool, saved = (claim.found for claim in claims)
    held = [seen for seen in told if seen.verdict != "undetermined"]
    reserved = "; ".join(f"{seen.entry.id}: {seen.note}" for seen in held if seen.note)
    shown = f"{len(held)} of {len(told)}{f' ({reserved})' if reserved else ''}"
    return f"{dead:5g}  {better:18}  {pair:19}  {spool:6}  {saved:18}  {sum(met)} of {len(met)}  {shown}"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--dead", type=float, nargs="+", default=DEAD, help="dead volumes of each chamber [cm^3]")
    parser.add_argument(
        "--displacement", type=float, help="displacement per radian [cm^3/rad], else the torque constant"
    )
    chosen = parser.parse_args()
    print("cm^3   RMS error less by   CO2, pair            CO2     CO2 saved           rows    text on figure 7")
    for dead in chosen.dead:
        print(row(dead, chosen.displacement), flush=True)


if __name__ == "__main__":
    main()
