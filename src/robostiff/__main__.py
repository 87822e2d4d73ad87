"""``python -m robostiff`` is the command ``robostiff``."""

from robostiff.cli.main import main

main()
