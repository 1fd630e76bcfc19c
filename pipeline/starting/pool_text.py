"""The text of a new pool's config."""

from pipeline.config.fill_in import MARK, WHAT
from pipeline.starting.boat_track import BoatTrack
from pipeline.starting.yaml_words import comment, to_fill_in

_HEAD = (
    f"The pool's config, begun by poolcal init. {MARK} marks what only a person knows. Every other key, with its "
    "default and its meaning: configs/defaults.yaml. A target of another shape has faces in place of a, b, c, e and "
    "low_side: docs/target.md."
)
_AZIMUTH = "  azimuth_deg: null             # of the target's +y, clockwise from north; null: by the boat's heading"
_AS_BUILT = """\
# as_built:                     # take the comment signs away, and say how the target was surveyed; these, the defaults,
#   face_sigma_m: 0.0005        # are of faces surveyed one by one with the pool filled. For other cases the table in
#   offset_sigma_m: 0.001       # docs/target.md has the figures
#   angle_sigma_deg: 0.01
#   bow_sigma_m: 0.001"""


def pool_text(track: BoatTrack | None) -> str:
    """Return the text of the pool's config; ``track`` helps to find origin and azimuth, in comments only."""
    lines = [*comment(_HEAD), "target:", "  kind: letters"]
    lines += [to_fill_in(letter, "  ", f"target.{letter}") for letter in "abce"]
    lines += [to_fill_in("low_side", "  ", "target.low_side")]
    lines += [f"  origin:                       # {WHAT['target.origin']}"]
    lines += _position(track)
    lines += [to_fill_in(name, "    ") for name in ("latitude_deg", "longitude_deg", "height_m")]
    lines += _azimuth(track)
    lines += [_AZIMUTH]
    lines += [to_fill_in("water_level_m", "  ", "target.water_level_m")]
    return "\n".join([*lines, _AS_BUILT]) + "\n"


def _position(track: BoatTrack | None) -> list[str]:
    if track is None:
        return []
    return comment(
        f"To compare: the INS's mean position over the session is latitude {track.latitude_deg:.7f}, longitude "
        f"{track.longitude_deg:.7f}, height {track.height_m:.2f}. The origin lies some metres from it, on the "
        "starboard side of the passes.",
        "    ",
    )


def _azimuth(track: BoatTrack | None) -> list[str]:
    if track is None or track.azimuth_deg is None:
        return []
    ahead = round(track.azimuth_deg, 1) % 360.0  # 359.97 is 0.0
    back = (ahead + 180.0) % 360.0
    return comment(
        f"To compare: the boat sailed {track.along_m:.0f} m toward azimuth {ahead:.1f}° and "
        f"{track.against_m:.0f} m toward {back:.1f}°. azimuth_deg is the direction in which it passes the target to "
        "starboard. (Ways before and after the passes count too.)",
        "  ",
    )
