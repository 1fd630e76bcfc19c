"""Where the checkout, its settings and its scenarios lie."""

from pathlib import Path

ROOT = Path(__file__).parents[2]
CONFIGS = ROOT / "configs"
SCENARIOS = CONFIGS / "scenarios"
