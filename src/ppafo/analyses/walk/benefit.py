"""Verdict on a walk: benefit of the device against the same walk without it."""

from collections.abc import Mapping

from ppafo.report.kind import Kind
from ppafo.walking.walk import WalkComparison

_WORK, _SHARE = Kind("", "J", "energy", ".3g"), Kind("", "1", "fraction", ".2g")
_ANGLE, _HEIGHT = Kind("", "rad", "angle", ".3g"), Kind("", "m", "length", ".2g")


def benefit_sentence(comparison: WalkComparison) -> str:
    """Return a sentence on whether the device helps until the end of the walk; "" for a walk that diverged.

    The device helps by net work in push-off, toes above the ground, and an ankle closer to the healthy angle.
    """
    worn, bare = comparison.with_device, comparison.without_device
    numbers, without = ({name: metric.value for name, metric in walked.metrics.items()} for walked in (worn, bare))
    if "diverged" in (worn.status.kind, bare.status.kind) or "net_push_off_work" not in numbers:
        return ""
    has_work = numbers["net_push_off_work"] > 0.0
    drags, drags_without = (metrics.get("lowest_toes", 0.0) < 0.0 for metrics in (numbers, without))
    both = numbers.keys() & without.keys()
    is_closer = "angle_difference" in both and without["angle_difference"] > numbers["angle_difference"]
    lifts = not drags and (drags_without or is_closer)
    if not (has_work or lifts):
        verdict = "the device does not help"
    elif drags:
        verdict = "the device helps in push-off but not in swing"
    else:
        verdict = "the device helps" if has_work else "the device helps in swing alone"
    if not worn.status.is_completed:
        verdict = f"until then {verdict}"
    return f"{verdict}, against the same walk without it: {', '.join(_compared(numbers, without))}"


def _compared(numbers: Mapping[str, float], without: Mapping[str, float]) -> list[str]:
    """Return clauses on work, ankle and toes, from the metrics [SI] of the walks with the device and without it."""
    clauses = [f"{_WORK.text(numbers['net_push_off_work'])} of net work in push-off"]
    if "push_off_share" in numbers:
        clauses[0] += f" (positive work {_SHARE.text(numbers['push_off_share'])} of the healthy ankle's)"
    if "angle_difference" in numbers and "angle_difference" in without:
        angle, angle_without = (_ANGLE.text(metrics["angle_difference"]) for metrics in (numbers, without))
        clauses.append(f"ankle {angle} from the healthy one ({angle_without} without)")
    if "lowest_toes" in numbers:
        drags, drags_without = numbers["lowest_toes"] < 0.0, without.get("lowest_toes", 0.0) < 0.0
        height = "toes would drag" if drags else f"toes {_HEIGHT.text(numbers['lowest_toes'])} over the ground"
        height_without = "also" if drags == drags_without else "would drag" if drags_without else "clear"
        clauses.append(f"{height} ({height_without} without)")
    return clauses
