"""Functions of an angle or a decay as short series, written so that they run in many lanes at once."""

TURN = 6.283185307179586
TURNS_OF_RADIAN = 1.0 / TURN

DOUBLINGS = 12
"""A function of a whole step is summed at a fraction of it, and doubled so often up to the whole."""
SMALLEST_FRACTION = 0.5**DOUBLINGS
TERMS = 9
"""Terms of such a series, with the one of order 0."""


def sine_and_cosine(turns: float) -> tuple[float, float]:
    """Sine and cosine [-] of a number of turns to 1e-9: power series within a quarter turn of the nearest half turn.

    A library sine cannot run in many lanes at once.
    """
    half_turns = float(int(2.0 * turns + (0.5 if turns >= 0.0 else -0.5)))
    odd = half_turns - 2.0 * float(int(0.5 * half_turns))
    sign = 1.0 - 2.0 * odd * odd
    angle = TURN * (turns - 0.5 * half_turns)
    square = angle * angle
    fourth = square * square
    eighth = fourth * fourth
    # Terms in pairs, and pairs in pairs: a third as many operations wait for one another as in one row.
    low = (1.0 - 1.0 / 6.0 * square) + (1.0 / 120.0 - 1.0 / 5040.0 * square) * fourth
    high = (1.0 / 362880.0 - 1.0 / 39916800.0 * square) + (1.0 / 6227020800.0 - 1.0 / 1307674368000.0 * square) * fourth
    sine = (low + high * eighth) * angle
    low = (1.0 - 0.5 * square) + (1.0 / 24.0 - 1.0 / 720.0 * square) * fourth
    high = (1.0 / 40320.0 - 1.0 / 3628800.0 * square) + (1.0 / 479001600.0 - 1.0 / 87178291200.0 * square) * fourth
    return sign * sine, sign * (low + high * eighth)
