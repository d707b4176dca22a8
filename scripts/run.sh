#!/usr/bin/env bash
# Usage: scripts/run.sh COMMAND [ARGUMENT...]
#
# Runs any command inside LikeMe's environment: the Python of .venv, ROS 2, the built workspace.
#
#   scripts/run.sh python              a Python that can import every part
#   scripts/run.sh pytest tests        tests, with pytest's own arguments
#   scripts/run.sh bash                a shell
#
# ROS_DOMAIN_ID and ROS_AUTOMATIC_DISCOVERY_RANGE are taken over when they are set.
# SIGINT ends the command also when a script starts this one with `&`, which has the shell ignore it;
# SIGHUP stays ignored under nohup.
# The exit code is the command's; 127 when there is no such command.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
[[ -n ${1:-} ]] || set -- --help
source "$here/help.bash"
"$here/setup.sh"
source "$here/env.sh"
command -v -- "$1" >/dev/null || { echo "run.sh: there is no command '$1' here." >&2; exit 127; }
# No shell can undo an ignored signal that it has inherited, env can.
exec env --default-signal=INT "$@"
