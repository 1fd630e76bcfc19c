"""Before anything else imports numpy: pipeline pins BLAS to one thread, as the command line does."""

import pipeline  # noqa: F401
