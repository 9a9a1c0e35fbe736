# SPDX-License-Identifier: GPL-3.0-or-later
"""Error against run time of the curvature estimators: docs/results/estimators.md, with figures.

    ./dev bench estimators             everything: hours on two cores
    ./dev bench estimators --missing   goes on where an earlier run stopped
    ./dev bench estimators --page      the page and figures, from the JSON file
    ./dev bench estimators --quick     a look, into output/estimators/

Every measurement is a process of its own, forked from one that has loaded the libraries and no
mesh, so that its peak memory above the start is the estimator's. Linux only, therefore.
"""

import os

# One thread, so that CPU seconds are seconds; numpy reads this when it is loaded.
os.environ["OPENBLAS_NUM_THREADS"] = "1"
