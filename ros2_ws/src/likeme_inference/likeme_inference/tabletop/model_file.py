"""Model files: trial counts as editable text, format 1.

Comma-separated lines, `#` comments and empty lines anywhere, in this order:

    likeme_transition_model,1           format and its version
    name,chung2015_robot                name and version of the model
    version,1
    source,paper,"Where, by whom, ..."  one line per source: key, text; at least one
    states,LEFT,RIGHT,OFFTABLE
    actions,PLACE_LEFT,...              names in the order of their numbers
    goal,TIDY,LEFT,RIGHT                a goal and its states; none: each state is a goal
    aim,PLACE_LEFT,LEFT                 the goal an action is aimed at, if any; decides ties
    out_of_reach,OFFTABLE               a state from which the robot cannot move an object
    object,x_i,action,LEFT,RIGHT,OFFTABLE,source
    pear,LEFT,PLACE_LEFT,10,0,0,paper   counts of x_f LEFT, RIGHT, OFFTABLE from that source
    ...
    end,54,540                          rows and trials above; detects truncated files

The lines goal, aim and out_of_reach are omitted for the tabletop (domain.TABLETOP). Missing rows
are pairs without trials. Counts of the same row from several sources are added. Names are single
lines without spaces around them; an object is not named `end`, nor does its name start with `#`.
"""

from __future__ import annotations

import csv
import io
from importlib import resources
from pathlib import Path

from likeme_core.world import World, load_world
from likeme_core.world.file import DEFAULT_WORLD
from likeme_inference.tabletop.domain import TABLETOP, domain_of
from likeme_inference.tabletop.model_parser import FORMAT, ModelFileError, header, parse
from likeme_inference.tabletop.robot_model import RobotModel


def shipped(world: World | None = None) -> RobotModel:
    """Read the model shipped for a world; None: the 540 trials of the paper's own robot.

    Raises:
        ModelFileError: none is shipped for the world, or one for other regions, actions or
            objects.
    """
    name = DEFAULT_WORLD if world is None else world.name
    file = resources.files('likeme_inference').joinpath('data', f'{name}_robot.csv')
    if not file.is_file():
        raise ModelFileError(
            f'Expected a model file of the world {name}, got none: no model is shipped for it. '
            f'Learn one: learn.sh --offline --world {world.source if world else name}.'
        )
    model = parse(file.read_text(encoding='utf-8'))
    if world is None:
        return model
    _check_domain(model, world, file.name)
    if world.regions != load_world(name).regions:
        raise ModelFileError(
            f'Expected the regions of the shipped world {name} for its model, got others: '
            f'learn a model by learn.sh --offline --world {world.source}.'
        )
    return _of_its_objects(model, world, file.name)


def load(path: str | Path) -> RobotModel:
    """Read a model file.

    Raises:
        ModelFileError: with file, line number and reason.
    """
    path = Path(path)
    try:
        return parse(path.read_text(encoding='utf-8-sig'))
    except OSError as error:
        raise ModelFileError(f'{path}: {error.strerror}.') from error
    except UnicodeDecodeError as error:
        raise ModelFileError(
            f'{path}: expected UTF-8 text, got byte {error.start} wrong.'
        ) from error
    except ModelFileError as error:
        raise ModelFileError(f'{path}: {error}') from error


def load_tabletop(path: str | Path, world: World) -> RobotModel:
    """Read a model of a world; rows of objects that the world lacks are left out.

    Raises:
        ModelFileError: as `load`; or other states or actions than the world's; or none of its
            objects.
    """
    model = load(path)
    _check_domain(model, world, path)
    return _of_its_objects(model, world, path)


def _of_its_objects(model: RobotModel, world: World, place: str | Path) -> RobotModel:
    """Leave out objects that the world lacks, and refuse a model of those alone."""
    kept = model.only(world.objects)
    if not kept.objects:
        raise ModelFileError(
            f'{place}: expected rows of at least one object of the world {world.name} '
            f'({", ".join(world.objects)}), got {", ".join(model.objects) or "none"}.'
        )
    return kept


def _check_domain(model: RobotModel, world: World, place: str | Path) -> None:
    """Refuse other states, actions, aims or reach than the world's; place: of the model."""
    ours, theirs = domain_of(world), model.domain
    if (theirs.states, theirs.actions) != (ours.states, ours.actions):
        raise ModelFileError(
            f'{place}: expected a model of the world {world.name}, with the states '
            f'{", ".join(ours.states)} and the actions '
            f'{", ".join(ours.actions)}, got {model.label} with {", ".join(theirs.states)} and '
            f'{", ".join(theirs.actions)}.'
        )
    if theirs != ours:
        raise ModelFileError(
            f'{place}: expected the lines goal, aim and out_of_reach of the world '
            f'{world.name}, got others.'
        )


def save(model: RobotModel, path: str | Path) -> None:
    """Write a model file atomically.

    Raises:
        ModelFileError: see `format_model`.
    """
    text, path = format_model(model), Path(path)
    part = path.with_name(path.name + '.part')
    try:
        part.write_text(text, encoding='utf-8')
        part.replace(path)
    finally:
        part.unlink(missing_ok=True)


def format_model(model: RobotModel) -> str:
    """Write a model as the text of its file; `parse` gives it back.

    Raises:
        ModelFileError: a name that the format cannot represent, or no source.
    """
    text = io.StringIO()
    out = csv.writer(text, lineterminator='\n')
    out.writerows([FORMAT, ['name', model.name], ['version', model.version]])
    out.writerows(['source', key, sentence] for key, sentence in model.sources.items())
    domain = model.domain
    out.writerows([['states', *domain.states], ['actions', *domain.actions]])
    if domain != TABLETOP:
        out.writerows(['goal', name, *states] for name, states in domain.goals.items())
        out.writerows(['aim', *aim] for aim in domain.aims.items())
        out.writerows(['out_of_reach', state] for state in sorted(domain.out_of_reach))
    out.writerow(header(domain))
    out.writerows(
        [row.object, domain.states[row.x_i], domain.actions[row.action], *row.counts, row.source]
        for row in model.rows
    )
    out.writerow(['end', len(model.rows), sum(sum(row.counts) for row in model.rows)])
    _check_round_trip(model, text.getvalue())
    return text.getvalue()


def _check_round_trip(model: RobotModel, text: str) -> None:
    """Check that parsing the text gives the model back."""
    try:
        text.encode('utf-8')
        same = parse(text) == model
    except ValueError:
        same = False
    if not same:
        raise ModelFileError(
            f'A file cannot hold {model.label!r}: expected a source, and names of one line '
            'without spaces around them, no object called "end" or with a # in front; got the '
            f'sources {list(model.sources)} and the objects {list(model.objects)}.'
        )
