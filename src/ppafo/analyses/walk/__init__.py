"""What does the device do for a wearer who walks: with it, without it, and as the healthy gait would have it?"""
