"""The same toy session as the runner's tests have."""

from tests.runner.conftest import pool

__all__ = ["pool"]
