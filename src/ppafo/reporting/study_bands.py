"""Quantile bands over time: the outermost pair of quantiles light, the next darker, the median as a line."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

from ppafo.signals.channels import CHANNELS
from ppafo.studies.sweep.results import StudyResults

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MEDIAN = 0.5
_OPACITIES = (0.18, 0.32, 0.45)


def draw_bands(axes: "Axes", results: StudyResults, channel: str, colours: Mapping[str, str]) -> None:
    """Draw the bands of a channel for every configuration, in SI units."""
    table = results.bands()
    shares = sorted(float(name[1:]) for name in table if name.startswith("q"))
    pairs = [(low, high) for low, high in zip(shares, reversed(shares), strict=True) if low < high]
    for name, colour in colours.items():
        own = (table["configuration"] == name) & (table["channel"] == channel)
        time = table["time"][own]
        for (low, high), opacity in zip(pairs, _OPACITIES, strict=False):
            axes.fill_between(
                time, table[f"q{low:g}"][own], table[f"q{high:g}"][own], color=colour, alpha=opacity, linewidth=0
            )
        if _MEDIAN in shares:
            axes.plot(time, table["q0.5"][own], color=colour, label=name)
    axes.set_xlabel("time (s)")
    unit = CHANNELS[channel].unit.replace("-", "")
    label = channel.replace("_", " ")
    axes.set_ylabel(f"{label} ({unit})" if unit else label)
    told = ", ".join(f"{100.0 * share:g}" for share in shares)
    axes.set_title(f"{label}: {told} % of runs below", fontsize=9)
