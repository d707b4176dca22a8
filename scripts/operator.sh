#!/usr/bin/env bash
# Usage: scripts/operator.sh [--plain | --web] [--by NAME] [--skip-after S] [--network] [--domain N]
#        scripts/operator.sh COMMAND [ARGUMENT...] [--json] [--network] [--domain N]
#
# The operator's desk of a running cell. Without a command: its screen, 80x24 or more, by keys alone; `?`
# lists them. The first run installs textual (about 15 MB) from scripts/operator.lock. Handbook:
# docs/operator.md.
#
#   list                     the robot's open questions
#   answer ID done|try|skip  answer one; --by NAME, --object NAME: only if it is about this object
#   why DECISION             how a decision came about and ended, from the decision log
#   whatif [DECISION]        what each mode would decide; --mode MODE, --threshold P. Changes nothing
#   hold, resume             stop every motion; allow motion again and say what moves
#                            (--dry-run: only say it)
#   log                      the newest entries of the decision log: -n N or --last N; --kind KIND
#   watch                    a line for everything that happens; -n N or --count N: ends after N
#   status                   health of each node, whether motion is allowed, open questions
#
#   --json        one JSON document; watch and log: one a line
#   --plain       line mode, for pipes and screen readers
#   --web         the screen in a browser of this host, at http://localhost:8000; --port N: another port.
#                 From elsewhere: ssh -L 8000:localhost:8000 HOST
#   --skip-after S   the screen skips a question that nobody answered for S seconds (default: never)
#   --by NAME     name of the operator (default: the user name)
#   --store PLACE, --namespace NS   of the log, see scripts/log.sh
#   --network     look for the cell on other machines of the subnet too
#   --domain N    ROS domain (default: ROS_DOMAIN_ID or 0)
#
# Exit codes: 0 done (or ended by Ctrl-C), 1 refused, not confirmed or not in service, 2 usage,
# 3 no cell is running, 78 the port of --web is not free, 141 the reader of the output has gone.

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
source "$here/help.bash"
# Line mode and single commands need no screen.
command_or_plain() {
  while (($#)); do
    case $1 in
      --by | --domain | --skip-after | --port) shift ;;
      --web) return 1 ;;
      --plain | [!-]*) return 0 ;;
    esac
    shift || true
  done
  [[ ! -t 0 || ! -t 1 ]]
}
if ! command_or_plain "$@"; then
  source "$here/extra.bash"
  install_extra scripts/operator.lock
fi
run_program likeme_operator.ros.operator_commands "$@"
