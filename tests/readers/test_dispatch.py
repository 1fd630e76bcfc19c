"""The formats that dispatch opens, that session.yaml may name, and that detection recognises are the same."""

from typing import get_args

from pipeline.config.session import Ins, Laser, Mbes
from pipeline.readers import detect, file_kind
from pipeline.readers.dispatch import FORMATS
from pipeline.readers.file_kind import FileKind


def test_every_format_of_session_yaml_has_an_opener() -> None:
    blocks = {"ins": Ins, "laser": Laser, "mbes": Mbes}
    words = {
        (sensor, word) for sensor, block in blocks.items() for word in get_args(block.model_fields["format"].annotation)
    }
    assert words == set(FORMATS)


def test_every_format_is_recognised() -> None:
    kinds = [value for value in vars(file_kind).values() if isinstance(value, FileKind)]
    assert {(sensor, kind.format) for kind in kinds for sensor in kind.sensors} == set(FORMATS)
    returned = [value for value in vars(detect).values() if isinstance(value, FileKind)]
    assert [kind.title for kind in kinds if kind not in returned] == []
