"""What a terminal shows while a command works, and that anything else gets none of it."""

import io

from pipeline.run.progress import Progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_a_terminal_is_told_what_is_being_done() -> None:
    stream = Terminal()
    progress = Progress(stream)
    with progress.shown("reading the files"):
        assert "reading the files" in stream.getvalue()
        progress.next("calibrating a sample")
    assert stream.getvalue().index("calibrating a sample") > stream.getvalue().index("reading the files")
    progress.next("nothing is being done")
    assert "nothing" not in stream.getvalue()


def test_a_file_gets_none_of_it() -> None:
    stream = io.StringIO()
    progress = Progress(stream)
    with progress.shown("reading the files"):
        progress.next("calibrating a sample")
    assert stream.getvalue() == ""
