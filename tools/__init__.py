"""Set-up, measurements and campaigns; nothing here is needed to calibrate."""

import pipeline  # noqa: F401  pins BLAS to one thread before numpy is imported, as the command line does
