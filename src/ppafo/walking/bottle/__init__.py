"""The bottle that a walking device hangs on: what a walk file says of it, its course, and a walk that is coupled."""
