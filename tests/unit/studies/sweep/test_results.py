"""Reading results: by configuration, thinned, by channel, and what is not there."""

from pathlib import Path

import numpy as np
import pytest

from ppafo.errors import DataError, StudyError
from ppafo.studies.sweep.results import StudyResults, load_study_results


def test_a_thinned_column_has_every_so_many_runs_across_chunks(small_results: StudyResults) -> None:
    whole = small_results.by_configuration("rms_error")
    for most, step in ((1000, 1), (11, 3), (7, 5)):
        for name, values in small_results.thinned("rms_error", most).items():
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
    with pytest.raises(DataError, match="holds no results of a study"):
        load_study_results(tmp_path)
