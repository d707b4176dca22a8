#!/usr/bin/env bash
# Usage: scripts/learn.sh [OPTION...]
#        scripts/learn.sh summary [--json] | export FILE [--model] | import FILE...
#
# Learns what the robot's actions do: a trial puts an object into a state, executes an action, and
# records where the camera sees the object come to rest. Uses the running cell (start_cell.sh)
# through ROS, or with --offline simulated cells in several processes. A stopped or killed run
# continues with the same command; no trial is lost or counted twice.
#
#   --offline           without ROS, as fast as possible
#   --workers N         processes (offline)
#   --scheduler ADDR    on a Dask cluster (offline)
#   --with-cell         start a cell first (live)
#   --resets WHO        simulator, or human (live): people set the table up, asked here, and as little as
#                       the robot's own actions allow; needs --robot or --with-cell
#   --policy NAME       systematic (every pair 10 times, as in the paper), random, or
#                       information-gain (the trial expected to improve decisions most)
#   --repetitions N     trials of each pair (systematic); --trials N: trials in all (the others)
#   --object NAME       only this object; may be repeated
#   --seed N            seed of the campaign
#   --robot NAME        name of the robot (live), if it is not the simulated one
#   --domain N          ROS domain (live)
#   --world W           a shipped world or a world file (default: chung2015)
#   --store PLACE       SQLite file or database URL (default: out/experience.sqlite, of other
#                       worlds out/experience-NAME.sqlite)
#
# Exit codes: 0 all trials are recorded, 1 failure or resets were skipped, 2 usage, 3 no cell is
# running, 130 Ctrl-C.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
run_program likeme_experiments.commands.learn:run "$@"
