"""Common basis of analyses with random draws: study files, distributions, draws, runs, intervals."""
