"""From a scenario to a result: what is to be run, the run itself, and what came out."""
