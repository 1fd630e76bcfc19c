"""Stable codes of the reasons in the tables ``counts``, by which stages count points and records.

People read the words of a reason, which may be mended. Programs read its code, which never changes.
"""

import re

OTHER = "other"  # code of a reason that is not listed here

CODES = {
    "used": "used",
    # every reader: times and numbers
    "impossible time": "impossible_time",
    "impossible time (clock not set)": "clock_not_set",
    "no time": "no_time",
    "repeated time": "repeated_time",
    "time running backwards": "time_backwards",
    "two times that contradict each other": "contradicting_times",
    "date and seconds of the week that contradict each other": "contradicting_date",
    "not a finite number": "not_finite",
    "not a whole number": "not_whole",
    "missing value": "missing_value",
    "word where a number should be": "not_a_number",
    # rows of text files
    "row with another number of columns": "wrong_column_count",
    "line without end": "unterminated_line",
    "last line without line end": "unterminated_last_line",
    # records of binary logs
    "truncated": "truncated",
    "truncated message": "truncated_message",
    "truncated packet": "truncated_packet",
    "truncated record": "truncated_record",
    "truncated datagram": "truncated_datagram",
    "damaged packet": "damaged_packet",
    "damaged record": "damaged_record",
    "damaged datagram": "damaged_datagram",
    "stray bytes": "stray_bytes",
    "stray bytes at the end": "stray_end_bytes",
    "undecodable bytes": "undecodable_bytes",
    "text between records": "stray_text",
    "message other than INSPVA, INSPVAS, INSPVAX": "other_message",
    "XTF record other than R2Sonic bathymetry": "other_xtf_record",
    # INS
    "no position": "no_position",
    "impossible height": "impossible_height",
    "impossible attitude": "impossible_attitude",
    "impossible accuracy": "impossible_accuracy",
    "accuracy at an impossible time": "accuracy_impossible_time",
    "accuracy outside the INS's time": "accuracy_outside_ins",
    "quality Q of another number": "other_quality",
    # laser
    "point marked as invalid": "marked_invalid",
    "outside the area of laser.frame": "outside_frame_area",
    # sonar
    "repeated ping": "repeated_ping",
    "ping without times or angles": "incomplete_ping",
    "no detection": "no_detection",
    "extra detection": "extra_detection",
    "rejected detection": "rejected_detection",
    "flagged as not usable": "flagged_unusable",
    "angles of the ping jump": "angle_jump",
    "beam, fan and range do not meet": "no_intersection",
    "impossible beam": "impossible_beam",
    "impossible sound speed": "impossible_sound_speed",
    "impossible travel time": "impossible_travel_time",
    "impossible angle": "impossible_angle",
    "impossible tilt": "impossible_tilt",
    # georeference
    "outside every pass": "outside_passes",
    "hole in the INS": "ins_hole",
    "angle impossible with the given sound speed": "angle_beyond_sound_speed",
    "outside the box round the target": "outside_box",
    # segment
    "below or near the water line": "below_water_line",
    "above or near the water line": "above_water_line",
    "off every face": "off_faces",
    "near an edge": "near_edge",
    "footprint near an edge": "footprint_near_edge",
    "footprint partly on another face": "footprint_on_two_faces",
    "ray too flat": "grazing_ray",
    "masked": "masked",
}

# Codes of reasons with a variable part, by a pattern of the reason. CODES has precedence.
CODES_OF_PATTERNS = {
    r"ins status .+": "ins_status",
    r"quality Q .+": "quality",
    r"\w+ beside \w+": "other_record",
}


def code_of(reason: str) -> str:
    """Return the code of a reason; OTHER if it has none.

    >>> [code_of(reason) for reason in ("no time", "quality Q 6", "rust")]
    ['no_time', 'quality', 'other']
    """
    of_patterns = (code for pattern, code in CODES_OF_PATTERNS.items() if re.fullmatch(pattern, reason))
    return CODES.get(reason) or next(of_patterns, OTHER)
