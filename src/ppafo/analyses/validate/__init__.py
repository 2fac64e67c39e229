"""Is the model good enough? A parameter set compared with recordings, channel by channel."""
