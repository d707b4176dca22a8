"""Topics chosen by name, and names of files for them."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Mapping, Sequence

from likeme_bags.camera_topics import without_slash
from likeme_bags.errors import BagError
from likeme_bags.reading import Bag
from likeme_bags.values import Topic

# Of a file's name without its ending, bytes: file systems take 255.
_LONGEST = 200


def select_topics(bag: Bag, names: Collection[str] | None) -> list[Topic]:
    """The topics of a bag with these names; all when none are given.

    The leading slash may be left out, unless the bag has a topic without one of the same name.

    Raises:
        BagError: a name is not in the bag.
    """
    if not names:
        return list(bag.topics)
    known = {topic.name for topic in bag.topics}
    wanted = set[str]()
    for name in names:
        same = (
            {name}
            if name in known
            else {each for each in known if without_slash(each) == without_slash(name)}
        )
        if not same:
            have = ', '.join(sorted(known)) or 'no topics'
            raise BagError(f'--topics {name}: expected topics of {bag.path.name}, got {have}.')
        wanted |= same
    return [topic for topic in bag.topics if topic.name in wanted]


def topics_to_export(
    bag: Bag, names: Collection[str] | None, types: Sequence[str] = ()
) -> list[Topic]:
    """Topics with messages, of these types if any are given; those with these `names`, or all.

    Raises:
        BagError: a name is not in the bag, or its topic has no messages or another type.
    """
    chosen = select_topics(bag, names)
    usable = [topic for topic in chosen if topic.count and (not types or topic.type in types)]
    if names and (others := [topic for topic in chosen if topic not in usable]):
        wanted = f' of {" or ".join(types)}' if types else ''
        raise BagError(
            f'--topics {others[0].name}: expected messages{wanted}, got {others[0].count} of '
            f'{others[0].type}.'
        )
    return usable


def file_stems(topics: Sequence[Topic]) -> dict[Topic, str]:
    """A file's name without its ending for each topic, different also where case is ignored."""
    stems = distinct([file_stem(topic.name, '-') for topic in topics], '-')
    return dict(zip(topics, stems, strict=True))


def rename_remarks(names: Mapping[str, str], slash: str) -> list[str]:
    """Which topic is under a name that got a number; `names`: topic to name."""
    return [
        f'{topic} is written as {name}, because another topic has that name.'
        for topic, name in names.items()
        if name.startswith(f'{file_stem(topic, slash)}{slash}')
    ]


def file_stem(name: str, slash: str) -> str:
    """A topic's name as that of a file; slash: stands for '/'."""
    name = re.sub(r'[^\w.~-]', '_', name.strip('/').replace('/', slash)).lstrip('.')
    return name.encode('utf-8')[:_LONGEST].decode('utf-8', 'ignore') or 'topic'


def distinct(names: Sequence[str], joint: str) -> list[str]:
    """The names, a number added after `joint` to those that repeat an earlier one."""
    given, taken = {_folded(name) for name in names}, set[str]()
    found = []
    for name in names:
        new, number = name, 1
        while _folded(new) in taken or (number > 1 and _folded(new) in given):
            number += 1
            new = f'{name}{joint}{number}'
        taken.add(_folded(new))
        found.append(new)
    return found


def _folded(name: str) -> str:
    """What a file system that ignores case and Unicode forms takes a name for."""
    return unicodedata.normalize('NFKC', name).casefold()
