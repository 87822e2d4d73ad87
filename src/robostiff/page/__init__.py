"""The page of every result: its blocks, which are written as text, HTML, Typst and JSON.

One module writes the pages of one kind of results. `robostiff.markup` has the blocks and all
formats but JSON, which is in ``data``.
"""

from robostiff.on_demand import import_on_demand

import_on_demand(__name__)
