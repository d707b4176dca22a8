#!/usr/bin/env bash
# Usage: scripts/learn.sh [OPTION...]
#        scripts/learn.sh summary [--json] | export FILE [--model] | import FILE...
#
# The robot learns what its own actions do: it puts an object into a state, tries an action, and
# records what the camera saw. Drives the running cell (start_cell.sh) through ROS, or with
# --offline cells of its own in several processes. Stopped however roughly, the same command goes
# on where it was: no trial is lost or counted twice.
#
#   --offline           without ROS, as fast as it goes
#   --workers N         processes (offline)
#   --scheduler ADDR    on a Dask cluster (offline)
#   --with-cell         starts a cell of its own for it (live)
#   --policy NAME       systematic (every pair 10 times, as the paper), random, or
#                       information-gain (where decisions gain most; one trial after another)
#   --repetitions N     trials of each pair (systematic); --trials N: trials in all (the others)
#   --object NAME       only this one; may be repeated
#   --seed N            of the campaign
#   --robot NAME        of the body (live), if it is not the simulated one
#   --domain N          ROS domain (live)
#   --store PLACE       SQLite file or database URL (default: out/experience.sqlite)
#
# Exit codes: 0 all trials are recorded, 1 it failed, 2 usage, 3 no cell is running, 130 Ctrl-C.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
exec "$here/run.sh" python -m likeme_experiments.learn "$@"
