"""``python -m hdsim`` is ``hdsim``."""

from hdsim.cli import main

main()
