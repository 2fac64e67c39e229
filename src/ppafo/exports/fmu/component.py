"""A unit as one WebAssembly component for every computer, as the draft of the layered standard ``fmi-ls-wasm`` has it.

The draft maps the C functions of FMI 3.0 onto an interface in WIT, whose world ``co-simulation-fmu`` is written out
here: a component that exports ``fmi:fmi3/common`` and ``fmi:fmi3/co-simulation``, with a resource for an instance.
Around the C of a unit stands ``templates/component.c`` (one function for each of the interface, with the flat numbers
of the canonical ABI) and around its module the text of a component, which the package wasmtime makes binary.
"""

import importlib.util
from collections.abc import Mapping, Sequence

from ppafo.errors import ProgramError
from ppafo.exports.templates import template

VERSION = "3.0.0"
FOLDER = "extra/org.modelica.fmi-ls-wasm"
MANIFEST = b"""<?xml version="1.0" encoding="UTF-8"?>
<fmiLayeredStandardManifest xmlns:fmi-ls="http://fmi-standard.org/fmi-ls-manifest"
    fmi-ls:fmi-ls-name="org.modelica.fmi-ls-wasm"
    fmi-ls:fmi-ls-version="0.1.0"
    fmi-ls:fmi-ls-description="FMI Layered Standard for WebAssembly"/>
"""
SOURCE, STUBS = "component.c", "without.c"
"""The file to compile, and one of the functions that no unit of ppafo has."""
FLAGS = (
    *("-mcpu=generic+simd128+bulk_memory", "-mexec-model=reactor", "-Wl,--import-memory"),
    *("-Wl,-z,stack-size=262144", "-Wl,--initial-memory=1048576"),
)
PAGES = 16
"""Pages of 64 KiB that the memory begins with, as the flags have it."""
HOW_TO_INSTALL = "pip install 'ppafo[component]'"
INSTANCE = "co-simulation-instance"

Signature = tuple[Sequence[tuple[str, str]], str]
"""Names and types of what a function is given, and the type of its result; names of types in braces."""

_BASIC = {
    "value-reference": "u32",
    "status": '(enum "ok" "warning" "discard" "error" "fatal")',
    "fmu-state": "(list u8)",
    "interval-qualifier": '(enum "interval-not-yet-known" "interval-unchanged" "interval-changed")',
    "interval-fraction": '(record (field "counter" u64) (field "resolution" u64))',
    "dependency-kind": '(enum "dependent" "constant" "fixed" "tunable" "discrete")',
    "variable-dependency": '(record (field "dependent-value-reference" {value-reference})'
    ' (field "element-index-of-dependent" u32) (field "independent-value-reference" {value-reference})'
    ' (field "element-index-of-independent" u32) (field "kind" {dependency-kind}))',
    "discrete-states-info": '(record (field "new-discrete-states-needed" bool) (field "terminate-simulation" bool)'
    ' (field "nominals-of-continuous-states-changed" bool) (field "values-of-continuous-states-changed" bool)'
    ' (field "next-event-time-defined" bool) (field "next-event-time" f64))',
}
_OWN = {
    "do-step-result": '(record (field "last-successful-time" f64) (field "event-handling-needed" bool)'
    ' (field "terminate-simulation" bool) (field "early-return" bool))'
}
_NUMBERS = {
    **{f"float{bits}": f"f{bits}" for bits in (32, 64)},
    **{f"{sign}int{bits}": f"{'u' if sign else 's'}{bits}" for sign in ("", "u") for bits in (8, 16, 32, 64)},
    **{"boolean": "bool", "string": "string", "binary": "(list u8)", "clock": "bool"},
}
_REFERENCES = "(list {value-reference})"
_REQUESTS = "(list (tuple {value-reference} u32))"
_PLAIN = (
    *("exit-initialization-mode", "enter-event-mode", "terminate", "reset", "enter-configuration-mode"),
    *("exit-configuration-mode", "evaluate-discrete-states", "enter-step-mode"),
)


def _or_status(kind: str) -> str:
    return f"(result {kind} (error {{status}}))"


def _methods() -> dict[str, Signature]:
    """What can be done with an instance."""
    references, status = ("value-references", _REFERENCES), "{status}"
    derivative = [("unknowns", _REFERENCES), ("knowns", _REFERENCES), ("seed", "(list f64)")]
    found: dict[str, Signature] = {
        "set-debug-logging": ([("logging-on", "bool"), ("categories", "(list string)")], status),
        "enter-initialization-mode": (
            [("tolerance", "(option f64)"), ("start-time", "f64"), ("stop-time", "(option f64)")],
            status,
        ),
        **{name: ([], status) for name in _PLAIN},
        "update-discrete-states": ([], _or_status("{discrete-states-info}")),
        **{f"get-{name}": ([references], _or_status(f"(list {kind})")) for name, kind in _NUMBERS.items()},
        **{f"set-{name}": ([references, ("values", f"(list {kind})")], status) for name, kind in _NUMBERS.items()},
        "get-number-of-variable-dependencies": ([("vr", "{value-reference}")], _or_status("u64")),
        "get-variable-dependencies": ([("dependent", "{value-reference}")], _or_status("(list {variable-dependency})")),
        "get-fmu-state": ([], _or_status("{fmu-state}")),
        "set-fmu-state": ([("state", "{fmu-state}")], status),
        **{f"get-{kind}-derivative": (derivative, _or_status("(list f64)")) for kind in ("directional", "adjoint")},
        "get-interval-decimal": ([references], _or_status("(list (tuple f64 {interval-qualifier}))")),
        "get-interval-fraction": (
            [references],
            _or_status("(list (tuple {interval-fraction} {interval-qualifier}))"),
        ),
        "get-shift-decimal": ([references], _or_status("(list f64)")),
        "get-shift-fraction": ([references], _or_status("(list {interval-fraction})")),
        "set-input-derivatives": ([("requests", _REQUESTS), ("values", "(list f64)")], status),
        "get-output-derivatives": ([("requests", _REQUESTS)], _or_status("(list f64)")),
        "do-step": (
            [
                *((f"{name}", "f64") for name in ("current-communication-point", "communication-step-size")),
                ("no-set-fmu-state-prior-to-current-point", "bool"),
            ],
            _or_status("{do-step-result}"),
        ),
    }
    for what in ("interval", "shift"):
        found[f"set-{what}-decimal"] = ([references, (f"{what}s", "(list f64)")], status)
        found[f"set-{what}-fraction"] = ([references, (f"{what}s", "(list {interval-fraction})")], status)
    return found


METHODS = _methods()
_NEW: Signature = (
    [
        *((name, "string") for name in ("instance-name", "instantiation-token")),
        *((name, "bool") for name in ("visible", "logging-on", "event-mode-used", "early-return-allowed")),
        ("required-intermediate-variables", _REFERENCES),
    ],
    f"(option (own {{{INSTANCE}}}))",
)


def sources_of_component(sources: Mapping[str, bytes], main: str) -> dict[str, bytes]:
    """The sources of a unit with what stands around them; ``main`` is the file of theirs that is compiled."""
    text = template("fmu", SOURCE)
    around = text.replace("@main@", main)
    return {**sources, SOURCE: around.encode(), STUBS: _stubs(text).encode()}


def _stubs(text: str) -> str:
    """Functions in C of what is not in ``component.c``: they free what they are given, and say that there is none."""
    lines = []
    for name, (given, result) in METHODS.items():
        own = name.replace("-", "_")
        if f"SHOWN({own})" in text or f"PLAIN({own}," in text:
            continue
        lists = [place for place, (_, kind) in enumerate(given) if kind.startswith("(list")]
        parameters = [
            f"void *list_{place}, int32_t count_{place}" if place in lists else f"int32_t given_{place}"
            for place in range(len(given))
        ]
        freed = [
            f"    discard_list(list_{place}, {f'count_{place}' if _holds_lists(given[place][1]) else '0'});"
            for place in lists
        ]
        unused = [f"    (void){word.split()[-1]};" for item in parameters for word in item.split(", ")]
        count = f"count_{lists[0]}" if lists else "1"
        returns, value = ("int32_t", "without") if result == "{status}" else ("uint8_t *", "nothing_of")
        head = f"{returns} SHOWN({own})({', '.join(['unit_instance *self', *parameters])})"
        lines += [head, "{", *unused, *freed, f"    return {value}(self, {count});", "}", ""]
    return "\n".join(lines)


def _holds_lists(kind: str) -> bool:
    return kind in ("(list string)", "(list (list u8))")


def component_of(core: bytes) -> bytes:
    """The component around a module of ``component.c``. ProgramError without the package wasmtime."""
    if importlib.util.find_spec("wasmtime") is None:
        raise ProgramError(f"platform wasm32 needs the package wasmtime ({HOW_TO_INSTALL})")
    import wasmtime

    # Text holds no module in its bytes: an empty one stands for it, the second of the component.
    component = bytes(wasmtime.wat2wasm(_text()))
    found, at, seen = component[:8], 8, 0
    while at < len(component):
        kind, size, shift = component[at], 0, 0
        at += 1
        while True:
            size |= (component[at] & 127) << shift
            shift += 7
            at += 1
            if component[at - 1] < 128:
                break
        content = core if kind == 1 and seen == 1 else component[at : at + size]
        seen += kind == 1
        found += bytes([kind]) + _length(len(content)) + content
        at += size
    return found


def _length(value: int) -> bytes:
    """A whole number in the 7 bits a byte of the format."""
    found = b""
    while value > 127:
        found, value = found + bytes([value & 127 | 128]), value >> 7
    return found + bytes([value])


def _named(text: str, before: str) -> str:
    """A type with the names of others in it."""
    for name in (*_BASIC, *_OWN, INSTANCE):
        text = text.replace(f"{{{name}}}", f"${before}{name}")
    return text


def _function(signature: Signature, before: str = "") -> str:
    given, result = signature
    parameters = " ".join(f'(param "{name}" {kind})' for name, kind in given)
    return _named(f"(func {parameters} (result {result}))", before)


def _functions() -> dict[str, Signature]:
    """All functions of the interface by their names there."""
    self = ("self", f"(borrow {{{INSTANCE}}})")
    methods = {f"[method]{INSTANCE}.{name}": ([self, *given], result) for name, (given, result) in METHODS.items()}
    return {f"[static]{INSTANCE}.instantiate-co-simulation": _NEW, **methods}


def _text() -> str:
    """The text of the component, with an empty module in the place of that of the unit."""
    interface = f"fmi:fmi3/co-simulation@{VERSION}"
    return "\n".join(
        [
            "(component",
            *_imports(),
            *_modules(),
            *(f"(type ${name} {_named(kind, '')})" for name, kind in _OWN.items()),
            *_lifted(),
            *_outside(),
            f'(export "fmi:fmi3/common@{VERSION}" (instance $common)) (export "{interface}" (instance $simulation)))',
        ]
    )


def _imports() -> list[str]:
    """The types of the standard, and the one callback that a unit of ppafo calls."""
    types = [
        f'(type $plain-{name} {_named(kind, "")}) (export "{name}" (type ${name} (eq $plain-{name})))'
        for name, kind in _BASIC.items()
    ]
    return [
        "(type $of-types (instance",
        *types,
        "))",
        f'(import "fmi:fmi3/types@{VERSION}" (instance $types (type $of-types)))',
        *(f'(alias export $types "{name}" (type ${name}))' for name in _BASIC),
        "(type $of-callbacks (instance (alias outer 1 $status (type $outer))",
        '(export "status" (type $status (eq $outer)))',
        '(type $said (func (param "instance-name" string) (param "status" $status) (param "category" string)',
        '(param "message" string))) (export "log-message" (func (type $said)))))',
        f'(import "fmi:fmi3/callbacks@{VERSION}" (instance $callbacks (type $of-callbacks)))',
        '(alias export $callbacks "log-message" (func $log-message))',
    ]


def _modules() -> list[str]:
    """The memory, the module of the unit on it, and a small one that makes a handle of a new instance."""
    words = " ".join(["i32"] * 10)
    handed = " ".join(f"(local.get {place})" for place in range(10))
    return [
        f'(core module $memory-module (memory (export "memory") {PAGES}))',
        "(core instance $memory (instantiate $memory-module))",
        '(alias core export $memory "memory" (core memory $memory))',
        "(core func $log (canon lower (func $log-message) (memory $memory) string-encoding=utf8))",
        '(core instance $for-unit (export "memory" (memory $memory)) (export "log_message" (func $log)))',
        "(core module $unit-module)",
        '(core instance $unit (instantiate $unit-module (with "env" (instance $for-unit))))',
        *(f'(alias core export $unit "{name}" (core func ${name}))' for name in ("drop", "cabi_realloc")),
        f"(type ${INSTANCE} (resource (rep i32) (dtor (core func $drop))))",
        f"(core func $handle (canon resource.new ${INSTANCE}))",
        '(core module $making-module (import "env" "memory" (memory 1)) (import "env" "handle" (func $handle',
        f'(param i32) (result i32))) (import "unit" "instantiate" (func $instantiate (param {words}) (result i32)))',
        '(import "unit" "room" (func $room (result i32))) (func (export "instantiate")',
        f"(param {words}) (result i32) (local $made i32)",
        f"(local.set $made (call $instantiate {handed}))",
        "(i32.store8 (call $room) (i32.ne (local.get $made) (i32.const 0)))",
        "(if (local.get $made) (then (i32.store offset=4 (call $room) (call $handle (local.get $made)))))",
        "(call $room)))",
        '(core instance $for-making (export "memory" (memory $memory)) (export "handle" (func $handle)))',
        '(core instance $making (instantiate $making-module (with "env" (instance $for-making))',
        '(with "unit" (instance $unit))))',
    ]


def _lifted() -> list[str]:
    """The functions of the modules as those of the interface."""
    lines = []
    for place, (name, signature) in enumerate(_functions().items()):
        own = name.partition(".")[2].replace("-", "_")
        source = "making" if name.startswith("[static]") else "unit"
        shown = "instantiate" if source == "making" else own
        lines += [
            f'(alias core export ${source} "{shown}" (core func $core-{place}))',
            f"(type $of-{place} {_function(signature)})",
            f"(func $function-{place} (type $of-{place}) (canon lift (core func $core-{place}) (memory $memory)",
            "(realloc $cabi_realloc) string-encoding=utf8))",
        ]
    return [
        *lines,
        '(alias core export $unit "get_version" (core func $core-version))',
        "(func $version (result string) (canon lift (core func $core-version) (memory $memory) string-encoding=utf8))",
        '(instance $common (export "get-version" (func $version)))',
    ]


def _outside() -> list[str]:
    """A component within that gives types and functions the names of the interface."""
    names, functions = (*_BASIC, *_OWN, INSTANCE), list(_functions().items())
    lines = ["(component $naming"]
    for name, kind in {**_BASIC, **_OWN}.items():
        lines.append(f"(type $plain-{name} {_named(kind, 'in-')})")
        lines.append(f'(import "import-type-{name}" (type $in-{name} (eq $plain-{name})))')
    lines.append(f'(import "import-type-{INSTANCE}" (type $in-{INSTANCE} (sub resource)))')
    for place, (_, signature) in enumerate(functions):
        lines.append(f"(type $in-of-{place} {_function(signature, 'in-')})")
        lines.append(f'(import "import-func-{place}" (func $in-{place} (type $in-of-{place})))')
    lines += [f'(export ${name} "{name}" (type $in-{name}))' for name in names]
    for place, (name, signature) in enumerate(functions):
        lines.append(f"(type $of-{place} {_function(signature)})")
        lines.append(f'(export "{name}" (func $in-{place}) (func (type $of-{place})))')
    types = [f'(with "import-type-{name}" (type ${name}))' for name in names]
    handed = [f'(with "import-func-{place}" (func $function-{place}))' for place in range(len(functions))]
    return [*lines, ")", "(instance $simulation (instantiate $naming", *types, *handed, "))"]
