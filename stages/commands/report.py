"""``poolcal report``: the report's page, whose first two pages are the certificate, and either of them as PDF."""

import sys
from pathlib import Path

from pipeline.config.yaml_file import SESSION_YAML
from pipeline.errors import ArtefactError, ConfigError
from pipeline.language.speaking import say
from pipeline.run.output_files import refuse_output
from pipeline.run.results import PAGE, agreeing, calibration
from pipeline.run.settings import read_settings
from stages import names_in
from stages.commands.answer import say_failures
from stages.commands.draw import Drawings, draw_missing


def command(run: Path, pdf: Path | None, certificate: bool) -> int:
    """Draw the page of a finished run, if it is missing or out of date, and write it as PDF.

    Parameters
    ----------
    run
        The run folder. Its results are only read.
    pdf
        The PDF file; None: none is written.
    certificate
        Whether the PDF is to hold the certificate's two pages alone.
    """
    if certificate and pdf is None:
        raise ConfigError("--certificate: says what the PDF holds; add --pdf FILE")
    settings = read_settings(run)
    refuse_output("--pdf", pdf, run, settings.session_folder, begins=b"%PDF")
    calibration(run, several_heads=True)
    if settings.is_about_changed():
        again = (
            f"{settings.session_folder / SESSION_YAML}: about has changed since the run, which the page does not show; "
            "poolcal run again (it computes only what changed)"
        )
        if pdf is not None:
            raise ArtefactError(f"{again}, then poolcal report")
        say(f"Note: {again}", sys.stderr)
    done = agreeing(run, names_in(run))
    for stage in names_in(run):
        if stage not in done:
            raise ArtefactError(f"{run}: {stage} is not finished, or of other settings than run.yaml's; run it again")
    failures = draw_missing(run, Drawings(report=True, recordings=False))
    if failures:
        say_failures(failures)
        raise ArtefactError(f"{run}: its report could not be drawn; see above")
    page = run / "report" / PAGE
    say(f"Report: {page}", sys.stdout)
    if pdf is not None:
        from pipeline.results.pages.pdf import write_pdf

        say(f"PDF: {pdf} (by {write_pdf(page, pdf, certificate)})", sys.stdout)
    return 0
