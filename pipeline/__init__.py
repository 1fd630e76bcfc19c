"""poolcal's library: everything that does not know what a stage is.

BLAS is pinned to one thread before numpy is first imported: ``eigh``, ``solve`` and ``matmul`` differ in their last
bits between thread counts, and the same input must give the same Parquet bytes on any machine. The work is spread
over parts of a stream instead (:mod:`pipeline.run.workers`).
"""

import os
from pathlib import Path

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"

CONFIGS = Path(__file__).parents[1] / "configs"  # beside the packages, also where they are installed
__version__ = "0.1.0"
