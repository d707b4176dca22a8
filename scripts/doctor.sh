#!/usr/bin/env bash
# Usage: scripts/doctor.sh [--json] [--network] [--domain N]
#
# Says what of this machine and of a running cell is to be mended, one line each with the cure:
# environment, versions, ROS domain, discovery range, DDS profile and its socket buffers, shared
# memory; of a running cell who publishes what, with which QoS, and how often (watched for 2 s).
# Works without a cell.
#
#   --json       one JSON document
#   --network    as for a cell that was started with --network
#   --domain N   ROS domain (default: ROS_DOMAIN_ID or 0)
#
# Exit codes: 0 healthy, 1 something is to be mended, 2 usage.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
run_program likeme_bringup.ros.doctor_command "$@"
