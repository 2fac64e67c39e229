"""Noise of sensors: what it may be like, and which kind recordings leave unexplained.

``sample_loops`` are compiled; ``t_distribution`` has heavy tails, ``shapes`` the memory of noise, ``sensor_noise`` is
the noise of one sensor; ``growing`` and ``heavy_tails`` search kinds of it, and ``choice`` takes the likeliest.
"""
