"""Which values run number i has: a function of the study and of i alone, so that chunks may come in any order."""
