"""The command line of ``python -m stages.cli``."""

from stages.cli import main

main()
