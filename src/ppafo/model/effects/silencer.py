"""Silencer downstream of the valve's exhaust: two restrictions in series between a chamber and the atmosphere."""

from typing import Annotated, Any, NamedTuple

from ppafo.model.declaration import Number
from ppafo.model.effects.kind import Effect
from ppafo.model.orifice import conductance_in_series, sonic_conductance_mass
from ppafo.model.ports import exhaust_path


class Silencer(NamedTuple):
    """Inverse square of the silencer's conductance [(s Pa/kg)^2]; 0 without a silencer."""

    resistance: float


def behind_silencer(conductance: float, silencer: Silencer) -> float:
    """Conductance [kg/(s Pa)] of valve and silencer in series, given the valve's: ``1/C^2 = 1/C_v^2 + 1/C_s^2``."""
    return exhaust_path(conductance_in_series(conductance, silencer.resistance))


class SilencerSettings(NamedTuple):
    """Settings of a silencer on the vents, described by the sonic conductance of ISO 6358."""

    sonic_conductance: Annotated[
        float, Number("m^3/(s Pa)", "sonic conductance C of the silencer, 0 for none", 0.0, 0.0, 1.0e-4)
    ]


def prepare(settings: SilencerSettings, device: Any) -> Silencer:
    """Parameters from the sonic conductance of the silencer, defined by ISO 6358, and the gas of the device."""
    sonic, gas = settings.sonic_conductance, device.gas
    conductance = sonic_conductance_mass(sonic, gas.specific_gas_constant, gas.temperature)
    return Silencer(1.0 / (conductance * conductance) if sonic > 0.0 else 0.0)


EFFECT = Effect(
    name="silencer",
    summary="A silencer at the exhaust of the valve, in series with it.",
    settings=SilencerSettings,
    parameters=Silencer,
    prepare=prepare,
    switch=("sonic_conductance",),
    laws={exhaust_path: behind_silencer},
    source="ISO 6358-3:2014, restrictions in series, with equal critical ratios and far from choking",
    equation="1/C^2 = 1/C_v^2 + 1/C_s^2",
    symbols=(
        (
            "1/C_s^2",
            "resistance",
            "(s Pa/kg)^2",
            "one over the square of the conductance of a silencer, a mesh or a line",
        ),
    ),
)
