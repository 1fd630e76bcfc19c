"""The Rerun viewer on this machine's display. Only this machine can connect to it, and it sends no statistics."""

import contextlib
import json
import os
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from pipeline.atomic_files import temporary_folder
from pipeline.errors import ArtefactError
from pipeline.language.speaking import say

DISPLAYS = ("DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET")
NO_WINDOW = ("winit", "EventLoop", "DISPLAY")  # one of these is in the viewer's message if it cannot open a window


def show_recordings(paths: Sequence[Path], instead: str) -> int:
    """Open recordings in the viewer, wait until it is closed, and return the exit status.

    Parameters
    ----------
    paths
        The recordings.
    instead
        What the user can do on a machine without a display, for the error.

    Raises
    ------
    ArtefactError
        There is no display, or no viewer.
    """
    no_display = ArtefactError(f"no display here: {instead}")
    if sys.platform == "linux" and not any(map(os.environ.get, DISPLAYS)):
        raise no_display
    viewer = Path(sys.executable).with_name("rerun")
    places = [str(path.absolute()) for path in paths]
    try:
        with (
            temporary_folder() as place,
            without_statistics() as environment,
            (place / "messages").open("w+", encoding="utf-8", errors="replace") as messages,
        ):
            command = [str(viewer), "--bind", "127.0.0.1", *places]
            status = subprocess.run(command, check=False, env=environment, stderr=messages).returncode
            messages.seek(0)
            message = messages.read()
    except FileNotFoundError as error:
        raise ArtefactError(f"{viewer}: there is no such program; run make setup again") from error
    if status and any(word in message for word in NO_WINDOW):
        raise no_display
    if status:
        say(message.rstrip(), sys.stderr)
    return status and 1


@contextlib.contextmanager
def without_statistics() -> Iterator[Mapping[str, str]]:
    """Yield an environment in which the viewer sends no usage statistics, whatever the user's own settings are.

    The viewer has no option and no variable for this, only the file analytics.json. It gets a temporary file, and the
    user's file is neither read nor written.
    """
    with temporary_folder() as place:
        file = place / "rerun" / "analytics.json"
        file.parent.mkdir()
        settings = {"analytics_enabled": False, "analytics_id": "none", "metadata": {}}
        settings |= {"config_file_path": str(file), "data_dir_path": str(file.parent)}
        file.write_text(json.dumps(settings), encoding="utf-8")
        yield os.environ | {"XDG_CONFIG_HOME": str(place)}
