"""Effect of the device on a walking wearer: with it, without it, and against the healthy gait."""
