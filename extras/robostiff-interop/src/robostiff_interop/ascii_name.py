"""Names from files in the comments of programs, which must not run what they hold."""

_LONGEST_NAME = 60


def in_one_ascii_line(name: str) -> str:
    r"""A name from a file in a comment of a program: quoted, bounded, everything else escaped.

    Examples
    --------
    >>> print(in_one_ascii_line("arm\nimport os */ \u00e9"))
    'arm\nimport os * / \xe9'
    """
    return ascii(name[:_LONGEST_NAME]).replace("*/", "* /")
