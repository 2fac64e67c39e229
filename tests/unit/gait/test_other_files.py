"""Gaits in .txt and .mat files, doubled columns, and maps that do not say everything."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import scipy.io

from ppafo.errors import DataError
from ppafo.gait.recorded import ImportSettings, import_gait
from ppafo.gait.recorded.mapping import load_map
from ppafo.signals.recording import Floats
from tests.unit.gait.laboratory import MASS, markers, trc

TIME = np.arange(0.0, 5.2, 0.01)


def labelled(columns: dict[str, Floats]) -> dict[str, Floats]:
    return {header.partition(" ")[0]: values for header, values in columns.items()}


@pytest.mark.parametrize("layout", ["variables", "structure", "labels"])
def test_a_walk_in_a_matlab_file_is_the_walk(
    columns: dict[str, Floats], csv_of: Callable[..., Path], tmp_path: Path, layout: str
) -> None:
    wanted = import_gait([csv_of(columns)], ImportSettings(62.0)).gait
    named = labelled(columns)
    time = np.loadtxt(tmp_path / "walk.csv", delimiter=",", skiprows=1)[:, 0]
    path = tmp_path / "walk.mat"
    if layout == "variables":
        scipy.io.savemat(path, {"time": time[:, None], **{name: values[None, :] for name, values in named.items()}})
    elif layout == "structure":
        scipy.io.savemat(path, {"walk": {"t": time, **named}})
    else:
        labels = np.array(["time", *named], dtype=object)
        scipy.io.savemat(path, {"walk": {"data": np.column_stack([time, *named.values()]), "colheaders": labels}})
    prefix = "walk." if layout == "structure" else ""
    map_file = tmp_path / "map.toml"
    map_file.write_text(
        f"""
schema_version = 1
shank_angle = {{ terms = ["{prefix}shank_angle"], unit = "rad" }}
ankle_angle = {{ terms = ["{prefix}ankle_angle"], unit = "rad", positive = "plantarflexion", neutral = "90 deg" }}
vertical_force = {{ terms = ["{prefix}vertical_force"], unit = "-" }}
"""
    )
    found = import_gait([path], ImportSettings(62.0, columns=load_map(map_file))).gait
    for name in ("shank_angle", "ankle_angle", "vertical_force"):
        assert np.allclose(found.curve(name).cosines, wanted.curve(name).cosines)


def test_a_doubled_marker_that_is_needed_is_named_by_its_number(tmp_path: Path) -> None:
    walk = markers(TIME)
    path = trc(tmp_path / "walk.trc", TIME, {**walk, "STRAY": walk["RKNE"] + 100.0})
    path.write_text(path.read_text().replace("STRAY", "RKNE"))
    with pytest.raises(
        DataError, match=r"has several different columns 'RKNE'; choose 'RKNE#1' or 'RKNE#2' in a gait map"
    ):
        import_gait([path], ImportSettings(MASS))
    map_file = tmp_path / "map.toml"
    map_file.write_text(
        'schema_version = 1\nshank_angle = { knee = "RKNE#1", ankle = "RANK", forward = "x" }\n'
        'ankle_angle = { heel = "RHEE", toe = "RTOE", positive = "plantarflexion" }\n'
    )
    found = import_gait([path], ImportSettings(MASS, columns=load_map(map_file)))
    # The axes that the map does not say are found in the markers.
    assert not [remark for remark in found.remarks if "gait map does not give" in remark]
    turned = tmp_path / "turned.toml"
    turned.write_text(map_file.read_text().replace(', forward = "x"', "").replace("forward", ""))
    again = import_gait([path], ImportSettings(MASS, columns=load_map(turned)))
    assert again.gait.shank_angle == found.gait.shank_angle
