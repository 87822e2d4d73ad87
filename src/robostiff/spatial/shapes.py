"""Shapes of arrays in signatures, as in ``Float[np.ndarray, "*batch 6 6"]``.

They are those of jaxtyping where a program has imported it before, as the tests do, which check
them. Elsewhere they are words for people and type checkers, and need no package.
"""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or sys.modules.get("jaxtyping"):
    from jaxtyping import Bool, Float, Shaped
else:

    class Shaped:
        """An array; its shape is written behind it."""

        def __class_getitem__(cls, array_and_shape: tuple[Any, str]) -> Any:
            return array_and_shape[0]

    Bool = Float = Shaped

__all__ = ["Bool", "Float", "Shaped"]
