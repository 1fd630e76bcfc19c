"""The library of poolcal. No module in it imports a stage.

This module limits BLAS to one thread before numpy is first imported. The last bits of ``eigh``, ``solve`` and
``matmul`` depend on the number of threads, and the same input must give the same Parquet bytes on any machine. Parallel
work is done on the parts of a stream instead (:mod:`pipeline.run.workers`).
"""

import os
from pathlib import Path

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"

CONFIGS = Path(__file__).parents[1] / "configs"  # beside the packages, also where they are installed
__version__ = "0.1.0"
