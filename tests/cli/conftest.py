"""The same toy session as the runner's tests have."""

from tests.run.conftest import pool

__all__ = ["pool"]
