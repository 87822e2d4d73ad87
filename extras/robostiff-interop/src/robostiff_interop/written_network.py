"""Networks in files for other programs: their names in comments, and free motions."""

from robostiff import Status, stiffness
from robostiff.errors import warn_of_slip
from robostiff.network import Network

_LONGEST_NAME = 60


def in_one_ascii_line(name: str) -> str:
    r"""A name from a file in a comment of a program, which must not run what it holds.

    Examples
    --------
    >>> print(in_one_ascii_line("arm\nimport os */ \u00e9"))
    'arm\nimport os * / \xe9'
    """
    return ascii(name[:_LONGEST_NAME]).replace("*/", "* /")


def warn_of_free_motions(network: Network, program: str) -> None:
    """Warn where the platform moves freely: the program prints numbers, and there is no answer."""
    if Status.FREE_MOTIONS in stiffness(network).status:
        words = f"what {program} prints is no compliance matrix, as there is none"
        warn_of_slip(
            f"the platform of {network.name!r} can move without meeting stiffness: {words}"
        )
