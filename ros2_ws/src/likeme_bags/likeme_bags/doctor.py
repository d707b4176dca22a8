"""`bag.sh doctor`: runs all checks of a bag."""

from __future__ import annotations

from pathlib import Path

from likeme_bags.bag_warnings import Subject
from likeme_bags.camera_checks import CAMERA_CHECKS
from likeme_bags.check_results import CheckResult, fail, ok, warn
from likeme_bags.errors import BagError
from likeme_bags.reading import Bag, open_bag
from likeme_bags.topic_checks import TOPIC_CHECKS
from likeme_bags.topic_statistics import topic_statistics


def examine(path: Path) -> dict[str, CheckResult]:
    """The results of all checks by name; only the first when the bag does not open."""
    try:
        bag = open_bag(path, thorough=True)
    except BagError as error:
        return {'opens': fail(str(error))}
    with bag:
        statistics = topic_statistics(bag)
        opens = f'{bag.count} messages on {len(bag.topics)} topics in {len(bag.files)} file(s).'
        return {
            'opens': ok(opens),
            **{about.value: _of_notes(bag, about) for about in Subject},
            **{
                name: check(bag, statistics)
                for name, check in (TOPIC_CHECKS | CAMERA_CHECKS).items()
            },
        }


def _of_notes(bag: Bag, about: Subject) -> CheckResult:
    """What was noted about one matter while the bag was read."""
    notes = [note for note in bag.all_warnings if note.subject == about]
    if not notes:
        return ok(_NOTHING[about])
    first = next((note for note in notes if note.loss), notes[0])
    more = f' ({len(notes) - 1} more)' if len(notes) > 1 else ''
    return (fail if first.loss else warn)(first.sentence + more)


_NOTHING = {
    Subject.FILES: 'Every file is there and can be read.',
    Subject.METADATA: 'metadata.yaml says what the files say, or the bag needs none.',
    Subject.INDEX: 'Files were closed by their writer, and their index agrees with them.',
    Subject.CHUNKS: 'Every chunk or page is whole, and every message is where it should be.',
    Subject.TOPICS: 'Every topic has a name, a type and a serialisation that can be used.',
    Subject.QOS: 'QoS profiles can be read, and metadata.yaml and files agree on them.',
}
