"""A wearer who answers: a planar body of seven segments, its muscles, their reflexes, and the ground."""
