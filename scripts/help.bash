# Sourced by the scripts here: -h or --help prints the comment at the top of the script, and ends it.

print_help() { sed -n '2,/^[^#]/{s/^# \{0,1\}//p}' "$0"; }

case ${1:-} in
  -h | --help)
    print_help
    exit 0
    ;;
esac
