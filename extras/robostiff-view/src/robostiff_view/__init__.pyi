from robostiff_view.machines import machine_of, parameters_written
from robostiff_view.page import LivePage
from robostiff_view.sliders import parameter_sliders

__all__ = ["LivePage", "machine_of", "parameter_sliders", "parameters_written"]
