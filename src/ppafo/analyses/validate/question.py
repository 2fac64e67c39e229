"""Public function ``validate``: comparison of a parameter set with recordings."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from ppafo.arguments import Duration, Name, Overrides, Volume, Word, checked
from ppafo.plugins import Plugins, name_plugins
from ppafo.progress import Progress, Report, report_nothing

if TYPE_CHECKING:
    from pandas import DataFrame  # type: ignore[import-untyped]
    from xarray import Dataset

    from ppafo.analyses.validate.result import Validation
    from ppafo.report.finding import Finding
    from ppafo.signals import Recording
    from ppafo.storage.column_map import ColumnMap

SetLike = Annotated[str | Path, Word("PARAMETERS")]
ColumnsLike = Annotated["ColumnMap | str | Path", Word("FILE.toml[:NAME]")]
Recorded = Annotated["Recording | DataFrame | Dataset | str | Path", Word("RECORDING")]
Motion = Annotated[str, Word("free|measured|locked|leg")]
Initial = Annotated[str, Word("CHANNEL=VALUE")]
Limits = Annotated[Sequence[str], Word("[CHANNEL=]LIMIT", option="--threshold")]


@checked
def validate(
    parameter_set: SetLike,
    recordings: Sequence[Recorded],
    *,
    valve: Name | None = None,
    overrides: Overrides = (),
    motion: Motion = "free",
    volume: Volume | None = None,
    initial: Sequence[Initial] = (),
    thresholds: Limits = (),
    longest_delay: Duration = 0.02,
    columns: ColumnsLike | None = None,
    plugins: Plugins = (),
    progress: Report | None = None,
) -> Finding[Validation]:
    """Compare a parameter set with recordings, channel by channel.

    The model is run on the recorded command, supply pressure and external torque; residuals are measured - model.
    Without thresholds, an RMS error may be 3 % of full range, or less if that is over half of the variance of the
    signal, in addition to noise and the usual zero error of the sensor. A cause of the residual is named in any case.

    Arguments:
        parameter_set: name of a parameter set, or a .toml file
        recordings: a .csv or .nc file, or a result folder; several may be given
        valve: valve of the parameter set; default: its default valve
        overrides: values to change, for example 'valve.area=12.6 mm^2'; may be repeated
        motion: free: the model moves the vane; measured: the vane follows the recorded angle; locked: the vane stays at
            its initial angle; leg: the model moves vane and foot on the fixture of step-response (default free)
        volume: no vane: the valve fills and vents chamber 1 of this fixed volume, for example '60 cm^3'; pressure_1 is
            compared
        initial: initial value of a channel that was not recorded, for example 'pressure_2=0 psi_g'
        thresholds: maximum RMS error, as a fraction of full range or with a unit: 5%, angle=10%, 'pressure_1=3.7
            psi_d'; default: 3%, and half of the variance of the signal is explained
        longest_delay: maximum delay of the measurement to estimate; default '20 ms', '0 s' for none
        columns: file with a column map [columns.NAME], for recordings with other column names; a problem file may
            contain it
        plugins: modules of your own, files or names, whose objects files may name
        progress: called with every count of a long computation

    Returns:
        a Finding whose ``found`` is a Validation with ``passes`` and, in ``recordings``, one ``RecordingAgreement``
        each: ``measured`` and ``model`` are recordings, their channels of shape (samples,) in SI; ``channels`` has
        RMS error, bias, largest error and delay [s] of each channel in its SI unit (rad, Pa, N m)

    Raises:
        DataError: a recording that cannot be used
        ParameterError: a parameter set that cannot be used
        SimulationError: a model that cannot be run on the recording

    >>> import ppafo
    >>> folder = ppafo.simulate("step-response").save("bench")
    >>> print(ppafo.validate("ppafo2011", [folder], motion="leg", overrides=["supply.pressure=55 psi_g"]).said[0])
    ppafo2011 agrees with 1 recording: every RMS error is within its limit; nothing but noise is left
    """
    name_plugins(plugins)
    from ppafo.analyses.validate.answer import finding_of
    from ppafo.analyses.validate.result import Validation
    from ppafo.parameters import load_device
    from ppafo.validation.agreement import compare_recording
    from ppafo.validation.causes import causes_of
    from ppafo.validation.measured import read_all
    from ppafo.validation.settings import replay_settings

    report = progress or report_nothing
    device = load_device(parameter_set, overrides=overrides, valve=valve)
    device.check_pressurised("a validation, which counts in parts of the gauge supply pressure,")
    settings = replay_settings(device, motion, volume, initial, thresholds, longest_delay)
    read, agreements = read_all(recordings, device, columns), []
    for measured in read:
        report(Progress(f"replaying {measured.file}"))
        agreements.append(compare_recording(measured, device, settings))
    causes = causes_of(read, agreements, device, settings, report)
    return finding_of(Validation(str(parameter_set), device, tuple(overrides), settings, tuple(agreements), causes))
