"""The checks of `bag.sh doctor`: each has a name and one line."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from likeme_bags.bag_warnings import Subject
from likeme_bags.camera_checks import CAMERA_CHECKS
from likeme_bags.errors import BagError
from likeme_bags.facts import gather
from likeme_bags.reading import Bag, open_bag
from likeme_bags.topic_checks import TOPIC_CHECKS
from likeme_bags.verdicts import Level, Verdict, fine


class Finding(NamedTuple):
    """The outcome of one check."""

    check: str
    level: Level
    sentence: str


def examine(path: Path) -> list[Finding]:
    """All checks, in a fixed order; only the first when the bag does not open."""
    try:
        bag = open_bag(path, thorough=True)
    except BagError as error:
        return [Finding('opens', Level.FAIL, str(error))]
    with bag:
        facts = gather(bag)
        opens = f'{bag.count} messages on {len(bag.topics)} topics in {len(bag.files)} file(s).'
        findings = [Finding('opens', Level.FINE, opens)]
        for about in Subject:
            findings.append(Finding(about, *_noted(bag, about)))
        for name, check in (TOPIC_CHECKS | CAMERA_CHECKS).items():
            findings.append(Finding(name, *check(bag, facts)))
        return findings


def _noted(bag: Bag, about: Subject) -> Verdict:
    """What reading the bag has to say of one matter."""
    notes = [note for note in bag.all_warnings if note.subject == about]
    if not notes:
        return fine(_NOTHING[about])
    first = next((note for note in notes if note.loss), notes[0])
    more = f' ({len(notes) - 1} more)' if len(notes) > 1 else ''
    return (Level.FAIL if first.loss else Level.WARN), first.sentence + more


_NOTHING = {
    Subject.FILES: 'Every file is there and can be read.',
    Subject.METADATA: 'metadata.yaml says what the files say, or the bag needs none.',
    Subject.INDEX: 'Files were closed by their writer, and their index agrees with them.',
    Subject.CHUNKS: 'Every chunk or page is whole, and every message is where it should be.',
    Subject.TOPICS: 'Every topic has a name, a type and a serialisation that can be used.',
    Subject.QOS: 'QoS profiles can be read, and metadata.yaml and files agree on them.',
}
