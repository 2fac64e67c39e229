"""Commands on parameter sets."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from ppafo.arguments import Overrides, SetName

if TYPE_CHECKING:
    from ppafo.cli.output import CommandOutput
    from ppafo.report.finding import Finding


def sets_list() -> CommandOutput:
    """List the parameter sets that come with the package.

    >>> print(sets_list().text)
    cylinder-lever     Cylinder with a lever: a measured cylinder on an assumed joint
    ppafo2011          Portable powered ankle-foot orthosis, completed
    ppafo2011-printed  Portable powered ankle-foot orthosis, exactly as reported
    """
    from ppafo.cli.output import listing
    from ppafo.parameters import list_sets, load_parameter_set

    sets = [load_parameter_set(name) for name in list_sets()]
    rows = [{"name": item.name, "title": item.title, "valves": dict(item.valve_kinds)} for item in sets]
    return listing("set", rows, ("name", "title"))


def sets_show(name: SetName, *, overrides: Overrides = ()) -> Finding[dict[str, Any]]:
    """Show every value of a parameter set with its source.

    >>> sets_show("ppafo2011").said[0]
    'ppafo2011: Portable powered ankle-foot orthosis, completed'
    """
    from ppafo.analyses.sets.values import shown_values
    from ppafo.parameters import apply_overrides, load_parameter_set

    return shown_values(apply_overrides(load_parameter_set(name), overrides))


def sets_audit(
    names: Sequence[SetName], *, parent: SetName | None = None, all_: bool = False, overrides: Overrides = ()
) -> Finding[dict[str, Any]]:
    """Check a parameter set for contradictions.

    Changes and findings of one set, or a table of several; exit code 1 where a finding is an error.

    names: name of a set, or a .toml file; several are shown side by side
    parent: show what changed against this set, in place of the one that the file names
    all_: print what concerns no changed value too, of a set with a parent or --set

    >>> audited = sets_audit(["ppafo2011-printed"])
    >>> print(str(audited).splitlines()[0])
    error: reported.velocity_over_acceleration is inverted: its unit belongs to the reciprocal
    [velocity-over-acceleration-upside-down]
    >>> audited.passed
    False
    """
    from ppafo.analyses.sets.audit import audited

    return audited(names, parent, all_, tuple(overrides))
