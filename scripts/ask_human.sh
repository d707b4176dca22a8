#!/usr/bin/env bash
# Usage: scripts/ask_human.sh [--by NAME] | list | answer ID done|try|skip [--by NAME] [--object NAME]
#                             [--network] [--domain N]
#
# Answers the robot from a console. Without arguments it waits for requests and reads answers from
# the keyboard. The same as scripts/operator.sh list, answer and --plain.
#
#   list                     pending requests
#   answer ID done           "I did it by hand": the camera decides the outcome
#   answer ID try            "try your best action anyway"
#   answer ID skip           "skip it"
#   --object NAME            answer only a request about this object
#   --json                   list and answer as one JSON document
#   --by NAME                name of the operator (default: the user name)
#   --network                look for the cell on other machines of the subnet too
#   --domain N               ROS domain (default: ROS_DOMAIN_ID or 0)
#
# Exit codes: 0 done (or ended by Ctrl-C), 1 the answer was refused or the input ended,
# 2 usage, 3 no cell is running.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
run_program likeme_operator.ros.question_commands "$@"
