"""Blocks in HTML and in Typst say the same, and text is text in both."""

import re
from html import unescape
from html.parser import HTMLParser

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robostiff.markup import (
    STIFFNESS_UNITS,
    TYPST_BLOCKS,
    Bullets,
    Facts,
    Heading,
    LabelledMatrix,
    Number,
    Paragraph,
    Table,
    Tone,
    block_html,
    block_typst,
    escaped,
    in_words,
)

K = LabelledMatrix(
    "K",
    np.array([[1.5e7, 2.0, 1e-9], [2.0, 3e7, 0.0], [1e-9, 0.0, 0.25]]),
    ["Fx", "Fy", "Mz"],
    ["dx", "dy", "rz"],
    STIFFNESS_UNITS,
)
words = st.text(st.characters(codec="utf-8", exclude_categories=("Cs", "Cc")), max_size=20)


class _Balance(HTMLParser):
    def __init__(self):
        super().__init__(convert_charrefs=True)
        self.open, self.text = [], []

    def handle_starttag(self, tag, attrs):
        self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)


def text_of(html: str) -> str:
    parser = _Balance()
    parser.feed(html)
    parser.close()
    assert parser.open == []
    return "".join(parser.text)


def test_numbers_keep_all_their_digits():
    value = 1 / 3e7
    html = block_html(Table(["", ""], [["a", Number(value, "m")]]))
    kept = re.search('<data value="(.*?)">', html)
    assert kept is not None
    assert float(kept[1]) == value
    assert "3.3333·10<sup>−8</sup></data> m" in html


def test_matrix_keeps_what_it_shows_as_rounding():
    html = block_html(K)
    kept = [float(value) for value in re.findall('<data value="(.*?)">', html)]
    assert kept == K.values.ravel().tolist()
    assert '<data value="1e-09">0</data>' in html


def test_matrix_names_rows_and_columns_once():
    names = re.findall(r"<th [^>]*>(\w+)</th>", block_html(K))
    assert sorted(names) == sorted([*K.rows, *K.columns])
    assert [block_typst(K).count(f"strong[{name}]") for name in names] == [1] * 6


def test_rotations_begin_the_second_block():
    assert K.first_rotation == 2
    turned = LabelledMatrix("C", K.values, K.columns, K.rows, STIFFNESS_UNITS)
    assert turned.first_rotation == 2


without_numbers = words.filter(lambda text: in_words(text) == escaped(text))


@given(without_numbers, without_numbers)
def test_text_is_text_in_html(one, other):
    blocks = [
        Paragraph(one),
        Bullets((one, other), Tone.WARNING),
        Facts(((one, other),)),
        Table([one, other], [[one, other]]),
    ]
    for block in blocks:
        text = text_of(block_html(block))
        assert unescape(one) in text or one in text


@settings(max_examples=15)
@given(words, words)
def test_any_text_compiles_in_typst(one, other):
    typst = pytest.importorskip("typst")
    blocks = [
        Heading(f"h{one}"),
        Paragraph(one, Tone.QUIET),
        Bullets((one, other), Tone.WARNING),
        Facts(((one, other),)),
        Table([one, other], [[one, Number(-2e-9, other)]]),
        LabelledMatrix(one or "K", K.values, K.rows, K.columns, STIFFNESS_UNITS),
    ]
    source = "\n\n".join([TYPST_BLOCKS, *map(block_typst, blocks)])
    assert typst.compile(source.encode(), format="svg", ignore_system_fonts=True)


def test_typst_shows_what_it_is_given():
    typst = pytest.importorskip("typst")
    source = "\n\n".join([TYPST_BLOCKS, block_typst(K)])
    assert typst.compile(source.encode(), ignore_system_fonts=True).startswith(b"%PDF-")
    assert "$1.5 dot 10^(7)$" in block_typst(K)


def test_words_between_numbers_stand_at_the_right_as_these_do():
    table = Table(
        ["cable", "tension", "note"], [["1", Number(12.0, "N"), "a"], ["2", "slack", "b"]]
    )
    html, typst = block_html(table), block_typst(table)
    assert '<th scope="col" class="number">tension</th><th scope="col">note</th>' in html
    assert '<td class="number">slack</td><td>b</td>' in html
    assert typst.startswith("#rows(3, (left, right, left,), ")


def test_zero_has_no_sign():
    assert '<data value="-0.0">0</data>' in block_html(Table([""] * 2, [["a", Number(-0.0)]]))


def test_numbers_in_sentences_are_written_as_in_tables():
    facts = Facts((("stiffness", "4e+08, -1.2e-05, rigid; 3-puu, 1e5 and x-1 are names"),))
    assert "4·10<sup>8</sup>, −1.2·10<sup>−5</sup>, rigid; 3-puu, 1e5 and x-1" in block_html(facts)
    assert r"$4 dot 10^(8)$, $-1.2 dot 10^(-5)$, rigid; 3\-puu, 1e5" in block_typst(facts)
