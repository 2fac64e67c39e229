"""Vocabulary of the questions: what they take from the packages below, by one import."""

from ppafo.arguments.values import taken_tasks
from ppafo.counterfactuals import verdict_of
from ppafo.counterfactuals.joint_gains import joint_gains
from ppafo.loading import load_scenario, placed, reloaded, scenario_or_load, usage_text, with_overrides
from ppafo.metrics import METRICS, Metric
from ppafo.metrics.tracking import TRACKING
from ppafo.parameters.overrides import over
from ppafo.parameters.parameter_set import PATHS_THAT_SET_UNITS, units_of_texts
from ppafo.report.finding import Column, Finding, Section, columns_of
from ppafo.report.kind import TIME, ConfidenceInterval, Kind, label_of, of_metric, of_path
from ppafo.report.panels import Mark, Panel, dots
from ppafo.report.style import BLACK, BLUE, COLOURS, GREEN, GREY, MARKERS, ORANGE, PURPLE, VERMILION, look_of_valve
from ppafo.running import simulate
from ppafo.simulation.ensemble import lacking
from ppafo.simulation.gains import gains_of, remark_on_following_gains
from ppafo.simulation.numbers import NOISE_SEED, changes_in
from ppafo.simulation.simulate import Result, Status, simulate_many
from ppafo.simulation.tracking import Tracking
from ppafo.simulation.tracking.rule import ON_PURPOSE
from ppafo.simulation.tracking.verdict import standing_still
from ppafo.studies.distributions import Distribution, Floats
from ppafo.studies.draws import (
    FEWEST_DRAWS,
    MAXIMUM_DRAWS,
    REPLICATES,
    Uncertainty,
    replicate_seed,
    seeds_of_noise,
    uncertainty_of,
)
from ppafo.studies.intervals import (
    effective_sample_size,
    jackknife_reach,
    noise_interval,
    replicates_interval,
    share_interval,
)
from ppafo.studies.limits import MetricLimit, atmosphere_of, check_metrics, difference_of, level_of
from ppafo.studies.loading import drawn_in, list_studies, load_study, read_source, study_of
from ppafo.studies.study import DEFAULT_SEED, Configuration, configurations_with
from ppafo.studies.varying import VariedPath, distribution_in, left_out, value_at, varied_path
from ppafo.study.blocks import unvaried
from ppafo.study.executing import executor_of
from ppafo.study.runs import (
    FAILED,
    FOLLOWS,
    Rows,
    RunCounter,
    Runs,
    TrackingCounts,
    scenario_runs,
    tracking_counts,
)
from ppafo.units import split_quantity
from ppafo.wording import override_text
