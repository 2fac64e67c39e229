"""The study of intervals under ten kinds of noise: resumable, counted right, and a command."""

import dataclasses
import json
from pathlib import Path

import numpy as np
import pytest

from benchmarks.intervals.calibration import (
    FIVE_PARAMETERS,
    Line,
    Task,
    _clean,
    _planted,
    _recordings,
    repetition,
    run_tasks,
    tasks_of,
)
from benchmarks.intervals.made_by import code_now, whole_lines
from benchmarks.intervals.noise_kinds import NOISE_KINDS, noise_kind
from benchmarks.intervals.planted import planted_problem
from benchmarks.intervals.report import coverage_document, coverage_text, is_good, ranks_figure
from ppafo.errors import IdentificationError
from ppafo.identification.trajectory import FreeParameter
from ppafo.identification.trajectory.fitting import residuals_of
from scripts.interval_coverage import main


def line(kind: str, number: int, below: float) -> Line:
    return Line(kind, number, (below,) * 5, (1.0,) * 5, ("identified",) * 5, False, 0.5, "angle white", 0.1)


def even(count: int) -> list[Line]:
    """Ranks that are as even as can be: 95 % of them lie in the middle."""
    return [line("white", number, (number + 0.5) / count) for number in range(count)]


@pytest.mark.parametrize("name", NOISE_KINDS)
def test_errors_of_every_kind_have_the_covariance_that_the_ideal_width_rests_on(name: str) -> None:
    kind, random = noise_kind(name), np.random.default_rng(1)
    drawn = np.array([kind.draw(12, 1, random) for _ in range(6000)])
    covariance = kind.covariance(12, 1)
    if name.startswith("heavy"):
        # Those are the covariances of normal errors which say as much: white parts of variance 1.5 instead of 3.
        drawn = drawn[:, 1:]
        assert np.median(drawn**2) == pytest.approx(0.585, rel=0.3)
    elif name == "hum":
        assert np.mean(drawn**2, axis=0) == pytest.approx(1.5, rel=0.1)
    else:
        assert np.cov(drawn.T) == pytest.approx(covariance, abs=0.1 * covariance.max())


def test_a_study_goes_on_where_it_was_stopped_and_gives_the_same(tmp_path: Path) -> None:
    file = tmp_path / "fits.jsonl"
    tasks = tasks_of(["white"], 2, 3, False)
    (first,) = run_tasks(tasks[:1], file, 1)
    with file.open("a") as stream:
        stream.write('{"kind": "white", "number": 1, "bel')
    both = run_tasks(tasks, file, 1)
    assert both[0] == first
    again = [dataclasses.replace(one, seconds=0.0) for one in (both[1], repetition(tasks[1]))]
    assert again[0] == again[1]
    kept_lines = [json.loads(one) for one in file.read_text().splitlines()]
    assert [(one["number"], one["code"]) for one in kept_lines] == [(0, code_now()), (1, code_now())]


def test_what_is_added_behind_a_line_that_was_cut_off_is_a_line_of_its_own(tmp_path: Path) -> None:
    file = tmp_path / "truths.jsonl"
    assert whole_lines(file) == []
    file.write_bytes('{"draw": 0, "name": "µ"}\n{"draw": 1, "name": "µ'.encode()[:-1])
    assert [json.loads(one)["draw"] for one in whole_lines(file)] == [0]
    with file.open("a") as stream:
        stream.write('{"draw": 1}\n')
    assert [json.loads(one)["draw"] for one in whole_lines(file)] == [0, 1]


def kept(file: Path, lines: list[Line], code: str | None) -> None:
    """Finished fits in a file, by some code or, where None, by code that did not say what it was."""
    own = {} if code is None else {"code": code}
    documents = [{name: getattr(one, name) for name in Line.__slots__} | own for one in lines]
    file.write_text("".join(f"{json.dumps(document)}\n" for document in documents))


def test_a_study_that_other_code_began_is_refused_by_what_differs_and_left_alone(tmp_path: Path) -> None:
    file = tmp_path / "fits.jsonl"
    kept(file, even(1), "ppafo 0.0.1, identification 0123456789ab")
    before = file.read_bytes()
    refused = (
        r"fits.jsonl: has fits by ppafo 0\.0\.1, identification 0123456789ab \(1\), this is ppafo .*; 1 more would be"
    )
    with pytest.raises(IdentificationError, match=refused):
        run_tasks(tasks_of(["white"], 2, 3, False), file, 1)
    assert file.read_bytes() == before


def test_finished_fits_of_other_code_or_of_none_are_counted_with_a_warning(tmp_path: Path) -> None:
    file, heard = tmp_path / "fits.jsonl", list[str]()
    kept(file, even(1), "ppafo 0.0.1, identification 0123456789ab")
    tasks = tasks_of(["white"], 1, 3, False)
    assert run_tasks(tasks, file, 1, warn=heard.append) == even(1)
    assert [text.partition(", this is")[0] for text in heard] == [
        f"{file}: has fits by ppafo 0.0.1, identification 0123456789ab (1)"
    ]
    kept(file, even(1), None)
    assert run_tasks(tasks, file, 1, warn=heard.append) == even(1)
    assert heard[1:] == [f"{file}: which code made them is not said of 1 of 1 fits; they are counted"]
    kept(file, even(1), code_now())
    assert run_tasks(tasks, file, 1, warn=heard.append) == even(1)
    assert len(heard) == 2


def test_a_truth_from_the_prior_lies_inside_the_posterior() -> None:
    found = repetition(Task("white", 1, 5, True))
    assert all(1e-4 < below < 1.0 - 1e-4 for below in found.below)
    assert all(0.5 < width < 2.0 for width in found.width)
    # White noise loses next to nothing by not being known, so that both say the same of the truth.
    assert found.exact == pytest.approx(found.below, abs=0.1)


def test_recordings_of_the_study_are_more_exact_than_the_runs_of_the_fit() -> None:
    planted, clean = _planted(), _clean()
    recordings = _recordings(planted, "white", np.random.default_rng(6))
    parameters = tuple(FreeParameter(path) for path in FIVE_PARAMETERS)
    residuals = residuals_of(planted_problem(planted, parameters, recordings))
    truth = np.array([item.coordinate(item.start) for item in residuals.ranges])
    near = residuals.around(truth, 1e-3 * np.eye(len(truth)))
    slopes, left, places = near.jacobian_of_data(), near.of_data, iter(residuals.channel_slices())
    for prepared, recording in zip(residuals.experiments, clean, strict=True):
        for channel in prepared.channels:
            # What is left at the truth without noise: with the usual error it moved inertia by 0.06 standard errors.
            left[next(places)] += (channel.values - recording[channel.name]) / channel.noise
    covariance = np.linalg.inv(slopes.T @ slopes)
    assert np.abs(covariance @ slopes.T @ left / np.sqrt(np.diag(covariance))).max() < 0.01


def test_even_ranks_are_good_and_a_table_says_so() -> None:
    lines = even(200)
    assert is_good(lines, False)
    assert is_good(lines, True)
    assert "0 of 5 cells outside" in coverage_text(lines, False)
    assert "leave it in 0.3 of 5 cells" in coverage_text(lines, True)
    assert coverage_text(lines, True).splitlines()[2].split()[7:13] == ["95.0", "%", "-", "1.00", "+0.00", "1.00"]
    assert coverage_document(lines, True)["kinds"][0]["held"]["foot_plate.inertia"] == pytest.approx(0.95)


def test_intervals_that_are_too_narrow_or_lie_aside_are_seen() -> None:
    narrow = [line("white", number, float(np.sin(0.5 * np.pi * (number + 0.5) / 200) ** 2)) for number in range(200)]
    aside = [line("white", number, ((number + 0.5) / 200) ** 2) for number in range(200)]
    assert not is_good(narrow, False)
    assert not is_good(narrow, True)
    assert not is_good(aside, True)
    assert "*" in coverage_text(aside, True).splitlines()[2]


def test_even_random_ranks_leave_the_band_once_in_twenty() -> None:
    random = np.random.default_rng(2)
    outside = sum(
        not is_good([line("white", number, float(below)) for number, below in enumerate(random.random(100))], True)
        for _ in range(300)
    )
    # Binomial, 300 draws of chance 0.05: 15 on the average, and 3 or 33 once in some ten thousand.
    assert 3 < outside < 33


def test_the_figure_has_a_panel_for_each_kind_and_says_synthetic() -> None:
    figure = ranks_figure([*even(50), *(dataclasses.replace(one, kind="hum") for one in even(50))])
    assert [axes.get_title(loc="center") for axes in figure.axes[:2]] == ["white, 50", "hum, 50"]
    assert any("synthetic" in text.get_text().lower() for text in figure.texts)


def test_the_command_writes_table_figure_and_fits(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    words = ["--noise", "white", "--draws", "1", "--threads", "1", "--out", str(out)]
    code = main(words)
    text = capsys.readouterr().out
    assert code == 1  # of one fit all or none of the intervals hold, which is neither 90 nor 98 %
    assert "white" in text
    assert {path.name for path in out.iterdir()} == {
        "coverage.txt",
        "coverage.json",
        "ranks.png",
        "ranks.svg",
        "fits-fixed-2026.jsonl",
        "ppafo.json",
    }
    assert main(words) == 1
    assert main(["--noise", "wite"]) == 2
    assert "did you mean 'white'" in capsys.readouterr().err


def test_a_study_without_repetitions_is_refused() -> None:
    with pytest.raises(IdentificationError, match="at least one repetition"):
        tasks_of(["white"], 0, 1, False)
