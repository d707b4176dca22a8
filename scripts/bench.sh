#!/usr/bin/env bash
# Usage: scripts/bench.sh [NAME] [--json] [ARGUMENT...]
#
# Runs benchmarks/NAME.py and prints what it measured beside the bars it is held against.
# Without a name: the list.
#
#   --json   one JSON document with the machine, the bars and the notes

set -euo pipefail
here=$(cd "$(dirname "$(readlink -f "${BASH_SOURCE[0]}")")" && pwd)
case ${1:-} in
  -h | --help)
    sed -n '2,/^[^#]/{s/^# \{0,1\}//p}' "$0"
    exit 0
    ;;
esac
if [[ $# == 0 ]]; then
  cd "$here/../benchmarks"
  for file in *.py; do
    if [[ $file != report.py ]]; then
      printf '%-20s %s\n' "${file%.py}" "$(sed -n '1{s/^"""//;s/"""$//;p}' "$file")"
    fi
  done
  exit 0
fi
name=$1
shift
file=$here/../benchmarks/$name.py
if [[ $name == report || $name == */* || ! -f $file ]]; then
  echo "bench.sh: there is no benchmark '$name'; scripts/bench.sh lists them." >&2
  exit 2
fi
exec "$here/run.sh" python "$file" "$@"
