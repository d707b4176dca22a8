"""`python -m likeme_operator`: the command line `operator`."""

from likeme_operator.ros.operator_commands import main

if __name__ == '__main__':
    main()
