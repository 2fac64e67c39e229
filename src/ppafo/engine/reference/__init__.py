"""The reference solver: SUNDIALS CVODE with exact flow functions and located events. Slow, independent, the judge."""
