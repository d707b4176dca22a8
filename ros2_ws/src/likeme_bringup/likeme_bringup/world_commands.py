"""Command `world`: check, draw and start world files, measure what objects look like."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from likeme_core.typer_app import App
from likeme_core.world import World, WorldFileError, load_world, shipped_worlds
from likeme_core.world.file import world_path
from likeme_core.world.folder import WORLDS_FOLDER

app = App(add_completion=False, rich_markup_mode=None, no_args_is_help=True)
File = Annotated[str, typer.Argument(metavar='NAME|FILE', help='A shipped world or a file.')]
#: The comment by which editors find the schema, and what `new` writes instead.
SCHEMA = '$schema=world.schema.json'
TEMPLATE = 'three_bins'


@app.command()
def check(file: File) -> None:
    """Say what is wrong in a world file, with the lines, or what is in it. Exit code 1: wrong."""
    try:
        world = load_world(file)
    except WorldFileError as error:
        path = world_path(file)
        for line, message in error.problems:
            print(f'{path}:{line}: {message}', file=sys.stderr)
        raise typer.Exit(1) from None
    except ValueError as error:
        _fail(str(error))
    print(about(world))


def about(world: World) -> str:
    """What is in a world, as text."""
    reach = [state.name for state in world.states if state not in world.out_of_reach]
    real = [entry.name for entry in world.object_entries if entry.simulation is None]
    lines = [
        f'{world.label}: {world.description or "no description"}',
        f'regions: {", ".join(state.name for state in world.states)}; '
        f'the robot reaches into {", ".join(reach)}',
        f'actions: {", ".join(action.name for action in world.actions)}',
        f'objects: {", ".join(world.objects)}'
        + (f'; not simulated: {", ".join(real)}' if real else ''),
        f'story: {len(world.story)} acts',
    ]
    return '\n'.join(lines)


@app.command('list')
def list_command() -> None:
    """List the shipped worlds."""
    for name in shipped_worlds():
        print(f'{name:18} {load_world(name).description}')


@app.command()
def draw(
    file: File,
    out: Annotated[Path, typer.Option(help='PNG or SVG to write.')] = Path('world.png'),
) -> None:
    """Draw the table from above with regions, places, pushes and where objects start."""
    world = _loaded(file)
    # Takes a second to import.
    from likeme_bringup.world_drawing import draw_world

    try:
        draw_world(world).savefig(out, dpi=150)
    except (OSError, ValueError) as error:
        _fail(f'{out} is not written: {error}.')
    print(f'Drawn: {out}')


@app.command()
def new(
    file: Annotated[Path, typer.Argument(help='World file to write, e.g. my_table.yaml.')],
) -> None:
    """Start a world file: a copy of three_bins to change, with its meshes."""
    if file.exists():
        _fail(f'Expected a new file, got {file}, which exists.')
    if file.suffix not in ('.yaml', '.yml') or not file.stem.isidentifier():
        _fail(f'Expected a name like my_table.yaml, got {file.name}.')
    text = world_path(TEMPLATE).read_text(encoding='utf-8')
    text = text.replace(SCHEMA, f'$schema={WORLDS_FOLDER / "world.schema.json"}')
    text = text.replace(f'name: {TEMPLATE}', f'name: {file.stem}')
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        meshes = file.parent / 'meshes'
        meshes.mkdir(exist_ok=True)
        for part in _meshes(load_world(TEMPLATE)):
            (file.parent / part).write_bytes((WORLDS_FOLDER / part).read_bytes())
        file.write_text(text, encoding='utf-8')
    except OSError as error:
        _fail(f'{file} is not written: {error.strerror}.')
    print(f'Written: {file}. Change it, then: world.sh check {file}')


def _meshes(world: World) -> list[str]:
    return [
        part['mesh']
        for entry in world.object_entries
        if entry.simulation is not None
        for part in entry.simulation['parts']
        if 'mesh' in part
    ]


@app.command()
def looks(
    file: File,
    objects: Annotated[
        list[str] | None, typer.Argument(metavar='[OBJECT]...', help='Default: all.')
    ] = None,
) -> None:
    """Print what the simulated camera sees of objects, for `looks` in the world file.

    For a real object: teach.sh NAME --live.
    """
    world = _loaded(file)
    # Starts the physics engine.
    from likeme_bringup.simulated_looks import simulated_looks
    from likeme_perception.catalogue import object_yaml

    try:
        for name in objects or world.objects:
            print(object_yaml(simulated_looks(world, name)), end='')
    except ValueError as error:
        _fail(str(error))


def _loaded(file: str) -> World:
    try:
        return load_world(file)
    except ValueError as error:
        _fail(str(error))


def _fail(sentence: str) -> NoReturn:
    print(f'world: {sentence}', file=sys.stderr)
    raise typer.Exit(1)


def main() -> None:
    """Entry point of `world`."""
    app()


if __name__ == '__main__':
    main()
