"""The small session and its undisturbed run, shared with the tests of whole runs."""

from tests.end_to_end.conftest import done, place, small, undisturbed

__all__ = ["done", "place", "small", "undisturbed"]
