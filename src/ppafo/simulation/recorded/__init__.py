"""What a run takes from a recording: inputs step by step, the state at its start, and checks of both."""
