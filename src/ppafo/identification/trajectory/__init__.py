"""Trajectory fit: any parameters of a device from any recordings of its motion, with intervals and verdicts.

``experiment`` states the request with its tolerances, ``fitting`` passes residuals of runs to the common estimator and
ranks further experiments.
"""
