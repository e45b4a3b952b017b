"""Sentences are quoted here alone: other tests read types, keys, numbers and exit codes."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import pytest

from tests.words.quoted_sentences import is_sentence, sentences_of

TESTS = Path(__file__).parent.parent
FIGURES: Final = (
    "caption experiment felt figures guarantees limit_cycles load map measured motion polar robust study"
)
# Files and folders that quote no message of zwidth: what the project's own tools print, the captions and labels of
# figures, and the sentence about each argument of each function, which is all that its file is about
ELSEWHERE: Final = [
    "frozen",
    "verdict",
    "reproduction/test_reproduction_page.py",
    "test_paired_timings.py",
    "test_repository.py",
    "test_tuple_references.py",
    "test_arguments.py",
    *(f"show/test_show_{figure}.py" for figure in FIGURES.split()),
]


def other_tests() -> list[Path]:
    """Files of tests that are to quote no sentence."""
    skipped = {TESTS / name for name in ("words", *ELSEWHERE)}
    return [path for path in sorted(TESTS.rglob("*.py")) if not skipped & {path, *path.parents}]


def test_no_other_test_quotes_a_sentence():
    quoted = {path: sentences_of(path.read_text(encoding="utf-8")) for path in other_tests()}
    assert {str(path.relative_to(TESTS)): found for path, found in quoted.items() if found} == {}


@pytest.mark.parametrize("name", ELSEWHERE)
def test_what_is_left_out_quotes_sentences(name):
    """An entry that needs none goes from the list."""
    path = TESTS / name
    files = [path] if path.suffix else path.rglob("*.py")
    assert any(sentences_of(file.read_text(encoding="utf-8")) for file in files)


@pytest.mark.parametrize(
    "source",
    [
        "assert 'this is a sentence' in out",
        "assert error.reason == f'this is {key} a sentence'",
        "assert out.startswith(('ok', 'not this sentence'))",
        "assert any(line.endswith('is no sentence either') for line in lines)",
        "assert lines == ['a.toml: key: is not known here']",
        "with raises(ValueError, match=r'^key: must be .* at least \\d'):\n    pass",
        "@mark.parametrize(('n', 'said'), [(1, 'must be a number')])\ndef test(n, said): assert said in told(n)",
        "CASES = ['must be a number']\n@mark.parametrize('said', CASES)\ndef test(said): assert f'{said}' in out",
    ],
)
def test_a_sentence_is_found_where_it_is_compared(source):
    assert len(sentences_of(source)) == 1


@pytest.mark.parametrize(
    "source",
    [
        "assert found == want, 'this is why it matters'",
        "assert bounds['a name of four words'].value > 0.0",
        "assert text_of('a name of four words') == 'short name'",
        "assert f'up to {peak} on this page' in PAGE",
        "assert status == 'out of reach'",
        "@mark.parametrize(('it', 'n'), [('this is only given', 1)])\ndef test(it, n): assert count(it) == n",
    ],
)
def test_names_reasons_of_asserts_and_pages_are_no_quoted_sentences(source):
    assert sentences_of(source) == []


def test_units_letters_and_patterns_are_no_words():
    assert not is_sentence(r"7.849 kN/m at 10.82 N s/m, (1, 0) Hz to \d+ kHz, K = B")
    assert is_sentence("three plain words")
