"""A page as PDF, A4: by WeasyPrint if it is installed, else by a Chromium, which must not be open to the network."""

import os
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

from pipeline.atomic_files import read_regular, temporary_folder, write_bytes
from pipeline.errors import ArtefactError

CHROMIUMS = ("chromium", "chromium-browser", "google-chrome", "google-chrome-stable", "chrome", "microsoft-edge")
TIMEOUT_S = 180.0
MOST_BYTES = 300_000_000
ALONE = (  # a page is complete in itself: whatever else the browser wants to fetch, it must not
    "--host-resolver-rules=MAP * ~NOTFOUND", "--disable-background-networking", "--disable-component-update",
    "--disable-sync", "--no-first-run", "--no-default-browser-check", "--metrics-recording-only",
    "--disable-pdf-tagging",  # the tags have numbers that differ from run to run
)  # fmt: skip
MISSING = (
    "nothing here writes PDF: install WeasyPrint (pip install 'poolcal[pdf]'; it needs the library pango) or Chromium, "
    "or open {page} in a browser and print it"
)
MADE = re.compile(rb"(/(?:CreationDate|ModDate)\s*\(D:)\d{14}([^)]*)")  # times in what Chromium writes


def write_pdf(page: Path, file: Path, certificate: bool = False) -> str:
    """Write an HTML page as PDF, whole or not at all, and return the name of the program that made it.

    Parameters
    ----------
    page
        The page, complete in itself.
    file
        The PDF.
    certificate
        Whether to print the certificate's two pages of a report alone; they are numbered by themselves.

    Raises
    ------
    ArtefactError
        Neither WeasyPrint nor a Chromium is here, or it did not write the file.
    """
    text = page.read_text(encoding="utf-8")
    if certificate:
        text = text.replace("<body>", '<body class="certificate">', 1)  # the page's style hides the rest on paper
    library = _weasyprint()
    if library is not None:
        fetcher = library.urls.URLFetcher(allowed_protocols=("data",))  # nothing beyond the page is read
        html = library.HTML(string=text, url_fetcher=fetcher)
        write_bytes(file, bytes(html.write_pdf()))
        return f"WeasyPrint {library.__version__}"
    browser = next((path for name in CHROMIUMS if (path := shutil.which(name))), None)
    if browser is None:
        raise ArtefactError(MISSING.format(page=page))
    with temporary_folder() as place:
        shown = place / "page.html"
        shown.write_text(text, encoding="utf-8")
        write_bytes(file, _printed(browser, page, shown, place))
    return Path(browser).name


def _weasyprint() -> Any:
    """Return the module weasyprint; None if it is not installed, or too old, or the library pango is missing."""
    try:
        import weasyprint
    except (ImportError, OSError):
        return None
    return weasyprint if hasattr(weasyprint.urls, "URLFetcher") else None


def _printed(browser: str, page: Path, shown: Path, place: Path) -> bytes:
    """Return a page as the browser prints it.

    Parameters
    ----------
    browser
        The browser.
    page
        The page, for messages.
    shown
        What of it is printed, as a page of its own.
    place
        A folder for the browser's profile and its output.
    """
    made = place / "page.pdf"
    sandbox = ["--no-sandbox"] if os.geteuid() == 0 else []  # the browser has none for root
    command = [
        browser, "--headless=new", "--disable-gpu", *sandbox, *ALONE, f"--user-data-dir={place / 'profile'}",
        "--no-pdf-header-footer", f"--print-to-pdf={made}", shown.as_uri(),
    ]  # fmt: skip
    try:
        nowhere = subprocess.DEVNULL
        silent: dict[str, Any] = {"stdin": nowhere, "stdout": nowhere, "stderr": nowhere}
        done = subprocess.run(command, **silent, timeout=TIMEOUT_S, check=False, env=os.environ | {"HOME": str(place)})
        content = read_regular(made, MOST_BYTES)
    except subprocess.TimeoutExpired as error:
        raise ArtefactError(f"{browser}: wrote no PDF within {TIMEOUT_S:.0f} s; print {page} by hand") from error
    except OSError as error:
        raise ArtefactError(f"{browser}: wrote no PDF ({error.strerror}); print {page} by hand") from error
    if done.returncode or not content.startswith(b"%PDF") or len(content) > MOST_BYTES:
        raise ArtefactError(f"{browser}: wrote no PDF (status {done.returncode}); print {page} by hand")
    return MADE.sub(rb"\g<1>19800106000000\2", content)  # same page, same bytes
