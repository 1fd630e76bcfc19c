"""Draw the documents' pictures without a screen: the tabs of a run's recordings, its report, and the pipeline.

    make setup-visual
    make pictures

The program needs Chromium and a software Vulkan driver. ``make setup-visual`` installs both if it has the permission.
"""

import argparse
import contextlib
import hashlib
import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from stages.views.viewer import without_statistics
from tools.pipeline_picture import picture

CHROMIUM = ("chromium", "chromium-browser", "google-chrome")
SETTLE_S = 1.5  # waiting time between a change of tab or time and the picture
WIDTH = 1280
TITLE_BAR_PX = 36  # height of the viewer's title bar, which shows warnings about the machine
ROOT = Path(__file__).parents[1]
DRAWN_FROM = "drawn_from.txt"  # file beside the pictures
SOURCES = {"report": "pipeline/results/pages", "recordings": "stages/views"}  # folder of the code that draws each


def missing() -> str:
    """Return a sentence that names missing programs; empty if all are installed."""
    driver = any(any(Path(folder).glob("*.json")) for folder in ("/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d"))
    there = {
        "Chromium": any(map(shutil.which, CHROMIUM)),
        "pdftotext": shutil.which("pdftotext") is not None,
        "a font with Chinese letters": _prints("fc-list", ":lang=zh", "family"),
        "a Vulkan driver": driver,
    }
    lacking = " and ".join(name for name, installed in there.items() if not installed)
    return f"needs {lacking}: make setup-visual" if lacking else ""


def _prints(*command: str) -> bool:
    """Return whether a program is installed and prints anything."""
    return shutil.which(command[0]) is not None and bool(subprocess.run(command, capture_output=True).stdout.strip())


def chromium(*options: str, timeout: float = 150) -> subprocess.CompletedProcess[str]:
    """Run headless Chromium with a home folder of its own; console messages of a page go to standard error."""
    program = next(path for name in CHROMIUM if (path := shutil.which(name)))
    with tempfile.TemporaryDirectory() as home:
        fixed = ["--headless=new", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--enable-logging=stderr"]
        command = [program, *fixed, f"--user-data-dir={home}", *options]
        return subprocess.run(command, capture_output=True, text=True, timeout=timeout, check=True)


@contextlib.contextmanager
def viewer(*recordings: Path) -> Iterator[Any]:
    """Open recordings in a headless viewer with a home folder of its own."""
    from rerun.experimental import ViewerClient

    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with tempfile.TemporaryDirectory() as home, without_statistics() as environment:
        kept = {name: os.environ.get(name) for name in ("HOME", "PATH", "XDG_CONFIG_HOME")}
        os.environ |= dict(environment) | {"HOME": home, "PATH": f"{Path(sys.executable).parent}:{os.environ['PATH']}"}
        try:
            client = ViewerClient.spawn(headless=True, port=port, hide_welcome_screen=True)
            try:
                client.open([str(path) for path in recordings])
                yield client
            finally:
                client.quit()
        finally:
            for name, value in kept.items():
                os.environ.pop(name) if value is None else os.environ.update({name: value})


def show_tab(client: Any, tab: str) -> None:
    """Bring a tab of the open recording's blueprint to the top."""
    blueprint = client.get_blueprint().blueprint
    containers = {path: fields.get("ContainerBlueprint", {}) for path, fields in blueprint.items()}
    (wanted,) = (path for path, fields in containers.items() if fields.get("display_name") == tab)
    (tabbed,) = (path for path, fields in containers.items() if fields.get("container_kind") == "Tabs")
    blueprint[tabbed]["ContainerBlueprint"]["active_tab"] = wanted.removeprefix("/")
    client.set_blueprint(blueprint, of="recording")


def picture_of(client: Any, path: Path) -> None:
    """Save a picture of the whole window when the last change is drawn."""
    time.sleep(SETTLE_S)
    client.save_screenshot(str(path))


def tabs(run: Path, out: Path) -> None:
    """Save a picture of each tab; save the tab Iteration at its first, second and last step."""
    import pandas as pd

    from stages.views.blueprint import tabs_of
    from stages.views.recording import recordings_of

    steps = pd.read_parquet(run / "angle_iterate" / "iterations.parquet")["iteration"]
    last = int(steps.max()) if len(steps) else 0
    with viewer(*recordings_of(run)) as client:
        for tab in tabs_of(run):
            show_tab(client, tab)
            steps_shown = {"-first": 0, "-second": 1, "-last": last} if tab == "Iteration" else {"": last}
            for suffix, step in steps_shown.items():
                if tab == "Quality" or not len(steps):
                    client.set_time("time", play_state="paused")
                else:
                    client.set_time("iteration", sequence=step, play_state="paused")
                picture_of(client, out / f"recording-{tab.lower().replace(' ', '-')}{suffix}.png")


def report(run: Path, out: Path, height: int = 1500) -> None:
    """Save a picture of the upper part of the report's page.

    Parameters
    ----------
    run
        Folder of the run.
    out
        Folder of the picture.
    height
        Height of the picture in pixels.
    """
    page = (run / "report" / "report.html").resolve().as_uri()
    chromium(f"--window-size={WIDTH},{height}", f"--screenshot={(out / 'report.png').resolve()}", page)


def drawn_from() -> str:
    """Return one line for the report and one for the recordings: the SHA-256 of all sources that draw it.

    A digest changes whenever the pictures may change. tests/test_pictures.py compares it with the digest stored beside
    the documents' pictures.
    """
    digests = {}
    for kind, folder in SOURCES.items():
        digest = hashlib.sha256()
        for path in sorted((ROOT / folder).glob("*")):
            if path.suffix in (".py", ".html"):
                digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
        digests[kind] = digest.hexdigest()
    return "".join(f"{kind} {hexdigest}\n" for kind, hexdigest in digests.items())


def main() -> None:
    """Draw all pictures of a run."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("run", type=Path, metavar="RUN", help="folder of a finished run with report and recordings")
    parser.add_argument("out", type=Path, metavar="OUT", help="folder of the pictures")
    options = parser.parse_args()
    if why := missing():
        sys.exit(why)
    options.out.mkdir(parents=True, exist_ok=True)
    out = options.out.resolve()
    tabs(options.run, out)
    report(options.run, out)
    for path in out.glob("*.png"):
        _lighten(path)
    picture(out / "pipeline.svg")
    (out / DRAWN_FROM).write_text(drawn_from(), encoding="utf-8")


def _lighten(path: Path) -> None:
    """Replace a picture by a WebP, as wide as a page shows it and a tenth of the size."""
    from PIL import Image

    image = Image.open(path).convert("RGB")
    if path.name.startswith("recording-"):
        image = image.crop((0, TITLE_BAR_PX, *image.size))
    image.thumbnail((WIDTH, 4 * WIDTH))
    image.save(path.with_suffix(".webp"), quality=85, method=6)
    path.unlink()


if __name__ == "__main__":
    main()
