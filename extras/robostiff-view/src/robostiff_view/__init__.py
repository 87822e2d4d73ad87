"""A robot in the browser: sliders for pose, parameters and load, and its stiffness as they move.

``sliders`` says what can be moved, ``machines`` what each kind of robot answers there, ``answer``
what is shown of it; ``scene`` and ``page`` draw it with viser.
"""

from robostiff.on_demand import import_on_demand

import_on_demand(__name__)
