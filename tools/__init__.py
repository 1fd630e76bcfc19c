"""Programs for developers: set-up, measurements and campaigns of simulated sessions. Calibrating needs none of them."""

import pipeline  # noqa: F401  pins BLAS to one thread before numpy is imported, as the command line does
