"""How are the metrics of a study distributed over many runs, and how do they depend on what varies?"""
