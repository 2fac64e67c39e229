"""How a controller of walking knows the time in the stride: as it detects it, or as it predicts it. One module each."""
