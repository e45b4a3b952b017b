"""Numbers as people read them."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import given as over
from hypothesis import strategies as st

from zwidth.show import amount, area_text, percent
from zwidth.show.units import (
    NONE,
    PREFIXES,
    as_written,
    number,
    point,
    quantity,
    radius,
    scaled,
    signed,
    spoken_unit,
    uncertain,
    vector,
)


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (7849.44, "N/m", "7.849 kN/m"),
        (999.996, "N/m", "1.000 kN/m"),
        (0.99999, "N s/m", "1.000 N s/m"),
        (126043.4, "N/m", "126.0 kN/m"),
        (1e-5, "N/m", "1.000\u2009×\u200910⁻⁵ N/m"),
        (3e9, "N/m", "3.000\u2009×\u200910⁹ N/m"),
        (0.02, "N s/m", "0.02000 N s/m"),
        (25000.0, "N s/m", "2.500\u2009×\u200910⁴ N s/m"),
        (-9145.7, "N/m", "−9.146 kN/m"),
        (0.0253667, "kg", "0.02537 kg"),
        (164944.5, "N² s/m²", "1.649\u2009×\u200910⁵ N² s/m²"),
        (0.0, "Hz", "0 Hz"),
        (math.inf, "N/m", "∞ N/m"),
        (math.nan, "N/m", "–"),
    ],
)
def test_quantities(value, unit, text):
    assert quantity(value, unit).replace("\u00a0", " ") == text


@over(st.floats(1e-3, 9e8), st.sampled_from([1.0, -1.0]))
def test_a_quantity_reads_back_as_the_number_in_four_digits(value, sign):
    """Rounded to nearest once, of its own digits and not of those left by a prefix."""
    text = quantity(sign * value, "N/m")
    mantissa, prefix = re.fullmatch(r"(−?[\d.]+)\u00a0(\D?)N/m", text).groups()
    powers = {mark: power for power, mark in PREFIXES.items()}
    read = float(mantissa.replace("−", "-")) * 10.0 ** powers[prefix]
    assert read == pytest.approx(sign * float(f"{value:.3e}"), rel=1e-12)
    assert len(mantissa.strip("−").replace(".", "").lstrip("0")) == 4


@over(st.floats(-1e12, 1e12))
def test_numbers_have_no_hyphen_for_a_minus(value):
    assert "-" not in number(value)


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.5, "0.5000"),
        (0.94553, "0.94553"),
        (0.9999123456, "0.99991235"),
        (1.0 + 1.2346e-9, "1.0000000012"),
        (2.25, "2.2500"),
        (math.nan, "–"),
    ],
)
def test_spectral_radii_have_four_digits_of_their_distance_from_1(value, text):
    assert radius(value) == text


def test_changes_shares_and_errors():
    assert (signed(0.00012344), signed(-2.8504), signed(0.0)) == ("+0.0001234", "−2.850", "0")
    assert percent(0.7963) == "79.63\u00a0%"
    assert (uncertain(0.0678), uncertain(12.34), uncertain(0.0)) == ("0.068", "12", "0")


@over(st.floats(1e-12, 1e15))
def test_damping_takes_no_prefix(value):
    assert all(write(value, "N s/m").endswith("\u00a0N\u00a0s/m") for write in (quantity, as_written))
    assert scaled(-3, "N s/m") == "10⁻³\u00a0N s/m"
    assert (scaled(3, "N/m"), scaled(9, "N/m")) == ("kN/m", "10⁹\u00a0N/m")


def test_what_somebody_chose_is_not_padded():
    assert as_written(0.00125, "s") == "1.25\u00a0ms"
    assert as_written(1000.0, "Hz") == "1\u00a0kHz"


def test_points():
    assert point([0.0, -0.25, 0.0]) == "(0, −0.25)\u00a0m"
    assert point([0.1, 0.2, 0.3], "") == "(0.1, 0.2, 0.3)"


@over(st.floats(-1e12, 1e12), st.sampled_from(["N/m", "kg", ""]))
def test_a_terminal_shows_what_a_figure_shows_in_signs_that_can_be_typed(value, unit):
    shown = amount(value, unit)
    figure = quantity(value, unit)
    assert len(shown) == len(figure)
    assert all(
        a == b or (a, b) in {(" ", "\u00a0"), (" ", "\u2009"), ("-", "−")}
        for a, b in zip(shown, figure, strict=True)
    )
    assert not set(shown) & set("\u00a0\u2009−")


@pytest.mark.parametrize("value", [None, math.nan, math.inf, -math.inf])
def test_a_terminal_says_none_where_there_is_no_number(value):
    assert amount(value, "N/m") == NONE


def test_a_vector_on_a_terminal():
    assert vector([0.0, -0.25, 0.0], "m") == "(0, -0.25) m"
    assert vector([0.1, 0.2, -0.3]) == "(0.1, 0.2, -0.3)"


def test_units_are_printed_with_their_powers():
    assert spoken_unit("N^2 s/m^2") == "N² s/m²"
    assert spoken_unit("m^1/rad^1") == "m/rad"
    assert spoken_unit("1/(kg m)^2") == "1/(kg m)²"


def test_areas_have_the_unit_that_suits_them():
    assert area_text(0.03789) == "378.9 cm²"
    assert area_text(4.433e-7) == "0.4433 mm²"
    assert area_text(36.87) == "36.87 m²"
    assert area_text(0.0) == "0 cm²"
