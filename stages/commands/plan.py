"""``poolcal plan``: an assessment of passes before they are sailed, on the screen, as YAML and as a recording."""

from pathlib import Path

import numpy as np
import yaml

from pipeline.atomic_files import write_text, writing
from pipeline.config.plan import Pass
from pipeline.config.verdict import VerdictLimits
from pipeline.console import plural
from pipeline.limits.verdict_limits import limits_by_setting, soundings_too_uncertain
from pipeline.maths.mount_parameters import PARAMETERS
from pipeline.mount import mount_of
from pipeline.planning import assessment
from pipeline.planning.assessment import Accuracy, PlanAssessment, shares_of_limits
from pipeline.planning.plan_document import plan_document
from pipeline.planning.setting import PredictionSetting
from pipeline.run.output_files import refuse_output
from pipeline.run.settings import load_settings
from pipeline.text_table import text_table
from stages.commands.answer import print_answer

WORSE = 1.05  # a sigma that grows by a smaller factor counts as unchanged


def command(file: Path, session: Path, pool_file: Path, out: Path | None, rrd: Path | None) -> int:
    """Print a plan's assessment; return 1 if the passes are not good enough.

    Parameters
    ----------
    file
        The YAML file with the plan.
    session
        Folder with session.yaml.
    pool_file
        The pool's YAML file.
    out, rrd
        Files for the prediction as YAML and as a recording; None: no file is written.
    """
    refuse_output("--yaml", out, session, begins=b"given:")
    refuse_output("--rrd", rrd, session)
    settings = load_settings(session, pool_file)
    pool, wanted = settings.pool, assessment.load_plan(file, settings.session)
    answer = assessment.assess_plan(wanted, pool, settings.session)
    said = table(answer, pool.verdict)
    if rrd is not None:
        from stages.views.plan import save_plan

        with writing(rrd):
            save_plan(answer, said, rrd)
    if out is not None:
        write_text(out, yaml.safe_dump(plan_document(answer), sort_keys=False))
    return print_answer(said, assessment.is_enough(answer, pool.verdict))


def table(answer: PlanAssessment, limits: VerdictLimits) -> str:
    """Return a plan's assessment as text for the screen."""
    setting, plan = answer.setting, answer.setting.plan
    rows = [(1, one, seconds, points) for one, seconds, points in answer.given.each()]
    lines = ["As given:", *_passes(setting, rows), *_sigmas(setting, answer.given, limits)]
    if not answer.given.solution.deficiency and (uncertain := soundings_too_uncertain(limits, answer.given.total)):
        lines.append(f"But: {uncertain}.")
    lines += [f"But: {gap}." for gap in answer.gaps]
    if answer.weakest:
        lines.append(f"Geometry: {answer.weakest}.")
    if answer.remedy:
        lines.append(f"Remedy: {answer.remedy}.")
    if plan.budget is not None:
        turns = (len(plan.passes) - 1) * plan.budget.turn_s
        lines.append(f"Time: {answer.given.seconds:.0f} s and {turns:.0f} s of turns, of {plan.budget.seconds:g} s.")
    if answer.better is not None:
        lines += ["", *_chosen(answer, answer.better, limits)]
    elif plan.candidates:
        short = "no candidate helps within the budget" if plan.budget else "candidates need a budget"
        lines += ["", f"No better list of passes: {short}."]
    return "\n".join(lines)


def _chosen(answer: PlanAssessment, better: Accuracy, limits: VerdictLimits) -> list[str]:
    """Return text lines on the chosen passes (one line for equal passes) and on the sigmas, some of which may grow."""
    alike: dict[Pass, tuple[int, float, dict[str, assessment.Array]]] = {}
    for one, seconds, points in better.each():
        number, longest, sums = alike.get(one, (0, 0.0, dict.fromkeys(points, np.zeros(1))))
        alike[one] = number + 1, max(longest, seconds), {name: sums[name] + points[name] for name in points}
    rows = [(number, one, seconds, points) for one, (number, seconds, points) in alike.items()]
    each = ", ".join(f"{number} x {one.where}" for number, one, *_ in rows)
    lines = [f"Chosen from the candidates, in the time there is: {each}, in any order."]
    lines += [*_passes(answer.setting, rows), *_sigmas(answer.setting, better, limits)]
    if answer.given.solution.deficiency or better.solution.deficiency:
        return lines
    shares = [shares_of_limits(answer.setting, one, limits) for one in (answer.given, better)]
    before, after = ((max(share.values()), max(share, key=share.__getitem__)) for share in shares)
    lines.append(
        f"The largest total sigma, as a share of its limit: {before[0]:.2f} ({before[1]}) as given, "
        f"{after[0]:.2f} ({after[1]}) with these."
    )
    grown = [
        f"{name} ({shares[0][name]:.2f} to {shares[1][name]:.2f} of its limit)"
        for name in shares[0]
        if shares[1][name] > WORSE * shares[0][name]
    ]
    return [*lines, f"Larger than as given: {', '.join(grown)}."] if grown else lines


def _passes(setting: PredictionSetting, rows: list[tuple[int, Pass, float, dict[str, assessment.Array]]]) -> list[str]:
    """Return one text line for each kind of pass: number of passes, time of one pass, and points of all passes."""
    families = list(dict.fromkeys(face.family for face in setting.model.faces))
    cells = []
    for number, one, seconds, points in rows:
        by_family = dict.fromkeys(families, 0.0)
        for face, count in zip(setting.model.faces, points["mbes"], strict=True):
            by_family[face.family] += float(count)
        sailed = (one.where, f"{one.speed_m_s:.2f} m/s", f"{one.heading_swing_deg:.1f}°")
        counts = [f"{by_family[family]:,.0f}" for family in families]
        cells.append((str(number), *sailed, f"{seconds:.0f} s", "", *counts, f"{points['laser'].sum():,.0f}"))
    heads = ("passes", "distance", "speed", "swing", "time", "soundings on", *families, "laser points")
    return text_table(f"  >6>12>10>8>8>15{'  >7' * len(families)}>15", heads, cells)


def _sigmas(setting: PredictionSetting, accuracy: Accuracy, limits: VerdictLimits) -> list[str]:
    heads, layout = ("sigma", "random", "total", "limit"), "  <8>12>12>12  <1"
    if accuracy.solution.deficiency:
        open_ones = plural(accuracy.solution.deficiency, "direction")
        return [*text_table(layout, heads, []), f"  {open_ones} of the unknowns left open: no result"]
    mounted = mount_of(setting.mbes.mount)
    random, total = mounted.sigmas(accuracy.random), mounted.sigmas(accuracy.total)
    rows, largest = [], limits_by_setting(limits)
    for name, _, key, unit in PARAMETERS:
        limit, sign = largest[key], "°" if unit == "deg" else "m"
        over = "above the limit" if not total[key] <= limit else ""
        rows.append((name, *(f"{value:.4f} {sign}" for value in (random[key], total[key], limit)), over))
    return text_table(layout, heads, rows)
