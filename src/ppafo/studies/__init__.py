"""Common basis of the analyses with random draws: study files, distributions, draws, runs, intervals."""
