"""Marks that show where frames of bodies are, in legs that are placed on recorded entries."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from robostiff.elasticity import Elasticity
from robostiff.model import Chain, Element, Joint, Leg, Link, ParallelBlock


def marked(leg: Leg, mark: str, wanted: Callable[[str, Element], bool]) -> Leg:
    """A leg with a rigid part without extent in the frames of the elements that are wanted.

    Their names begin with `mark` and go on with those of the elements, which are asked for by
    ``leg/part``.
    """
    return replace(leg, chain=_marked(leg.chain, f"{leg.name}/", mark, wanted))


def _marked(chain: Chain, prefix: str, mark: str, wanted: Callable[[str, Element], bool]) -> Chain:
    elements: list[Element] = []
    for element in chain.elements:
        pair: list[Element] = [element]
        if isinstance(element, ParallelBlock):
            inner = f"{prefix}{element.name}/"
            branches = (
                replace(one, chain=_marked(one.chain, f"{inner}{one.name}/", mark, wanted))
                for one in element.branches
            )
            pair = [replace(element, branches=tuple(branches))]
        if wanted(prefix + element.name, element):
            own = Link(np.zeros(3), Elasticity(np.zeros((6, 6))), np.eye(3), mark + element.name)
            # behind a joint its body begins; a link is given in the frame before it
            pair.insert(1 if isinstance(element, Joint | ParallelBlock) else 0, own)
        elements += pair
    return replace(chain, elements=tuple(elements))
