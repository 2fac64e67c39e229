"""Common interface of results with a recording: channels in any unit, tables, and display in a notebook."""

import base64
import html
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from ppafo.engine.lanes import Floats
from ppafo.signals.recording import Recording
from ppafo.simulation.scenario import Scenario, scenario_document
from ppafo.units.shown import in_units

if TYPE_CHECKING:
    import pandas  # type: ignore[import-untyped]
    import xarray
    from matplotlib.figure import Figure

    from ppafo.metrics.metric import Metric


in_own_units = in_units(lambda result, *_, **__: result.scenario.device.shown)
"""Texts and figures of a result in the display units of its device."""


class RecordedResult:
    """Result of a scenario or a walk, with its recording."""

    __slots__ = ()

    if TYPE_CHECKING:

        @property
        def scenario(self) -> Scenario:
            """Scenario of the run."""

        @property
        def recording(self) -> Recording:
            """Channels of the run."""

        @property
        def metrics(self) -> "Mapping[str, Metric]":
            """Metrics of the run by name."""

        @property
        def status(self) -> Any:
            """End of the run: a ``Status``."""

        def _figure(self) -> "Figure":
            """Return the figure of the run."""

    @in_own_units
    def plot(self, width: float | str | None = None) -> "Figure":
        """Return the figure of the run; ``.savefig(...)`` saves it.

        ``width`` is the width in print, such as "84 mm", or a number [m]; by default 145 mm.
        """
        from ppafo.report.style import drawn_at, shown

        with drawn_at(width):
            return shown(self._figure())

    def __getitem__(self, channel: str | tuple[str, str]) -> Floats:
        """Return a channel's values, in SI (``result["torque"]``) or a given unit (``result["pressure_1", "psi_g"]``).

        ``result["time"]`` are the times of the samples [s]. Raises DataError for an unknown channel, and UnitError for
        a unit that does not fit the channel.
        """
        return self.recording.values_of(channel, self.scenario.device.supply.atmospheric_pressure)

    def __iter__(self) -> Iterator[str]:
        """Yield ``time`` and the channel names, for iteration and ``in``."""
        yield from ("time", *self.recording.names)

    def _ipython_key_completions_(self) -> list[str]:
        return list(self)

    @in_own_units
    def _repr_html_(self) -> str:
        from ppafo.report.kind import metric_text, metric_words
        from ppafo.report.style import png_of

        head = html.escape(str(self).partition("\n")[0])
        rows = []
        for name, metric in self.metrics.items():
            cells = (metric_words(name), metric_text(metric.value, metric.unit), metric.summary)
            rows.append("".join(f'<td style="text-align: left">{html.escape(cell)}</td>' for cell in cells))
        table = "".join(f"<tr>{row}</tr>" for row in rows)
        picture = base64.b64encode(png_of(self.plot())).decode()
        return (
            f"<p><b>{head}</b></p><table>{table}</table>"
            f'<img alt="{head}" style="max-width: 100%" src="data:image/png;base64,{picture}">'
        )

    def dataset(self, units: Mapping[str, str] | None = None) -> "xarray.Dataset":
        """Return the recording as an xarray Dataset; attributes hold units, long names and the scenario as JSON.

        Channels are in SI units unless ``units`` gives another unit for them, such as ``{"pressure_1": "psi_g"}``.
        """
        from ppafo.storage import dataset_of

        atmosphere = self.scenario.device.supply.atmospheric_pressure
        return dataset_of(self.recording, scenario_document(self.scenario), units, atmosphere)

    def to_dataframe(self, units: Mapping[str, str] | None = None) -> "pandas.DataFrame":
        """Return the channels as columns indexed by time [s]; ``units`` as in ``dataset``."""
        table = self.dataset(units)
        frame = table.to_dataframe()
        # pandas keeps no attributes of columns.
        frame.attrs = {**table.attrs, "units": {str(name): table[name].attrs["units"] for name in table.data_vars}}
        return frame
