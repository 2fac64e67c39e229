"""What a bench may have and the fitted model not, one file each: effects of the device, and faults of the record.

``kind`` says what a direction is, ``catalogue`` names all of them, and ``changes`` runs a little of an effect. Time
stamps that are off at random and a gain that wanders are kinds of noise (``ppafo.identification.noise``).
"""
