"""What stands first in a sum, what stands apart in a product, and what has a name in a matrix."""

import sympy as sp

from robostiff.analytic import Derivation
from robostiff.analytic.export import derivation_text
from robostiff.analytic.export.languages import LATEX, MATHML, TEXT, TYPST

a, l, top = sp.symbols("a l top", positive=True)


def test_a_positive_term_stands_first_in_every_language():
    root = sp.sqrt(-(a**2) + l**2 - 2 * a)
    assert TEXT.write(root) == "sqrt(l**2 - a**2 - 2*a)"
    assert LATEX.write(root) == r"\sqrt{l^{2} - a^{2} - 2 a}"
    assert TYPST.write(root) == "sqrt(l^(2) - a^(2) - 2 a)"
    written = MATHML.write(root)
    assert written.index("<mi>l</mi>") < written.index("<mi>a</mi>")


def test_sums_of_negative_terms_keep_their_order():
    assert TEXT.write(-a - l) == "-a - l"


def test_words_are_set_apart_from_letters():
    product = a * top**2
    assert LATEX.write(product) == r"a\,\mathrm{top}^{2}"
    assert " thin " in TYPST.write(product)
    assert "mspace" in MATHML.write(product)
    for write in (LATEX.write, TYPST.write, MATHML.write):
        plain = write(a * l**2)
        assert not any(space in plain for space in (r"\,", "thin", "mspace"))


def test_entries_that_differ_by_their_sign_have_one_name():
    x, y, z = sp.symbols("first_length second_length third_length")
    long = (x + y) * (y + z) / (x * y * z)
    K = sp.ImmutableMatrix([[x, long, 0], [long, y, -long], [0, -long, z]])
    text = derivation_text(Derivation("K", K, (), K), width=60)
    assert "-K_12" in text
    assert "K_23" not in text
