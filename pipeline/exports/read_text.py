"""A mount that was read, beside the one in session.yaml, as a table for the screen."""

from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.mount import Mounted, setting_change
from pipeline.text_table import text_table


def change_table(sensor: str, found: Mounted, present: Mounted | None) -> list[str]:
    """Return lines with the six values of a mount: in session.yaml (None: not there), in the file, the change."""
    new, old = found.settings(), None if present is None else present.settings()
    rows = []
    for name, _, key, unit_of_setting in PARAMETERS:
        unit = "°" if unit_of_setting == "deg" else unit_of_setting
        before = "-" if old is None else f"{old[key]:.4f} {unit}"
        change = "-" if old is None else f"{setting_change(new, old, key):+.4f} {unit}"
        rows.append((name, before, f"{new[key]:.4f} {unit}", change))
    return text_table("<12>14>14>14", (f"{sensor} mount", "session.yaml", "file", "change"), rows)
