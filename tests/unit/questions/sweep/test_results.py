"""Reading results: by configuration, thinned, by channel, and what is not there."""

import json
from pathlib import Path

import numpy as np
import pytest

import ppafo
from ppafo.errors import DataError, StudyError
from ppafo.questions.sweep.results import StudyResults, load_study_results


def test_a_thinned_column_has_every_so_many_runs_across_chunks(small_results: StudyResults) -> None:
    whole = small_results.by_configuration("rms_error")
    for most, step in ((1000, 1), (11, 3), (7, 5)):
        for name, values in small_results.thin("rms_error", most).items():
            np.testing.assert_array_equal(values, whole[name][::step])


def test_results_load_again_from_their_folder(small_results: StudyResults) -> None:
    again = load_study_results(small_results.place.address)
    assert again.summary == small_results.summary
    assert again.name == "small"
    assert again.configurations == ("proportional", "solenoid")
    assert again.varied == ("reference.level", "supply.pressure", "actuator.leak.area")
    assert "32 runs: 32 completed, 0 diverged, 0 refused" in repr(again)


def test_a_channel_that_was_not_kept_is_named_with_the_nearest(small_results: StudyResults) -> None:
    with pytest.raises(StudyError, match=r"no trajectories of 'torqe' were kept, did you mean 'torque'\?"):
        small_results.trajectories("torqe")


def test_a_folder_without_results_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="contains no study results"):
        load_study_results(tmp_path)


def test_results_do_what_everything_solved_does(small_results: StudyResults, tmp_path: Path) -> None:
    small_results.save(tmp_path / "saved")
    names = {path.name for path in (tmp_path / "saved").iterdir()}
    assert names == {"figure.png", "figure.svg", "ppafo.json", "report.html", "sweep.json", "sweep.txt"}
    stored = json.loads((tmp_path / "saved" / "sweep.json").read_text(encoding="utf-8"))
    assert stored == small_results.to_dict() == {**small_results.summary, "folder": small_results.place.address}
    page = (tmp_path / "saved" / "report.html").read_text(encoding="utf-8")
    assert "of their normal scores" in page
    assert "Sampled by sobol: 8 draws, seed 3." in page
    with pytest.raises(LookupError, match="there is no figure 'pareto'; available: figure"):
        small_results.plot("pareto")


def test_the_name_of_an_earlier_version_says_the_new_one() -> None:
    with pytest.raises(AttributeError, match=r"ppafo\.run_study is now called ppafo\.sweep"):
        _ = ppafo.run_study
