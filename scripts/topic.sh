#!/usr/bin/env bash
# Usage: scripts/topic.sh list | echo TOPIC | hz TOPIC  [--json] [--network] [--domain N]
#
# Looks at the topics of a running graph, as `ros2 topic` does.
#
#   list          every topic: its type, how many nodes publish it and how many read it
#   echo TOPIC    its messages as YAML; -n N or --count N: so many. Long arrays are cut
#   hz TOPIC      its rate and longest gap; --seconds S: measured for so long (default: 5)
#   --json        JSON instead: one document; echo: one a line, arrays whole
#   --network     look for the graph on other machines of the subnet too
#   --domain N    ROS domain (default: ROS_DOMAIN_ID or 0)
#
# Example: scripts/topic.sh echo decision -n 1
# Exit codes: 0 done, 1 no message came to measure, 2 usage, 3 no such topic or no node, 130 Ctrl-C.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
run_program likeme_bringup.ros.topic_commands:topic "$@"
