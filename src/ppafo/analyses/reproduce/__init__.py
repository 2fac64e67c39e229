"""Which of the paper's claims hold when its experiments are run again, and which of other publications?"""
