"""The device in models of MuJoCo: a plugin of ``ppafo export mujoco`` is loaded, put at a joint, and read by name.

    import mujoco
    from ppafo.worlds.mujoco import add_device, load_plugin, outputs_of

    device = load_plugin("out/plugin")
    spec = mujoco.MjSpec.from_file("person.xml")
    add_device(spec, device, "exo_r", joint="ankle_angle_r", gear=-1.0)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data)
    print(outputs_of(model, data, device, "exo_r")["pressure_1"])

Needs the extra ``mujoco``. How to use it: docs/how-to/mujoco.md.
"""

import ctypes
import json
import platform
from collections.abc import Mapping
from dataclasses import dataclass
from numbers import Real
from pathlib import Path
from typing import Any

from ppafo.errors import ScenarioError, nearest_name, one_line

try:
    import mujoco
except ImportError as error:
    raise ImportError("ppafo.worlds.mujoco needs MuJoCo: pip install 'ppafo[mujoco]'") from error

_LIBRARIES = {"Linux": "linux64", "Windows": "win64"}
_NUMBERS = "device.json"
_IDENTITY = "ppafo_plugin_identity"
"""The function of a library that says which export it is, and nothing where MuJoCo has another one of its name."""
_SECTIONS = (slice(40, 48), slice(58, 60), slice(60, 62))
"""Where an ELF library of 64 bits says at which byte its table of sections is, how long an entry is, and how many."""


@dataclass(frozen=True, slots=True)
class Plugin:
    """A plugin that is loaded: its name, what it gives by name with the unit, what can be set, what the joint needs.

    ``attributes`` [SI] are as the scenario has them; ``joint`` has lowest_angle and highest_angle [rad] of the device,
    armature [kg m^2], damping [N m s/rad] and frictionloss [N m].
    """

    name: str
    outputs: Mapping[str, str]
    attributes: Mapping[str, float]
    joint: Mapping[str, float]


def load_plugin(folder: str | Path) -> Plugin:
    """Load the plugin of a folder of ``ppafo export mujoco``; a second time it only reads the numbers.

    ScenarioError where the folder is none, or its library is damaged, or for another MuJoCo or another system.
    """
    plugin, version, identity, libraries = _read_numbers(folder)
    if version != mujoco.__version__:
        raise ScenarioError(
            f"{folder}: built for MuJoCo {version}, this is {mujoco.__version__}: run 'ppafo export mujoco' again"
        )
    library = libraries.get(_LIBRARIES.get(platform.system(), ""))
    if library is None:
        raise ScenarioError(f"{folder}: no library for {platform.system()}; it has: {', '.join(libraries)}")
    path = (Path(folder) / library).resolve()
    if not path.is_file():
        raise ScenarioError(f"{folder}: {library} is missing: run 'ppafo export mujoco' again")
    if not _is_whole(path.read_bytes(), plugin.name):
        raise ScenarioError(
            f"{folder}: {library} is damaged, or not of plugin {plugin.name}: run 'ppafo export mujoco' again"
        )
    try:
        mujoco.mj_loadPluginLibrary(str(path))
    except mujoco.FatalError as error:
        raise ScenarioError(f"{folder}: {one_line(error)}: run 'ppafo export mujoco' again") from error
    identity_of = getattr(ctypes.CDLL(str(path)), _IDENTITY)
    identity_of.restype = ctypes.c_char_p
    if not identity or identity_of() != identity.encode():
        raise ScenarioError(
            f"{folder}: another {plugin.name} is loaded, and a process takes one plugin of a name;"
            " change the attributes of that one, or start a new process"
        )
    return plugin


def _is_whole(library: bytes, name: str) -> bool:
    """Whether a library has the names that it must have and, in the format of Linux, the table of sections at its end.

    The loader of Linux kills the process where a library was cut.
    """
    end = 0
    if library.startswith(b"\x7fELF"):
        table, size, count = (int.from_bytes(library[at], "little") for at in _SECTIONS)
        end = table + size * count
    return all(word + b"\0" in library for word in (name.encode(), _IDENTITY.encode())) and end <= len(library)


def _read_numbers(folder: str | Path) -> tuple[Plugin, str, str, dict[str, str]]:
    """What a folder says: the plugin, the version of MuJoCo, which export it is, and the library of each system."""
    try:
        numbers = json.loads((Path(folder) / _NUMBERS).read_text(encoding="utf-8"))
        libraries = {system: _text(file) for system, file in numbers["libraries"].items()}
        plugin = Plugin(
            _text(numbers["plugin"]),
            {item["name"]: item["unit"] for item in numbers["outputs"]},
            {item["name"]: float(item["value"]) for item in numbers["attributes"]},
            {key: float(value) for key, value in numbers["joint"].items()},
        )
        return plugin, _text(numbers["mujoco"]), _text(numbers["identity"]), libraries
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise ScenarioError(f"{folder}: no folder of 'ppafo export mujoco' ({_NUMBERS} cannot be read)") from error


def _text(value: object) -> str:
    """A text of the numbers; TypeError where it is none."""
    if not isinstance(value, str):
        raise TypeError(f"{value!r} is no text")
    return value


def add_device(
    spec: Any,
    plugin: Plugin,
    name: str,
    joint: str,
    gear: float = 1.0,
    neutral: float | None = None,
    settings: Mapping[str, float] | None = None,
) -> None:
    """Put the device at a hinge joint of an ``MjSpec``: instance, actuator and sensor of that ``name``.

    ``gear`` -1 where the joint counts dorsiflexion as positive; ``neutral`` is the angle of the device with the joint
    at 0 [rad], ``settings`` change attributes [SI]. The joint keeps its limits, and gets the inertia and friction of
    the device on top of its own. ScenarioError for a name that is not known, a gear other than 1 and -1,
    or a setting that is no number.
    """
    _joint(spec, joint)
    if not isinstance(gear, Real) or gear not in (1.0, -1.0):
        raise ScenarioError(f"gear {gear!r}: must be 1 or -1, because the vane sits on the joint")
    given = {**(settings or {}), **({} if neutral is None else {"neutral": neutral})}
    for key, value in given.items():
        if key not in plugin.attributes:
            hint = nearest_name(key, plugin.attributes)
            raise ScenarioError(f"'{key}' is no attribute of {plugin.name}{hint}; README.md of its folder lists them")
        if not isinstance(value, Real):
            raise ScenarioError(f"{key} {value!r}: must be a number in the SI unit that README.md of its folder lists")
    if not any(item.plugin_name == plugin.name for item in spec.plugins):
        spec.activate_plugin(plugin.name)
    instance = spec.add_plugin(name=name, plugin_name=plugin.name)
    instance.config = {key: repr(float(value)) for key, value in given.items()}
    actuator = spec.add_actuator(
        name=name,
        trntype=mujoco.mjtTrn.mjTRN_JOINT,
        target=joint,
        gear=[gear, 0.0, 0.0, 0.0, 0.0, 0.0],
        ctrllimited=True,
        ctrlrange=[-1.0, 1.0],
    )
    sensor = spec.add_sensor(name=name, type=mujoco.mjtSensor.mjSENS_PLUGIN)
    for item in (actuator, sensor):
        item.plugin.plugin_name = plugin.name
        item.plugin.name = name
        item.plugin.active = True
    add_friction(spec, plugin, joint)


def add_friction(spec: Any, plugin: Plugin, joint: str) -> None:
    """Give a hinge joint of an ``MjSpec`` the inertia and friction of the device on top of its own; no actuator.

    ``add_device`` does it; alone it is for an ideal actuator on the same joint.
    """
    found = _joint(spec, joint)
    found.armature += plugin.joint["armature"]
    found.frictionloss += plugin.joint["frictionloss"]
    if isinstance(found.damping, float):
        found.damping += plugin.joint["damping"]
    else:
        # Of newer versions of MuJoCo it is the first of several coefficients.
        found.damping[0] += plugin.joint["damping"]


def _joint(spec: Any, name: str) -> Any:
    """A hinge joint of a spec by name."""
    found = next((item for item in spec.joints if item.name == name), None)
    if found is None:
        names = [item.name for item in spec.joints]
        raise ScenarioError(f"the model has no joint '{name}'{nearest_name(name, names)}")
    if found.type != mujoco.mjtJoint.mjJNT_HINGE:
        raise ScenarioError(f"joint '{name}' is not a hinge: the vane turns about one axis")
    return found


def outputs_of(model: Any, data: Any, plugin: Plugin, name: str) -> dict[str, float]:
    """What the device of that name gives, in SI units by name: pressures, torque, command, gas supplied and vented.

    It is that of the moment at which the last step ended. ScenarioError for a name that the model does not have.
    """
    instance = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_PLUGIN, name)
    if instance < 0:
        names = [mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_PLUGIN, number) for number in range(model.nplugin)]
        raise ScenarioError(f"the model has no plugin instance '{name}'{nearest_name(name, filter(None, names))}")
    first = int(model.plugin_stateadr[instance])
    values = data.plugin_state[first : first + len(plugin.outputs)]
    return {key: float(value) for key, value in zip(plugin.outputs, values, strict=True)}
