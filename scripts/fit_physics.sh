#!/usr/bin/env bash
# Usage: scripts/fit_physics.sh [OPTION...]
#
# Fits the free parameters of the simulated cell (likeme_arm_sim/fitted_parameters.py) to the real robot's
# trials and prints the simulated counts beside the real ones: how many of the 36 rows pass an exact
# multinomial test at 0.05, and how many of those that the search did not use.
#
#   --evaluate-only   no search: evaluate the current parameters
#   --parameters FILE no search: evaluate the values in FILE, JSON by name as a search leaves them
#                     in DIR/parameters.json; parameters that it does not name stay as they are
#   --camera          evaluate by full trials with perception instead of an error model of it
#   --trials N        trials of each row in the evaluation (50)
#   --first-seed N    seed of each row's first trial in the evaluation (2147483648)
#   --workers N       processes (2)
#   --seed N          seed of the search (1); the same seed gives the same search
#   --out DIR         where all trials are kept (out/fit_physics); a stopped search continues there
#
# Exit codes: 0 done, 1 failure, 2 usage.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
run_program likeme_experiments.commands.fit_physics:run "$@"
