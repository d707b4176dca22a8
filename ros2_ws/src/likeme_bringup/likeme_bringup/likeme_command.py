"""The command `likeme`: every command line of the packages by its name, for an installed tree."""

from __future__ import annotations

import importlib
import sys

#: Command -> module and function of its entry point; imported when it is called.
COMMANDS = {
    'allow': 'likeme_arm.ros.allow_command:main',
    'arm': 'likeme_bringup.ros.cell_commands:arm',
    'ask-human': 'likeme_operator.ros.question_commands:main',
    'bag': 'likeme_bags.bag_console:main',
    'calibrate': 'likeme_replay.camera_tools.calibrate:main',
    'cell': 'likeme_bringup.ros.cell_commands:cell',
    'demo': 'likeme_bringup.demo:run',
    'doctor': 'likeme_bringup.ros.doctor_command:main',
    'fit-physics': 'likeme_experiments.commands.fit_physics:run',
    'foxglove': 'likeme_replay.foxglove_console:main',
    'gaze': 'likeme_experiments.commands.gaze:run',
    'learn': 'likeme_experiments.commands.learn:run',
    'log': 'likeme_inference.log_commands:main',
    'operator': 'likeme_operator.ros.operator_commands:main',
    'param': 'likeme_bringup.ros.param_command:param',
    'policies': 'likeme_replay.policies.console:main',
    'record': 'likeme_replay.record:main',
    'replay': 'likeme_replay.replay:main',
    'reproduce': 'likeme_experiments.commands.reproduce:run',
    'see': 'likeme_replay.camera_tools.see:main',
    'show': 'likeme_bringup.ros.cell_commands:show',
    'start-cell': 'likeme_bringup.start_cell:main',
    'stop': 'likeme_arm.ros.stop_command:main',
    'teach': 'likeme_replay.camera_tools.teach:main',
    'topic': 'likeme_bringup.ros.topic_commands:topic',
    'view': 'likeme_replay.view:main',
    'world': 'likeme_bringup.world_commands:main',
}
#: Commands of the cell that are called most: `likeme hold` is `likeme cell hold`.
OF_THE_CELL = ('hold', 'resume', 'status')


def main() -> None:
    """Run the command that the first word names; exit code 2 if there is none."""
    words = sys.argv[1:]
    if words and words[0] in OF_THE_CELL:
        words.insert(0, 'cell')
    if not words or words[0] not in COMMANDS:
        names = ', '.join((*COMMANDS, *OF_THE_CELL))
        asked = words and words[0] in ('-h', '--help')
        got = '' if asked else f' Got {words[0]!r}.' if words else ' Got none.'
        print(
            f'Usage: likeme COMMAND ...\nExpected one of {names}.{got}',
            file=sys.stdout if asked else sys.stderr,
        )
        raise SystemExit(0 if asked else 2)
    module, _, function = COMMANDS[words[0]].partition(':')
    sys.argv = [f'likeme {words[0]}', *words[1:]]
    code = getattr(importlib.import_module(module), function)()
    raise SystemExit(code)


if __name__ == '__main__':
    main()
