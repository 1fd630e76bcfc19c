"""The block ``about`` of session.yaml: what the certificate says of vessel, people and instruments, as free text.

Nothing is computed from it, and no stage has it in its Config: a change of it makes no result out of date, only the
report's page.
"""

import unicodedata
from typing import Annotated

from pydantic import AfterValidator, BeforeValidator, Field

from pipeline.config.quantities import Model

LONGEST, LONGEST_REMARKS = 300, 2000  # characters
TURNING = frozenset("\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")  # turn the order of letters


def _plain(text: str) -> str:
    r"""Return a text in one line, without blanks at its ends; raise ValueError if a letter of it cannot be printed.

    >>> _plain(" Haida  7\n")
    'Haida 7'
    """
    line = " ".join(text.split())
    if not line:
        raise ValueError("is empty: leave the key out")
    for letter in line:
        if letter in TURNING or unicodedata.category(letter) in ("Cc", "Cs"):
            raise ValueError(f"holds the character U+{ord(letter):04X}, which cannot be printed: take it out")
    return line


Words = Annotated[str, Field(max_length=LONGEST), AfterValidator(_plain)]
Remarks = Annotated[str, Field(max_length=LONGEST_REMARKS), AfterValidator(_plain)]


class AboutInstrument(Model):
    """One instrument: which one it is, and the firmware that ran in it."""

    make: Words | None = None
    model: Words | None = None
    serial: Words | None = None
    firmware: Words | None = None
    remarks: Words | None = None


class AboutInstruments(Model):
    """The instruments on board."""

    ins: AboutInstrument = AboutInstrument()
    laser: AboutInstrument = AboutInstrument()
    mbes: AboutInstrument = AboutInstrument()
    sound_speed_probe: AboutInstrument = AboutInstrument()


class About(Model):
    """What the certificate says beside what is computed. All of it is optional."""

    report_number: Words | None = None
    project: Words | None = None
    client: Words | None = None
    vessel: Words | None = None
    bracket: Words | None = None
    place: Words | None = None
    surveyor: Words | None = None
    approved_by: Words | None = None
    weather: Words | None = None
    water_temperature: Words | None = None
    ins_reference_point: Words | None = None
    datum: Words | None = None
    epoch: Words | None = None
    laser_calibration: Words | None = None
    target_survey: Words | None = None
    sound_speed: Words | None = None
    remarks: Remarks | None = None
    instruments: AboutInstruments = AboutInstruments()


AboutBlock = Annotated[About, BeforeValidator(lambda block: {} if block is None else block)]  # its keys all left out
