"""The documents' pictures are those of today's program."""

from tools.pictures import DRAWN_FROM, ROOT, drawn_from


def test_the_pictures_are_of_these_pages_and_views() -> None:
    """Every change of what draws the report or the recordings asks for a look at them: make pictures."""
    kept = (ROOT / "docs" / "pictures" / DRAWN_FROM).read_text(encoding="utf-8")
    assert kept == drawn_from(), "run make pictures, look at docs/pictures, and commit them"
