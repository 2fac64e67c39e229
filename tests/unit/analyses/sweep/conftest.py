"""The small study, run once."""

import copy
from typing import Any

import pytest

from ppafo.analyses.study_results import StudyResults
from ppafo.analyses.sweep import sweep


@pytest.fixture(scope="session")
def small_results(small_study: dict[str, Any], tmp_path_factory: pytest.TempPathFactory) -> StudyResults:
    """The results of the study, made in one go and not to be changed."""
    return sweep(copy.deepcopy(small_study), out=tmp_path_factory.mktemp("small") / "out").found
