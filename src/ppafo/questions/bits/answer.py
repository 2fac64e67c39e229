"""The answer about bits: where it was run, and which hash is which."""

from ppafo.answers import Answer, Column, Section, Table
from ppafo.questions.bits.solve import Bits

_HEAD = tuple(map(Column, ("scenario, walk or course", "run", "1,000 draws", "of which failed", "")))


def answer_of(solved: Bits) -> Answer:
    """Return the answer: the same bits as everywhere, or what differs."""
    differing = {name: solved.differing(name) for name in solved.found}
    others = [name for name, parts in differing.items() if parts]
    verdict = (
        f"{', '.join(others)}: not the golden bits"
        if others
        else f"all {len(differing)} have the golden bits, to the last one"
    )
    rows = tuple(
        (name, hashes["run"], hashes["draws"], hashes["failed"], _said(differing[name]))
        for name, hashes in solved.found.items()
    )
    marked = tuple(number for number, name in enumerate(differing) if differing[name])
    where = Table(
        (), tuple({"computer": solved.platform, "processor": solved.processor, "by": solved.compiler}.items())
    )
    remark = "hashes are of the final state and of every recorded sample, with one NaN for all"
    return Answer(
        name="bits",
        kicker="Bits",
        title="The same bits on every computer?",
        lead=(verdict,),
        sections=(
            Section(table=where),
            Section("Hashes", table=Table(_HEAD, rows, marked, left=3), remarks=(remark,)),
        ),
        data={
            "platform": solved.platform,
            "processor": solved.processor,
            "compiler": solved.compiler,
            "hashes": {name: dict(hashes) for name, hashes in solved.found.items()},
            "differs": {name: list(parts) for name, parts in differing.items() if parts},
        },
        passed=solved.is_same,
    )


def _said(differing: tuple[str, ...]) -> str:
    return f"differs: {', '.join(differing)}" if differing else "the same"
