"""A run with limits by purpose: the verdict says what the values are good for, on the screen, the page and in JSON."""

import shutil
from pathlib import Path

from tests.support.pages import Page
from tests.support.places import Place, Told


def test_limits_by_purpose_are_said_wherever_the_verdict_is(place: Place, undisturbed: tuple[Path, Told]) -> None:
    """And the table of soundings ends where the purpose does. Too strict a share is a reason of its own."""
    shutil.copytree(undisturbed[0], place.run)
    place.edit_config("verdict", purpose="order_1a", depth_m=12, swath_deg=50)
    told = place.calibrate("--report")
    words = "for Order 1a (IHO S-44) down to 12 m, beams to 50°"
    assert (told.status, f": ACCEPTED {words}\n" in told.out) == (0, True)
    assert place.result()["verdict_in_words"] == f"accepted {words}"
    page = Page((place.run / "report" / "report.html").read_text("utf-8"))
    text = " ".join(page.text.split())
    assert f"accepted {words}" in text
    assert f"Accepted {words}: the mount alone takes at most 30 % of the uncertainty that this allows" in text
    heads = ("depth below the sonar", "straight down", "at 45°", "at 50°", "S-44 Order 1a")
    assert [row[0] for row in page.table(*heads)] == ["5 m", "10 m", "12 m"]
    assert "5 m + 5 % (Order 1a)" in text

    place.edit_config("verdict", mount_share=0.001)
    assert place.calibrate("--no-report").status == 1
    assert {"sigma_above_limit", "soundings_above_limit"} <= {*place.result()["reason_codes"]}
