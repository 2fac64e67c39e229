"""Holds the package against the independent simulator of the tests on random devices and experiments.

    python scripts/compare_with_reference.py --draws 3000 --seed 1 --out out/reference

Prints a table: draws of each family, how many are determined, how many of these are above the limits or failed, worst
and median error over the limit; then those in which a decision of the controller hangs by a hair (they change where a
sensor is moved by 1e-5 of the pressure range), and those that change where the start is moved by 1e-7. Every determined
case above the limits is written as a scenario file into the folder, to be run again by

    ppafo simulate out/reference/slow-valves-1-17.toml
    python scripts/compare_with_reference.py --again out/reference/slow-valves-1-17.toml
"""

import argparse
import json
import sys
import time
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from ppafo import load_scenario, scenario_from_dict
from tests.reference.comparison import Verdict, verdict
from tests.reference.draws import FAMILIES, Document, draw

COLUMNS = (
    "draws",
    "determined",
    "above",
    "failed",
    "worst",
    "median",
    "by a hair",
    "above",
    "undetermined",
    "above",
    "s",
)


def toml(content: Document, path: str = "") -> Iterator[str]:
    """Lines of a nested document as TOML."""
    for key, value in content.items():
        if not isinstance(value, dict):
            yield f"{key} = {json.dumps(value)}"
    for key, value in content.items():
        if isinstance(value, dict):
            yield f"\n[{path}{key}]"
            yield from toml(value, f"{path}{key}.")


def description(case: Verdict) -> str:
    """One line of a verdict."""
    state = "determined" if case.is_determined else ("by a hair" if case.is_repeatable else "undetermined")
    return (
        f"{state}, angle {case.angle:.3g}, pressure {case.pressure:.3g} of the limit; start moved {case.moved:.2g}, "
        f"sensors moved {case.biased:.2g}, own error {case.own:.2g}; {case.compared} samples {case.failure}"
    )


def row(cases: list[Verdict], above: int, seconds: float) -> str:
    """One line of the table; worst and median error of the determined draws that ran, over the limit."""
    sure = sorted(case.worst for case in cases if case.is_determined and not case.failure)
    hanging = [case.worst for case in cases if case.is_repeatable and not case.is_determined]
    unsure = [case.worst for case in cases if not case.is_repeatable]
    failed = sum(bool(case.failure) for case in cases)
    worst, median = (sure[-1], sure[len(sure) // 2]) if sure else (0.0, 0.0)
    values = (len(cases), len(cases) - len(hanging) - len(unsure), above, failed, f"{worst:.3g}", f"{median:.2g}")
    rest = (len(hanging), sum(value > 1.0 for value in hanging), len(unsure), sum(value > 1.0 for value in unsure))
    return "".join(f"{value:>13}" for value in (*values, *rest, f"{seconds:.0f}"))


def main() -> int:
    """Compare the requested draws; 1 where one is above the limits."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--draws", type=int, default=330, help="how many in all, over all families (default 330)")
    parser.add_argument("--seed", type=int, default=1, help="another seed, other draws (default 1)")
    parser.add_argument("--duration", type=float, default=0.3, help="length of each run [s] (default 0.3)")
    parser.add_argument("--family", choices=list(FAMILIES), action="append", help="only this family; may be repeated")
    parser.add_argument("--out", type=Path, default=Path("out/reference"), help="folder for cases above the limits")
    parser.add_argument("--again", type=Path, help="compare one file instead")
    asked = parser.parse_args()
    if asked.again is not None:
        case = verdict(load_scenario(asked.again))
        print(description(case))
        return int(case.is_wrong)
    families = asked.family or list(FAMILIES)
    found = 0
    print(f"{'family':24}" + "".join(f"{name:>13}" for name in COLUMNS))
    for family in families:
        began, cases = time.perf_counter(), []
        for number in range(-(-asked.draws // len(families))):
            content = draw(family, asked.seed, number)
            content["run"]["duration"] = f"{asked.duration} s"
            case = verdict(scenario_from_dict(content))
            cases.append(case)
            if case.is_wrong:
                asked.out.mkdir(parents=True, exist_ok=True)
                file = asked.out / f"{family.replace(' ', '-')}-{asked.seed}-{number}.toml"
                file.write_text(f"# {description(case)}\n" + "\n".join(toml(content)) + "\n", encoding="utf-8")
        above = sum(case.is_wrong for case in cases)
        print(f"{family:24}" + row(cases, above, time.perf_counter() - began), flush=True)
        found += above
    return int(found > 0)


if __name__ == "__main__":
    sys.exit(main())
