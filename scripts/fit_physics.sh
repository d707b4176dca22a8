#!/usr/bin/env bash
# Usage: scripts/fit_physics.sh [OPTION...]
#
# Fits the few free numbers of the simulated cell (likeme_arm_sim/fitted_parameters.py) to the real robot's
# trials, and prints the simulated table beside the real one: how many of the 36 rows pass an exact
# multinomial test at 0.05, and how many of those that the search never saw.
#
#   --judge       search nothing: judge the parameters the cell has now
#   --camera      judge by full trials with the real perception, instead of an eye like it
#   --trials N    fresh trials of each row for the judgement (50)
#   --workers N   processes (2)
#   --seed N      of parameters and trials (1); the same seed gives the same search
#   --out DIR     where every trial is kept (out/fit_physics); a killed search goes on there
#
# Exit codes: 0 done, 1 it failed, 2 usage.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
exec "$here/run.sh" python -m likeme_experiments.fit_physics "$@"
