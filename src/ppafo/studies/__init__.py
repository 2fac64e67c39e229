"""What the questions with random draws share: study files, distributions, draws, runs, intervals."""
