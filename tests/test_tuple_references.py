"""Tuples of arrays that kernels hand to each other as one address."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pytest
from numba.core.errors import NumbaError

from zwidth.compiled import can_be_taken_apart, compiled, compiled_apart, compiled_lean

pytestmark = pytest.mark.skipif(not can_be_taken_apart(), reason="this release of numba compiles kernels plainly")


class Inner(NamedTuple):
    """A tuple within the tuple."""

    a: np.ndarray
    b: np.ndarray
    c: np.ndarray


class Outer(NamedTuple):
    """Arrays of several kinds, and a tuple of arrays between them."""

    whole: np.ndarray
    inner: Inner
    matrix: np.ndarray
    few: tuple[np.ndarray, np.ndarray]


def outer(n: int = 4) -> Outer:
    """Arrays of different numbers."""
    inner = Inner(np.arange(n) + 0.5, np.arange(n) + 10.5, np.arange(n) + 100.5)
    return Outer(np.arange(n), inner, np.arange(2.0 * n).reshape(2, n), (np.ones(n), np.full(n, 2.0)))


@compiled_apart
def _sum_of_inner(inner: Inner, k: int) -> float:
    return inner.a[k] + 2.0 * inner.b[k] + 3.0 * inner.c[k]


@compiled_lean
def _write(outer: Outer, k: int) -> None:
    outer.matrix[1, k] = _sum_of_inner(outer.inner, k) + outer.whole[k] + outer.few[1][k]


@compiled
def fill(outer: Outer) -> None:
    """Called from Python with the tuple itself."""
    for k in range(len(outer.whole)):
        _write(outer, k)


def test_fields_are_read_and_arrays_written_through_the_address():
    x = outer()
    fill(x)
    expected = x.inner.a + 2.0 * x.inner.b + 3.0 * x.inner.c + x.whole + 2.0
    np.testing.assert_array_equal(x.matrix[1], expected)
    np.testing.assert_array_equal(x.matrix[0], np.arange(4.0))


@compiled_lean
def _sum_of_three(one: Inner, other: Inner, k: int) -> float:
    return one.a[k] - other.a[k]


@compiled
def difference(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    """Makes two tuples of its own and hands both on."""
    total = 0.0
    for k in range(len(a)):
        total += _sum_of_three(Inner(a, b, c), Inner(c, b, a), k)
    return total


def test_a_kernel_can_make_tuples_and_hand_them_on():
    a, b, c = np.array([3.0, 5.0]), np.zeros(2), np.array([1.0, 1.0])
    assert difference(a, b, c) == 6.0


@compiled_lean
def _same(inner: Inner) -> Inner:
    return inner


@compiled
def returned(outer: Outer) -> float:
    """Wants back a tuple that it handed on."""
    return _same(outer.inner).a[0]


def test_a_kernel_must_not_return_a_tuple_that_it_was_given():
    """Its address may hold another tuple by the time it is read."""
    with pytest.raises((TypeError, NumbaError), match="returns a tuple of arrays that it was given"):
        returned(outer())
