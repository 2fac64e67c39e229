"""Common style of all figures: fonts, colours, sizes, and rendering to files; fast import of Matplotlib."""

import importlib
import importlib.util
import io
import logging
import sys
from collections.abc import Iterable, Iterator
from contextlib import AbstractContextManager, contextmanager
from contextvars import ContextVar
from functools import partial
from types import MappingProxyType, ModuleType
from typing import TYPE_CHECKING, Any, NamedTuple

from ppafo.arguments import FigureWidth
from ppafo.arguments.values import accepted_values
from ppafo.errors import DataError
from ppafo.signals import RecordingKind
from ppafo.wording import one_line, set_within

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BLACK = "#1a1a1a"
GREY = "#6e6e6e"
BLUE = "#0072B2"
VERMILION = "#D55E00"
GREEN = "#009E73"
ORANGE = "#E69F00"
PURPLE = "#A33F77"
"""Colours that are distinguishable with any kind of colour vision (Okabe and Ito, 2008)."""
COLOURS = (BLUE, VERMILION, GREEN, ORANGE, BLACK, GREY)
"""Colours of several lines of the same kind, in order."""
DASHES = MappingProxyType(
    {
        VERMILION: (0, (6, 1.5, 1.2, 1.5)),
        GREEN: (0, (3.5, 1.3)),
        ORANGE: (0, (1.2, 1.2)),
        PURPLE: (0, (5, 2)),
        GREY: (0, (6, 1.2, 1.2, 1.2, 1.2, 1.2)),
    }
)
"""Dashes by colour, for lines of several colours, some of which are equal in greyscale; other colours are solid."""
MARKERS = MappingProxyType({VERMILION: "s", GREEN: "^", ORANGE: "D", PURPLE: "v", BLACK: "P", GREY: "X"})
"""Marker of a data series by its colour; the default is a circle."""
RESOLUTION = 150
"""Resolution of a PNG file [dots per inch]."""
FULL_WIDTH = 5.7
"""Width of a figure from which on its font is 10 pt [inches]: 145 mm, the text of a thesis."""
# Smallest font scale relative to a figure of full width (8 pt for 10 pt), and smallest font size [points].
_SMALLEST_SCALE = 0.8
_SMALLEST_TEXT = 7.0
_INCHES_PER_METRE = 1.0 / 0.0254
_AXES_IN_SPACE = "mpl_toolkits.mplot3d"


class DrawingStyle(NamedTuple):
    """Drawing style of a data series in all figures and on the interactive page: colour, line style and marker."""

    colour: str
    line: str = "-"
    marker: str = "o"


PROPORTIONAL = DrawingStyle(BLUE)
SOLENOID = DrawingStyle(VERMILION, marker="s")
CHAMBER_1 = DrawingStyle(GREEN, marker="^")
CHAMBER_2 = DrawingStyle(PURPLE, line="-.", marker="v")
REFERENCE = DrawingStyle(BLACK, line="--")
REFERENCE_2 = DrawingStyle(BLACK, line=":")
"""Style of a second reference in the same panel."""
EXPERIMENT = DrawingStyle(GREY, marker=".")
"""Style of measurements, from a real or a simulated test bench."""
ACTUAL = DrawingStyle(BLUE)
"""Style of a device regardless of its valve."""
_VALVES = MappingProxyType({"proportional": PROPORTIONAL, "solenoid": SOLENOID})


def look_of_valve(kind: str) -> DrawingStyle:
    """Return the drawing style of a device by its kind of valve."""
    return _VALVES.get(kind, ACTUAL)


_SETTINGS: Any = MappingProxyType(
    {
        "font.family": "sans-serif",
        "font.sans-serif": ["DejaVu Sans"],
        "axes.titleweight": "normal",
        "axes.titlelocation": "left",
        "axes.titley": 1.0,  # where it stands anyway; to find that out costs a quarter of the time of drawing
        "axes.edgecolor": GREY,
        "axes.labelcolor": BLACK,
        "axes.linewidth": 0.8,
        "axes.spines.top": False,
        "axes.spines.right": False,
        "axes.grid": True,
        "axes.axisbelow": True,
        # Numbers that stand for themselves: no offset and no power of ten beside an axis.
        "axes.formatter.useoffset": False,
        "axes.formatter.limits": (-5, 7),
        "grid.color": "#e3e3e3",
        "grid.linewidth": 0.7,
        "xtick.color": GREY,
        "ytick.color": GREY,
        "xtick.labelcolor": BLACK,
        "ytick.labelcolor": BLACK,
        "lines.linewidth": 1.6,
        "lines.solid_capstyle": "round",
        "legend.frameon": False,
        "figure.facecolor": "white",
        "savefig.dpi": RESOLUTION,
        # Letters as outlines, as a page fetches no font; ids that are the same every time.
        "svg.fonttype": "path",
        # TrueType: many publishers refuse the Type 3 fonts that Matplotlib embeds by default.
        "pdf.fonttype": 42,
        "svg.hashsalt": "ppafo",
    }
)


_FONT_SIZES = MappingProxyType(
    {"font.size": 10.0, "axes.titlesize": 11.0, "axes.labelsize": 10.0, "legend.fontsize": 9.0}
)
"""Font sizes at full width [points]."""
_width: ContextVar[float | None] = ContextVar("_width", default=None)


def drawn_at(width: float | str | None) -> AbstractContextManager[None]:
    """Draw figures within a ``with`` block at a width: a text with unit, or a number [m]; None for their default.

    Raises ArgumentError for any other width.
    """
    metres = None if width is None else accepted_values(FigureWidth).take("width", width)
    return set_within(_width, _width.get() if metres is None else metres * _INCHES_PER_METRE)


def print_scale() -> float:
    """Return the size of fonts and heights relative to a figure of full width [-]; 1 without a width."""
    return min(1.0, max(_SMALLEST_SCALE, (_width.get() or FULL_WIDTH) / FULL_WIDTH))


def printed_width(own: float) -> float:
    """Return the width of a figure [inches]: the width of ``drawn_at``, else ``own``."""
    return _width.get() or own


def font_size(size: float) -> float:
    """Return the font size [points] of a text that has this size at full width."""
    return max(_SMALLEST_TEXT, size * print_scale())


@contextmanager
def house_style() -> Iterator[None]:
    """Apply the common style of figures within a ``with`` block; other Matplotlib settings are restored afterwards."""
    import matplotlib

    with matplotlib.rc_context():
        # Settings of the user's own file would change figures from computer to computer.
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_SETTINGS | {name: font_size(size) for name, size in _FONT_SIZES.items()})
        yield


def render_figure(figure: "Figure", file_formats: Iterable[str]) -> dict[str, bytes]:
    """Render a figure to file content by format (``png``, ``svg``, ``pdf``); equal figures give equal bytes."""
    # A date would give the same figure other bytes every second.
    undated: dict[str, Any] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
    files = {}
    with house_style():
        for file_format in file_formats:
            buffer = io.BytesIO()
            figure.savefig(buffer, format=file_format, metadata=undated.get(file_format))
            files[file_format] = buffer.getvalue()
    return files


def png_of(figure: "Figure") -> bytes:
    """Return a figure as PNG bytes, for a notebook."""
    return render_figure(figure, ("png",))["png"]


def shown(figure: "Figure") -> "Figure":
    """Return the figure, prepared for display in a notebook with or without a backend, and for publishers."""
    vars(figure).update(_repr_png_=partial(png_of, figure), savefig=partial(_save, figure))
    return figure


def _save(figure: "Figure", *arguments: Any, **options: Any) -> None:
    """Save a figure as ``Figure.savefig`` does, with TrueType fonts: many publishers refuse Type 3 fonts.

    The settings of Matplotlib, which other figures of the caller share, remain as they are.
    """
    import matplotlib

    with matplotlib.rc_context({"pdf.fonttype": 42, "ps.fonttype": 42}):
        type(figure).savefig(figure, *arguments, **options)


def lay_out(figure: "Figure") -> None:
    """Compute the layout of a figure once, then fix it: resizing keeps the proportions."""
    layout = figure.get_layout_engine()
    for axes in figure.axes:
        # The number of ticks follows the font that is set when a figure is saved, unless its axes have one.
        axes.tick_params(labelsize=font_size(_FONT_SIZES["font.size"]))
    if layout is not None:
        # Twice: the ticks follow the length of their axis, and their labels take room.
        layout.execute(figure)
        layout.execute(figure)
        figure.set_layout_engine("none")
    for axes in figure.axes:
        title, box = axes._left_title, axes.get_window_extent()  # type: ignore[attr-defined]
        # A title that is longer than its panel is wide begins further left.
        excess = title.get_window_extent().x1 - figure.bbox.x1 + 8.0 if title.get_text() else 0.0
        if excess > 0.0:
            title.set_x(-min(excess, box.x0) / box.width)


def mark_kind(figure: "Figure", kind: RecordingKind) -> None:
    """Write "simulated" or "synthetic" at the top right of a figure; nothing for measured data."""
    if kind == "measured":
        return
    # In inches from the edge, as figures have many heights.
    inch = print_scale() / figure.get_figheight()
    size = font_size(9.0)
    figure.text(0.972, 1.0 - 0.12 * inch, kind, ha="right", va="top", color=GREY, fontsize=size, style="italic")


def load_drawing() -> None:
    """Import Matplotlib without property tables in docstrings, three-dimensional axes and TeX glyph names.

    The glyph names are loaded at first use. Raises DataError if a Matplotlib setting of the user prevents the import.
    """
    if "matplotlib.artist" in sys.modules:
        return
    _load_late("fontTools.agl")
    # Its two lines about a folder that cannot be written say nothing of the result.
    logging.getLogger("matplotlib").setLevel(logging.ERROR)
    try:
        import matplotlib.artist
    except ValueError as error:
        settings = "its settings: MPLBACKEND in the environment, or a file matplotlibrc"
        raise DataError(f"Matplotlib refuses {settings}: {one_line(error)}") from error

    # ``set`` of an artist is marked as made by matplotlib, and does not list in its signature what it takes.
    without_signature = classmethod(lambda artist: setattr(artist.set, "_autogenerated_signature", True))
    flat = ModuleType(_AXES_IN_SPACE)
    flat.__dict__["Axes3D"] = None
    sys.modules[_AXES_IN_SPACE] = flat
    try:
        with (
            _replaced(matplotlib.artist, "kwdoc", lambda _artist: ""),
            _replaced(matplotlib.artist.Artist, "_update_set_signature_and_docstring", without_signature),
        ):
            import matplotlib.figure
    finally:
        del sys.modules[_AXES_IN_SPACE]


def _load_late(name: str) -> None:
    """Defer the import of a module until its first use; a module that is not installed is ignored."""
    package, _, own = name.rpartition(".")
    if name in sys.modules or importlib.util.find_spec(package) is None:
        return
    stand_in = ModuleType(name)

    def of_module(attribute: str) -> Any:
        if attribute.startswith("__"):
            raise AttributeError(attribute)
        if sys.modules.get(name) is stand_in:
            del sys.modules[name]
        return getattr(importlib.import_module(name), attribute)

    stand_in.__dict__["__getattr__"] = of_module
    sys.modules[name] = stand_in
    setattr(importlib.import_module(package), own, stand_in)


@contextmanager
def _replaced(owner: Any, name: str, stand_in: object) -> Iterator[None]:
    """Replace an attribute of a module or class within a ``with`` block; does nothing if there is no such attribute."""
    before = vars(owner).get(name)
    if before is None:
        yield
        return
    setattr(owner, name, stand_in)
    try:
        yield
    finally:
        setattr(owner, name, before)
