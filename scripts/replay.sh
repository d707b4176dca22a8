#!/usr/bin/env bash
# Usage: scripts/replay.sh BAG [OPTION...]
#
# Plays a recording: into the graph as it was recorded (raw bytes, recorded QoS); in lockstep, so
# that nothing is dropped and the outcome is the same at any speed and load; or offline, straight
# through the same cores. BAG: a rosbag2 folder or file (MCAP, sqlite3), or a ROS 1 .bag.
#
#   --lockstep            wait until perception and inference have done with each frame. They are
#                         those that run on this ROS domain, or are started for this replay alone
#   --running             in lockstep: never start nodes
#   --offline             the same through the cores in this process, as fast as they go
#   --log FILE            write the decision log, a line of JSON for each demonstration, belief,
#                         decision and outcome (- is stdout); implies --lockstep unless --offline
#   --params FILE         ROS parameters of perception_node and inference_node, before those the bag
#                         was recorded with
#   --world W             the world: a shipped one or a world file (default: the recorded one)
#   --rate F              recorded seconds per second; 0: as fast as it goes, as --lockstep does
#   --start S, --end S    seconds after the first message
#   --loop                again and again
#   --pause               begin paused; keys: space goes on or pauses, n plays one message (one
#                         frame in lockstep), q ends
#   --topics TOPIC        play only this one; may be repeated, also for what the graph publishes
#                         itself (which is left out otherwise)
#   --remap FROM:=TO      another name for a topic; may be repeated
#   --type-map FROM:=TO   another type of the same layout; may be repeated
#   --clock               publish /clock, which never goes back, not even when looping
#   --qos FILE            YAML of QoS overrides, topic: policy: value, as `ros2 bag play` takes them
#   --domain N            ROS domain (default: ROS_DOMAIN_ID or 0)
#
# While a lockstep replay runs, the session hears arm and operator from the recording alone, and
# no arm is called.
#
# Examples: scripts/replay.sh bags/pear_right_left_place --offline --log -
#           scripts/replay.sh bags/story_asks --lockstep --rate 2 --log out/story.jsonl
# Exit codes: 0 done, 1 it failed or the bag is not whole, 2 usage.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
[[ -n ${1:-} ]] || set -- --help
source "$here/help.bash"
run_program likeme_replay.replay "$@"
