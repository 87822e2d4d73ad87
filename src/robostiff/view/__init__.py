"""A robot in the browser: sliders for pose, parameters and load, and its stiffness as they move.

``sliders`` says what can be moved, ``machines`` what each kind of robot answers there, ``answer``
what is shown of it; ``scene`` and ``page`` draw it with viser.
"""

from robostiff.view.machines import machine_of, parameters_written
from robostiff.view.page import LivePage
from robostiff.view.sliders import parameter_sliders

__all__ = ["LivePage", "machine_of", "parameter_sliders", "parameters_written"]
