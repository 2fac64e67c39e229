"""Trial of a unit on this computer: it is loaded and compared with Python before delivery."""

import ctypes
from collections.abc import Sequence
from contextlib import closing
from ctypes import c_bool, c_char_p, c_double, c_int, c_size_t, c_uint, c_void_p
from pathlib import Path
from typing import Any, final

from ppafo.errors import ProgramError
from ppafo.exports.c_library.expected import expected_csv
from ppafo.exports.c_library.plant import EXAMPLE
from ppafo.exports.fmu.interface import Interface
from ppafo.exports.fmu.variables import variables_of
from ppafo.storage.files import temporary_folder

_NAME = b"trial"
_CO_SIMULATION = 1
"""Instance type fmi2CoSimulation of FMI 2."""


@final
class _Fmi2:
    """Instance of FMI 2; its calls return the status, 0 for success."""

    def __init__(self, library: ctypes.CDLL, token: str) -> None:
        self.library = library
        library.fmi2Instantiate.restype = c_void_p
        words = (c_char_p(_NAME), c_int(_CO_SIMULATION), c_char_p(token.encode()), c_char_p(None))
        self.instance = c_void_p(library.fmi2Instantiate(*words, c_void_p(None), c_int(0), c_int(0)))

    def begin(self, numbers: Any, values: Any) -> int:
        """Set the inputs and initialise up to the first sample; return the status."""
        experiment = (c_int(0), c_double(0.0), c_double(0.0), c_int(0), c_double(0.0))
        return int(
            self.library.fmi2SetupExperiment(self.instance, *experiment)
            or self.library.fmi2EnterInitializationMode(self.instance)
            or self.library.fmi2SetReal(self.instance, numbers, c_size_t(len(numbers)), values)
            or self.library.fmi2ExitInitializationMode(self.instance)
        )

    def advance(self, time: float, length: float) -> int:
        """Perform one communication step of ``length`` [s] from ``time`` [s]; return the status."""
        return int(self.library.fmi2DoStep(self.instance, c_double(time), c_double(length), c_int(1)))

    def read(self, numbers: Any, values: Any) -> int:
        """Read outputs into ``values``; return the status."""
        return int(self.library.fmi2GetReal(self.instance, numbers, c_size_t(len(numbers)), values))

    def close(self) -> None:
        """Free the instance."""
        self.library.fmi2FreeInstance(self.instance)


@final
class _Fmi3:
    """Instance of FMI 3, without event mode, with the methods of ``_Fmi2``."""

    def __init__(self, library: ctypes.CDLL, token: str) -> None:
        self.library = library
        library.fmi3InstantiateCoSimulation.restype = c_void_p
        flags = (c_bool(False),) * 4
        nothing = (c_void_p(None), c_size_t(0), c_void_p(None), c_void_p(None), c_void_p(None))
        words = (c_char_p(_NAME), c_char_p(token.encode()), c_char_p(None))
        self.instance = c_void_p(library.fmi3InstantiateCoSimulation(*words, *flags, *nothing))

    def begin(self, numbers: Any, values: Any) -> int:
        """Set the inputs and initialise up to the first sample; return the status."""
        count = c_size_t(len(numbers))
        experiment = (c_bool(False), c_double(0.0), c_double(0.0), c_bool(False), c_double(0.0))
        return int(
            self.library.fmi3EnterInitializationMode(self.instance, *experiment)
            or self.library.fmi3SetFloat64(self.instance, numbers, count, values, count)
            or self.library.fmi3ExitInitializationMode(self.instance)
        )

    def advance(self, time: float, length: float) -> int:
        """Perform one communication step of ``length`` [s] from ``time`` [s]; return the status."""
        flags, last = [ctypes.byref(c_bool()) for _ in range(3)], ctypes.byref(c_double())
        return int(self.library.fmi3DoStep(self.instance, c_double(time), c_double(length), c_bool(True), *flags, last))

    def read(self, numbers: Any, values: Any) -> int:
        """Read outputs into ``values``; return the status."""
        count = c_size_t(len(numbers))
        return int(self.library.fmi3GetFloat64(self.instance, numbers, count, values, count))

    def close(self) -> None:
        """Free the instance."""
        self.library.fmi3FreeInstance(self.instance)


def check_unit(interface: Interface, fmi: int, token: str, library: bytes) -> None:
    """Load the library of a unit on this computer and compare its outputs with the Python run, to the bit.

    Raises ProgramError if it cannot be loaded, a call fails, or an output differs.
    """
    head, *lines = expected_csv(interface.run, interface.library.program.outputs).decode().splitlines()
    rows = [[float(text) for text in line.split(",")] for line in lines]
    numbers = {variable.name: variable.number for variable in variables_of(interface)}
    outputs = head.split(",")[1:]
    inputs = {item.name: EXAMPLE if item.name == "command" else item.start for item in interface.inputs}
    with temporary_folder("ppafo-unit", {"unit": library}) as folder:
        try:
            functions = ctypes.CDLL(str(Path(folder, "unit")))
        except OSError as error:
            raise ProgramError(
                f"{interface.library.title}: the FMU was built but cannot be loaded here: {error}"
            ) from error
        instance: _Fmi2 | _Fmi3 = _Fmi2(functions, token) if fmi == 2 else _Fmi3(functions, token)
        with closing(instance):
            output_numbers = _array(c_uint, [numbers[name] for name in outputs])
            values = (c_double * len(outputs))()
            status = instance.begin(
                _array(c_uint, [numbers[name] for name in inputs]), _array(c_double, list(inputs.values()))
            )
            previous_time = 0.0
            for time, *expected in rows:
                if time > 0.0:
                    status = status or instance.advance(previous_time, time - previous_time)
                status = status or instance.read(output_numbers, values)
                previous_time = time
                for name, value, python_value in zip(outputs, values, expected, strict=True):
                    if status or value != python_value:
                        problem = f"{name} is {value!r}, Python has {python_value!r}" if not status else "a call fails"
                        raise ProgramError(
                            f"{interface.library.title}: the FMU differs from the Python run at {time:g} s: "
                            f"{problem}; no file was written"
                        )


def _array(kind: Any, values: Sequence[Any]) -> Any:
    return (kind * len(values))(*values)
