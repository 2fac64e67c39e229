"""C source of a shared library from composed text: exported entries, and a test of separate rounding.

Loading a cached program does not import this module.
"""

from collections.abc import Mapping

from ppafo.engine.compilers import LIBRARY
from ppafo.engine.entries import FLOAT
from ppafo.translation.c99 import c_source
from ppafo.translation.native_entries import PACKED, ROUNDS_AS_WRITTEN, Parameters, parameters_of
from ppafo.translation.walk import walk_module

_TITLE = "Generated from the functions of ppafo. Not to be edited."
_ROUNDING = f"""\
int {ROUNDS_AS_WRITTEN}(double a, double b, double c, double d);
int {ROUNDS_AS_WRITTEN}(double a, double b, double c, double d)
{{
#if defined(__x86_64__)
    /* Start-up code of unsafe arithmetic flushes small numbers of the whole thread to zero: undo that. */
    const unsigned int control = __builtin_ia32_stmxcsr();
    if ((control & 0x8040u) != 0u) {{
        __builtin_ia32_ldmxcsr(control & ~0x8040u);
        return 0;
    }}
#endif
    return a * b + c == 0.0 && (b + d) - b == 0.0;
}}
"""
"""C source of the function that returns 1 if every operation is rounded separately.

Fused or reordered operations leave a remainder for the arguments in ``fill_module``.
"""


def translated_text(source: str) -> str:
    """Translate composed text to C. Raises ProgramError if that is not possible."""
    return with_packed_entries(c_source(walk_module(source, library=LIBRARY), {}, _TITLE), parameters_of(source))


def with_packed_entries(source: str, parameters: Mapping[str, Parameters]) -> str:
    """Return a translation unit whose only exports are its entries, with arrays in one block.

    All other functions are static. An exported function ``advance`` would conflict with the function of this name in
    the GNU C library.
    """
    texts = ["#define PPAFO_ENTRY static", source]
    for name, (dimensions, types) in parameters.items():
        numbers = [f"number_{index}" for index in range(len(types))]
        declared = [
            f"{'double' if kind == FLOAT else 'int64_t'} {number}" for kind, number in zip(types, numbers, strict=True)
        ]
        taken = ", ".join(["const ppafo_array *arrays", *declared])
        passed = ", ".join([*(f"arrays[{index}]" for index in range(len(dimensions))), *numbers])
        texts.append(f"void {name}{PACKED}({taken})\n{{\n    {name}({passed});\n}}\n")
    return "\n".join([*texts, _ROUNDING])
