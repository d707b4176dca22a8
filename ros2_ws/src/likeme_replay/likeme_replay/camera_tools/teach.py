"""Command `teach`: an object from views of it, into a world file."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
import yaml

from likeme_bags.errors import BagError
from likeme_core.cli import Domain, Network
from likeme_core.typer_app import App
from likeme_core.world import World
from likeme_core.world.edit import check_own_file, with_object, with_values, write_world
from likeme_core.world.file import load_world_anew, parse_world
from likeme_perception.catalogue import object_yaml, world_catalogue
from likeme_perception.confusion import Confusion, confusions_of_samples, confusions_with
from likeme_perception.teaching import (
    MIN_VIEWS,
    View,
    bare_table,
    check_views,
    simulated_object,
    taught_object,
)
from likeme_replay.camera_tools.view_source import ViewSource, views_of

#: Views that are taken of a running camera if --views does not say otherwise.
VIEWS = 6
#: What is less probable is not told.
_LEAST = 0.005

app = App(add_completion=False, rich_markup_mode=None)


@app.command()
def teach(
    name: Annotated[str, typer.Argument(metavar='NAME', help='Of the object.')],
    inputs: Annotated[
        list[Path] | None,
        typer.Argument(
            metavar='[BAG | FOLDER | COLOUR DEPTH...]', help='Views: the object alone, turned.'
        ),
    ] = None,
    live: Annotated[bool, typer.Option('--live', help='From the running camera.')] = False,
    world: Annotated[
        str, typer.Option(metavar='FILE', help='World file of yours that gets the object.')
    ] = '',
    views: Annotated[
        int, typer.Option(min=MIN_VIEWS, max=50, help='How many to take with --live.')
    ] = VIEWS,
    check: Annotated[
        bool, typer.Option('--check', help='Only say what it could be mixed up with.')
    ] = False,
    any_table: Annotated[
        bool,
        typer.Option('--any-table', help='Of pairs: find camera pose and table in the image.'),
    ] = False,
    intrinsics: Annotated[
        Path | None,
        typer.Option(help='Of pairs: JSON with fx, fy, cx, cy; default: FOLDER has it.'),
    ] = None,
    network: Network = False,
    domain: Domain = 0,
) -> None:
    """Learn what an object looks like, from 5 views or more, for perception and simulator."""
    os.environ['ROS_DOMAIN_ID'] = str(domain)
    given = inputs or []
    if not world:
        _refuse('Expected --world FILE; `world.sh new` starts one.')
    if (live and given) or (not check and live == bool(given)):
        _refuse('Expected either --live or images or a recording of the object; see --help.')
    source = ViewSource(given, live, views, intrinsics, any_table, domain, network)
    try:
        if check and not (live or given):
            print(told(confusions_with(world_catalogue(load_world_anew(world)), name)))
            return
        check_own_file(Path(world))
        known = load_world_anew(world)
        taken = list(views_of(source, known))
        check_views(taken)
        text = _new_text(name, Path(world), known, taken)
        new = parse_world(text, Path(world)) if check else write_world(Path(world), text)
        catalogue = world_catalogue(new)
        print(told(confusions_of_samples(catalogue, name, [view.sample for view in taken])))
        others = [c for c in confusions_with(catalogue, name) if c.object != name]
        print(told(others) or f'Nothing else of {known.name} is taken for it.')
        if not check:
            print(_what_now(name, known, new, Path(world), source))
    except (ValueError, OSError, BagError) as error:
        print(f'teach: {" ".join(str(error).split())}', file=sys.stderr)
        raise typer.Exit(1) from None
    except KeyboardInterrupt:
        print('teach: ended, nothing is written.', file=sys.stderr)
        raise typer.Exit(130) from None


def _new_text(name: str, path: Path, known: World, views: list[View]) -> str:
    """The text of the world file with the object, and the table's colour if it had none."""
    looks = yaml.safe_load(object_yaml(taught_object(name, views)))[0]['looks']
    entry: dict[str, Any] = {'name': name}
    if name in known.objects and (start := known.object(name).start) is not None:
        entry['start'] = start.name
    entry |= {'looks': looks, 'simulation': simulated_object(views)}
    text, colour = path.read_text(encoding='utf-8'), bare_table(views)
    if known.table.colour is None and colour is not None:
        text = with_values(text, 'table', {'colour': [round(c) for c in colour.tolist()]})
    return with_object(text, entry)


def told(confusions: Iterable[Confusion]) -> str:
    """The confusions that matter, a line for each object."""
    lines: dict[str, list[str]] = {}
    for each in confusions:
        if each.probability >= _LEAST:
            words = lines.setdefault(each.object, [])
            words.append(f'{each.taken_for} {each.probability:.2f}')
    return '\n'.join(f'{name} is taken for: {", ".join(words)}' for name, words in lines.items())


def _what_now(name: str, before: World, new: World, path: Path, source: ViewSource) -> str:
    """Where the object was written, and what has to be restarted."""
    simulation = new.object(name).simulation or {}
    part = next(key for key in simulation['parts'][0] if key != 'colour')
    written = (
        f'Written: {path}: {name}, for the simulator a {part} of the measured size '
        '(mass and friction are guesses).'
    )
    if new.digest != before.digest:
        return (
            f'{written}\nThe world is {new.label} now: start the cell anew with --world {path}; '
            f'nodes of {before.label} refuse its messages.'
        )
    if not source.live:
        return f'{written}\nA running perception_node looks anew after perception/reset.'
    # Imported here: the rest needs no ROS.
    from likeme_replay.ros.reset_perception import reset_perception

    return f'{written}\n{reset_perception(source.domain, source.network)}'


def _refuse(sentence: str) -> NoReturn:
    print(f'teach: {sentence}', file=sys.stderr)
    raise typer.Exit(2)


def main() -> None:
    """Entry point of `teach`."""
    app()


if __name__ == '__main__':
    main()
