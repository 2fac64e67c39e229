"""Bench procedures: each fits one physical law to recordings, with the common least-squares estimator."""
