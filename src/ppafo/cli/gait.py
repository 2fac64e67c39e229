"""``ppafo gait``: the gaits that there are, and a synthetic recording of one."""

from pathlib import Path

from ppafo.cli import output
from ppafo.cli.output import Said
from ppafo.errors import DataError


def list_gaits() -> Said:
    """Return names and titles of the gaits of the package."""
    from ppafo.gait import list_gaits, load_gait

    titles = {name: load_gait(name).title for name in list_gaits()}
    width = max(map(len, titles))
    lines = [f"{name:<{width}}  {title}" for name, title in titles.items()]
    return Said("\n".join(lines), {"gaits": [{"name": name, "title": title} for name, title in titles.items()]})


def record_gait(gait: str | Path, strides: int, out: Path) -> Said:
    """Write some strides of a gait as a synthetic recording."""
    from ppafo.gait import load_gait, walk_recording
    from ppafo.storage import write_csv

    if out.suffix.lower() != ".csv":
        raise DataError(f"--out {out}: a recording is written as .csv")
    output.check_new_file(out)
    recording = walk_recording(load_gait(gait), strides)
    write_csv(out, recording)
    document = {"file": str(out), "samples": len(recording), "channels": list(recording.names)}
    return Said(f"written: {out} ({len(recording)} samples, synthetic)", document)
