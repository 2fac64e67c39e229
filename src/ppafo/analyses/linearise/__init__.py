"""What is a scenario's plant near one point, as a linear model: A, B, C and D with names and units?"""
