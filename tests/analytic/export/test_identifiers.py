import keyword

from hypothesis import given
from hypothesis import strategies as st

from robostiff.analytic.export.code import C_WORDS, Identifiers


@given(st.lists(st.text(max_size=8), max_size=12))
def test_any_names_become_different_identifiers(names):
    identifiers = Identifiers({*keyword.kwlist, *C_WORDS})
    taken = [identifiers.take(name) for name in names]
    assert len(set(taken)) == len(names)
    for identifier in taken:
        assert identifier.isidentifier()
        assert identifier.isascii()
        assert not keyword.iskeyword(identifier)
        assert identifier not in C_WORDS


@given(st.from_regex(r"[a-zA-Z][a-zA-Z0-9_]*", fullmatch=True))
def test_an_identifier_stays_as_it_is(name):
    assert Identifiers(()).take(name) == name


def test_greek_letters_are_spelled():
    identifiers = Identifiers({"lambda"})
    assert [identifiers.take(name) for name in "φΩλς"] == ["phi", "Omega", "lambda_", "sigma"]
