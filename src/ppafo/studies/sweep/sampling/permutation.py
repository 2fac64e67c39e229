"""A permutation of 0 .. n - 1 that gives the place of one number without making the others.

A Feistel network on the next even number of bits, followed until the result is below n (cycle walking; Black and
Rogaway, CT-RSA 2002). The mixing is that of SplitMix64 (Steele et al., OOPSLA 2014).
"""

import numpy as np
from numpy.typing import NDArray

Words = NDArray[np.uint64]
_ROUNDS = 6


def permuted(numbers: Words, size: int, seed: int, stream: int) -> Words:
    """Return the places of numbers below ``size``; another seed or stream is another permutation."""
    half = np.uint64(max(1, -(-(size - 1).bit_length() // 2)))
    keys = _mixed(np.arange(1, _ROUNDS + 1, dtype=np.uint64) + np.uint64((seed << 24) + (stream << 8)))
    result = _through_rounds(numbers, half, keys)
    outside = np.flatnonzero(result >= size)
    while outside.size:
        result[outside] = _through_rounds(result[outside], half, keys)
        outside = outside[result[outside] >= size]
    return result


def _through_rounds(numbers: Words, half: np.uint64, keys: Words) -> Words:
    mask = (np.uint64(1) << half) - np.uint64(1)
    left, right = numbers >> half, numbers & mask
    for key in keys:
        left, right = right, left ^ (_mixed(right ^ key) & mask)
    return (left << half) | right


def _mixed(words: Words) -> Words:
    words = (words ^ (words >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    words = (words ^ (words >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return words ^ (words >> np.uint64(31))
