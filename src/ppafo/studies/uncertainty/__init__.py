"""What all questions about uncertainty share: draws from a study's distributions, runs of them, intervals."""
