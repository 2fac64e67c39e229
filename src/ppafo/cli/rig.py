"""``ppafo rig``: what the virtual test rig can do, and synthetic recordings from it."""

import argparse
from pathlib import Path

from ppafo.cli import output
from ppafo.errors import ParameterError
from ppafo.units import number_text

_DEFAULT_OUT = Path("out") / "rig"


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of this command."""
    actions = parser.add_subparsers(dest="action", metavar="ACTION", required=True)
    listing = actions.add_parser(
        "list", help="list experiments and presets", description="List experiments and presets."
    )
    output.add_json_argument(listing)
    recording = actions.add_parser(
        "record",
        help="run an experiment on the virtual rig",
        description="Write the recording of a laboratory, marked as synthetic, and rig.json with the true values.",
    )
    recording.add_argument("experiment", metavar="EXPERIMENT", help="name of an experiment; see 'ppafo rig list'")
    recording.add_argument(
        "--preset", metavar="PRESET", default="paper-bench", help="preset or .toml file; default paper-bench"
    )
    recording.add_argument("--seed", metavar="N", default="1", help="random seed of noise and offsets; default 1")
    recording.add_argument(
        "--device", metavar="SET", default="ppafo2011", help="parameter set or .toml file; default ppafo2011"
    )
    recording.add_argument("--valve", metavar="NAME", help="valve of the parameter set; default: its default valve")
    output.add_override_argument(recording)
    output.add_json_argument(recording)
    recording.add_argument(
        "--out", metavar="DIR", type=Path, default=_DEFAULT_OUT, help="folder of the recording; default out/rig"
    )


def run(parsed: argparse.Namespace) -> int:
    """List what there is, or record one experiment."""
    if parsed.action == "list":
        from ppafo.rig import list_presets, load_preset
        from ppafo.rig.experiments import EXPERIMENTS

        experiments = {item.name: item.summary for item in EXPERIMENTS.values()}
        presets = {name: load_preset(name).title for name in list_presets()}
        width = max(map(len, [*experiments, *presets]))
        lines = ["experiments (recordings are synthetic):"]
        lines += [f"  {name:<{width}}  {summary}" for name, summary in experiments.items()]
        lines += ["presets:"]
        lines += [f"  {name:<{width}}  {title}" for name, title in presets.items()]
        document = {
            "experiments": [{"name": name, "summary": summary} for name, summary in experiments.items()],
            "presets": [{"name": name, "title": title} for name, title in presets.items()],
        }
        output.print_result("\n".join(lines), document, parsed.json)
        return output.EXIT_GOOD
    return _record(parsed)


def _record(parsed: argparse.Namespace) -> int:
    from ppafo.rig.experiments import NOTICE, check_rig_folder, find_experiment, record, write_rig_recording

    find_experiment(parsed.experiment)
    seed = _whole_number(parsed.seed)
    with output.blame_out_option():
        check_rig_folder(parsed.out, parsed.experiment)
    made = record(parsed.experiment, parsed.preset, seed, parsed.device, parsed.overrides, parsed.valve)
    files = write_rig_recording(parsed.out, made)
    counted = f"{len(made.recording)} samples of {', '.join(made.recording.names)}"
    text = f"{parsed.experiment}: {NOTICE}\n{counted}\nwritten: {parsed.out} ({', '.join(files)})"
    document = {"folder": str(parsed.out), "files": list(files), **made.truth}
    output.print_result(text, document, parsed.json)
    return output.EXIT_GOOD


def _whole_number(text: str) -> int:
    try:
        return int(number_text(text))
    except ValueError as error:
        raise ParameterError(f"--seed {text}: must be a whole number") from error
