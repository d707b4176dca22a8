#!/usr/bin/env bash
# Usage: scripts/param.sh list [NODE] | get NODE NAME | set NODE NAME VALUE  [--network] [--domain N]
#
# Looks at and changes the parameters of a running node, as `ros2 param` does. NODE is arm_driver,
# perception_node, inference_node, gaze_node, or any other.
#
#   list          every parameter with its value, meaning and range; without NODE: the nodes
#   get, set      one of them; VALUE as in YAML
#   --network     look for the node on other machines of the subnet too
#   --domain N    ROS domain (default: ROS_DOMAIN_ID or 0)
#
# Example: scripts/param.sh set inference_node mode sequential
# Exit codes: 0 done, 1 the node refused, 2 usage, 3 there is no such node.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
run_program likeme_bringup.ros.param_command:param "$@"
