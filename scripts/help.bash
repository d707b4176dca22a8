# Sourced by every script here, which sets $here. -h or --help prints the comment at the top of the
# script, and ends it.

print_help() { sed -n '2,/^[^#]/{s/^# \{0,1\}//p}' "$0"; }

# run_program MODULE[:FUNCTION] [ARGUMENT...], in place of the script: see likeme_core.program.
run_program() {
  exec "$here/run.sh" env --block-signal=INT python -m likeme_core.program "${0##*/}" "$@"
}

case ${1:-} in
  -h | --help)
    print_help
    exit 0
    ;;
esac
