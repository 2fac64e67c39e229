"""From a scenario to a result: the experiment, the run, and its outcome."""
