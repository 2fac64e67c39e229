"""Any actuator walks: a cylinder with a lever, soft ones that were measured, and a vane that another package wrote."""

from collections.abc import Iterator
from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from ppafo.model.catalog import ACTUATORS
from ppafo.walking import load_walk, walk
from ppafo.walking.figures.mean_stride import walk_figure
from ppafo.walking.walk import WalkResult, compare_walks
from tests.actuators import vane_of_others
from tests.actuators.soft import soft

EXAMPLES = Path(__file__).parents[2] / "actuators"
CYLINDER = "device.set=cylinder-lever"
BLADDER = f"device.set={EXAMPLES / 'measured-bladder.toml'}"
NOISY = ("sensors.pressure_noise=0.1 psi_d", "sensors.angle_noise=0.2 deg", "sensors.pressure_bandwidth=100 Hz")
MINUTES = 0.25


@pytest.fixture(scope="module", autouse=True)
def _with_the_kind_of_another_package() -> Iterator[None]:
    ACTUATORS["vane_of_others"] = vane_of_others.KIND
    yield
    del ACTUATORS["vane_of_others"]


def written_by_others(folder: Path) -> str:
    """The set of the paper with the vane of another package."""
    text = (resources.files("ppafo.parameters") / "sets" / "ppafo2011.toml").read_text(encoding="utf-8")
    text = text.replace("[actuator.torque_constant]", '[actuator]\nkind = "vane_of_others"\n\n[actuator.displacement]')
    text = text.replace('unit = "m^3"', 'unit = "m^3/rad"', 1).replace('key = "ppafo-2011/k_actuator"\n', "")
    (folder / "others.toml").write_text(text, encoding="utf-8")
    return f"device.set={folder / 'others.toml'}"


def assert_walks(result: WalkResult) -> None:
    """A device begins with vented chambers, has gas of a possible pressure, and takes gas to the end."""
    supply = result.scenario.device.supply
    recording = result.recording
    pressures = np.array([recording[name] for name in ("pressure_1", "pressure_2") if name in recording])
    assert result.status.is_completed
    assert pressures[:, 0] == pytest.approx([supply.atmospheric_pressure] * len(pressures))
    assert pressures.min() > 0.4 * supply.atmospheric_pressure
    assert result.metrics["gas"].value > 0.0


def test_the_vane_of_another_package_walks_as_the_built_in_one(tmp_path: Path) -> None:
    # Gains of a vane follow it at a right angle, those of another kind in the middle of its range.
    given = ("controller.torque_gain=4 1/(N m)", "controller.torque_integral_gain=300 1/(N m s)", *NOISY)
    ours = walk(load_walk("proportional", given), minutes=MINUTES)
    theirs = walk(load_walk("proportional", [written_by_others(tmp_path), *given]), minutes=MINUTES)
    assert theirs.scenario.device.actuator.kind == "vane_of_others"
    for name, channel in ours.recording.channels.items():
        largest = float(np.max(np.abs(channel.values)))
        assert theirs.recording[name] == pytest.approx(channel.values, abs=1.0e-12 * largest), name


@pytest.mark.parametrize("walked", ["proportional", "proportional-regulators"])
@pytest.mark.parametrize("chambers", [1, 2])
def test_a_soft_actuator_helps_a_walk_and_nothing_stops_it(walked: str, chambers: int, tmp_path: Path) -> None:
    result = walk(load_walk(walked, [soft(tmp_path, chambers), "supply.pressure=50 psi_g", *NOISY]), minutes=MINUTES)
    assert_walks(result)
    assert result.metrics["net_push_off_work"].value > 0.5
    assert 0.02 < result.metrics["gas"].value / 1.0e-3 < 3.0


@pytest.mark.parametrize(
    ("walked", "actuator"),
    [("proportional", CYLINDER), ("proportional-regulators", CYLINDER), ("proportional", BLADDER)],
    ids=["cylinder", "cylinder-lines", "bladder"],
)
def test_a_cylinder_and_a_bladder_walk_and_nothing_stops_them(walked: str, actuator: str) -> None:
    compared = compare_walks(load_walk(walked, [actuator, *NOISY]), minutes=MINUTES)
    result, bare = compared.with_device, compared.without_device
    assert_walks(result)
    # Also of one chamber, which has no second pressure to draw or to store, with the device or without it.
    chambers = {"pressure_1"} if actuator == BLADDER else {"pressure_1", "pressure_2"}
    for channels in (result.recording.names, bare.recording.names, bare.averages):
        assert {name for name in channels if name.startswith("pressure")} == chambers
    assert walk_figure({"with": result}).axes
