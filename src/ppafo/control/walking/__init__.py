"""Controllers of walking: they see forces under the foot beside angle and pressures. One module each."""
