"""The walk of the task's own wearer and device."""

import numpy as np

from ppafo.engine.lanes import run_batch
from ppafo.engine.rows import row_numbers
from ppafo.engine.run import NEVER_FAILED, batch_of
from ppafo.errors import SimulationError
from ppafo.studies.league.walking.course import course_of, toes_of
from ppafo.studies.league.walking.measures import Course, measures, settled_strides
from ppafo.studies.league.walking.task import WalkingTask
from ppafo.walking.configuration import Configuration
from ppafo.walking.planning import plan_walk
from ppafo.walking.walk import REMEDY, plan_of


def walked_course(task: WalkingTask, configuration: Configuration) -> Course:
    """The course of a walk, every sample of it; SimulationError where it diverges."""
    run = plan_walk(plan_of(configuration, task.seconds))
    assert run.walk is not None, "a league walks"
    outcome = run_batch(batch_of(run))
    rows = row_numbers(run.program.state_rows())
    final = outcome.states[:, 0]
    if final[rows["result.failure_time"]] < NEVER_FAILED or not np.isfinite(final).all():
        raise SimulationError(f"{configuration.controller.name} diverged; {REMEDY}")
    record = {name: outcome.record[:, row, 0] for name, row in rows.items()}
    return course_of(record, run.plant, run.walk.timing, toes_of(configuration.gait, configuration.wearer))


def walked_measures(task: WalkingTask, configuration: Configuration) -> dict[str, float]:
    """The measures of the settled strides; SimulationError where the walk diverges."""
    run = plan_walk(plan_of(configuration, task.seconds))
    assert run.walk is not None, "a league walks"
    course = walked_course(task, configuration)
    return measures(course, task.profile, run.walk.timing, settled_strides(course.phase))
