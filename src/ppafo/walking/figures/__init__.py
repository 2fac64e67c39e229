"""Figures of walks: the mean stride, the legs, the phases, the animation, and many wearers."""
