"""Linkages, and what is asked of them."""

from __future__ import annotations

from typing import cast

import numpy as np

from robostiff.errors import NoAnswerError
from robostiff.linkage.closure import Configuration
from robostiff.linkage.connections import ConnectedBodies, JointValues
from robostiff.linkage.driven import driven_by
from robostiff.linkage.essential import network_of
from robostiff.network import Network


class Linkage(ConnectedBodies):
    """Bodies connected in any way, one of which is fixed.

    Attributes
    ----------
    name : str
    connections : tuple of Connection
    base : str
        The body that stands still; its frame is the world.
    platform : str
        The body whose stiffness is computed.
    reference_point : (3,) array
        Point of the platform about which stiffness is given, in the platform's frame [m].
    held : frozenset of str
        Joints that keep their home coordinates while loops are closed; locked ones always do.
    title, source : str
        What it is, and where its numbers come from.
    masses : mapping of str to tuple of Mass
        Of bodies, by their names and in their frames.
    nominal : mapping of str to float
        The values in SI units that a side file gives to the symbols of its stiffnesses.

    Raises
    ------
    InputError
        Two connections of one name, a connection from a body to itself, or a base, platform or held
        joint that is not there.

    Examples
    --------
    >>> from robostiff.linkage import Connection
    >>> from robostiff.model import Passive, revolute
    >>> from robostiff.spatial import Frame
    >>> hinge = revolute([0, 0, 1], Passive(), name="hinge")
    >>> weld = Connection("hinge", "wall", "door", Frame.identity(), hinge, Frame.identity())
    >>> Linkage("door", (weld,), "wall", "door", np.zeros(3)).bodies
    ('wall', 'door')
    """

    def network_at(self, values: JointValues | None = None) -> Network:
        """The linkage as a network, with some joints at given coordinates.

        Parameters
        ----------
        values : mapping of str to float or sequence of float, optional
            Coordinates of joints by name [m, rad], which these joints keep. The others start at
            home and follow as the loops need. The home configuration when left out.

        Raises
        ------
        NoAnswerError
            When the loops do not close.
        InputError
            When a name is no joint's, or its numbers are not finite or too many or few.
        """
        return network_of(*self.closed_at(values))

    def closed_at(self, values: JointValues | None = None) -> tuple[Linkage, Configuration]:
        """The part between base and platform, closed; as `network_at`.

        Every path begins at the same home, which is closed once.
        """
        given = self.checked(values or {})
        driven = driven_by(self, tuple(given))
        row = np.concatenate([np.zeros(0), *(given[name] for name in driven.drives)])
        (found,) = driven.at(row[None])
        if not found.is_closed:
            raise NoAnswerError(
                f"the loops of {self.name!r} do not close: {found.complaint}; {found.advice}"
            )
        return cast("Linkage", driven.part), found
