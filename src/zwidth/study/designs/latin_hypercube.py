"""Latin hypercubes whose designs are computed one by one, by their number: no design needs another's.

Each axis is cut into n equal parts, and each part has one design, at a random place in it (McKay, Beckman and
Conover 1979, known at second hand). Which part a design has is a permutation of the numbers below n that is
computed for any of them: the number is written as two digits of mixed base, which change each other in turn by the
hash of a key (a generalised Feistel network), until the result lies below n (Black and Rogaway 2002, "Ciphers with
arbitrary finite domains", known at second hand). The hash is the output function of SplitMix64 (Steele, Lea and
Flood 2014, known at second hand); the place in the part is its hash of the design's number. Of few designs the
parts are in the order of hashes, which is simply random: a network of two small digits is not quite.
"""

from __future__ import annotations

from functools import lru_cache
from math import isqrt
from typing import Final

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Floats, Ints

ROUNDS: Final = 10  # of the network; four make it random for large n, small n need more
FEW: Final = 4096  # designs that are put in order
BLOCK: Final = 1024  # designs that are computed at once where one is asked for
_GAMMA: Final = np.uint64(0x9E3779B97F4A7C15)
_BELOW_ONE: Final = float(np.nextafter(1.0, 0.0))

Words = NDArray[np.uint64]


def shares(seed: int, axis: int, size: int, first: int, last: int) -> Floats:
    """How far along an axis designs first to last - 1 lie, from 0 to below 1, (last - first,).

    seed  of the random numbers;   axis  number of the axis;   size  number of all designs

    >>> sorted(int(5 * share) for share in shares(1, 0, 5, 0, 5))
    [0, 1, 2, 3, 4]
    """
    keys = _keys(seed, axis)
    designs = np.arange(first, last, dtype=np.uint64)
    places = (_hash(designs * _GAMMA + keys[ROUNDS]) >> np.uint64(11)).astype(np.float64) * 2.0**-53
    order = _ordered(seed, axis, size)[first:last] if size <= FEW else _permuted(designs, size, keys)
    parts = order.astype(np.float64)
    # the division may round up to 1
    return np.minimum((parts + places) / size, _BELOW_ONE)


def share(seed: int, axis: int, size: int, design: int) -> float:
    """How far along an axis one design lies; see `shares`."""
    return float(_block(seed, axis, size, design // BLOCK)[design % BLOCK])


@lru_cache(maxsize=64)
def _block(seed: int, axis: int, size: int, number: int) -> Floats:
    return shares(seed, axis, size, number * BLOCK, min((number + 1) * BLOCK, size))


@lru_cache(maxsize=64)
def _keys(seed: int, axis: int) -> Words:
    return np.random.SeedSequence((seed, axis)).generate_state(ROUNDS + 1, np.uint64).astype(np.uint64)


@lru_cache(maxsize=64)
def _ordered(seed: int, axis: int, size: int) -> Ints:
    """A permutation of the numbers below `size`, by sorting."""
    hashes = _hash(np.arange(size, dtype=np.uint64) * _GAMMA + _keys(seed, axis)[0])
    return np.argsort(hashes, kind="stable")


def _permuted(numbers: Words, size: int, keys: Words) -> Words:
    """Images of numbers below `size` under a permutation of them."""
    low = isqrt(size - 1) + 1  # bases of the two digits; their product is hardly above the size
    high = -(-size // low)
    images = _network(numbers, np.uint64(low), np.uint64(high), keys)
    while len(outside := np.flatnonzero(images >= size)):
        images[outside] = _network(images[outside], np.uint64(low), np.uint64(high), keys)
    return images


def _network(numbers: Words, low: np.uint64, high: np.uint64, keys: Words) -> Words:
    """Images under a permutation of the numbers below low * high."""
    left, right = numbers // low, numbers % low
    for n in range(0, ROUNDS, 2):
        left = (left + _hash(right + keys[n]) % high) % high
        right = (right + _hash(left + keys[n + 1]) % low) % low
    return left * low + right


def _hash(words: Words) -> Words:
    """The output function of SplitMix64: each bit of a word changes about half of the others."""
    words = (words ^ (words >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    words = (words ^ (words >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return words ^ (words >> np.uint64(31))
