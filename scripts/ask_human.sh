#!/usr/bin/env bash
# Usage: scripts/ask_human.sh [--by NAME] | list | answer ID done|try|skip [--by NAME]
#                             [--network] [--domain N]
#
# The operator's console: what the robot asks, and the answer. Without arguments it waits for
# questions and asks at the keyboard.
#
#   list                     requests that are pending
#   answer ID done           "I did it by hand": the robot looks and believes its camera
#   answer ID try            "try your best action anyway"
#   answer ID skip           "leave it"
#   --by NAME                who answers (default: the user's name)
#   --network                look for the cell on other machines of the subnet too
#   --domain N               ROS domain (default: ROS_DOMAIN_ID or 0)
#
# Exit codes: 0 done (or left by Ctrl-C), 1 the answer was refused or the keyboard's input ended,
# 2 usage, 3 no cell is running.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
exec "$here/run.sh" python -m likeme_inference.ask_human_node "$@"
