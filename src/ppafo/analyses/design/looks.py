"""Styles of the design figures: one colour per valve, a ring around the suggested device."""

from ppafo.report.style import BLACK, BLUE, GREEN, GREY, ORANGE, VERMILION

COLOURS = (BLUE, VERMILION, GREEN, ORANGE, "#CC79A7", "#56B4E9", BLACK, GREY)
RING = {"linestyle": "", "marker": "o", "markersize": 9, "markerfacecolor": "none", "markeredgewidth": 1.4}
