"""A log of episodes, one JSON document a line, so that a stopped run can go on.

A log is valid for one model and one version of code and data: its file name is their digest.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from hashlib import sha256
from importlib.metadata import version
from importlib.resources import files
from pathlib import Path
from typing import Any

from likeme_core.tabletop import Manner, Mode
from likeme_core.world import World
from likeme_experiments import json_lines
from likeme_experiments.evaluation.episode import (
    ImitationEpisode,
    ImitationResult,
    PerceivedDemonstration,
)
from likeme_experiments.evaluation.forecast import BUDGET, THRESHOLD, DemonstrationCase
from likeme_experiments.imitation.episodes import EpisodeTask
from likeme_experiments.learning.robot_identity import simulated_robot

#: Packages, and folders of packages, whose files decide how an episode ends.
SOURCES = (
    'likeme_core',
    'likeme_arm',
    'likeme_arm_sim',
    'likeme_perception',
    'likeme_inference.tabletop',
    'likeme_inference.data',
    'likeme_experiments.evaluation',
    'likeme_experiments.imitation',
    'likeme_experiments.learning',
)
#: Libraries whose version may change the physics, the images or the arithmetic.
LIBRARIES = 'pybullet', 'numpy', 'opencv-python-headless'


class EpisodeLog:
    """The episodes of one model, in a file to which whole lines are appended."""

    def __init__(
        self, folder: Path, model_text: str, world: World, together: bool = False
    ) -> None:
        """Open the model's log in `folder`, or create it; `together`: see make_episode.

        Raises:
            OSError: it cannot be read or made.
        """
        folder.mkdir(parents=True, exist_ok=True)
        suffix = '-together' if together else ''
        self.path = folder / f'{fingerprint(model_text, world)}{suffix}.jsonl'
        self.episodes = dict(_read(self.path, world))

    def add(self, episode: ImitationEpisode) -> None:
        """Append one.

        Raises:
            OSError: it cannot be written.
        """
        self.episodes[EpisodeTask(episode.case, episode.seed)] = episode
        json_lines.append(self.path, document_of(episode))


def fingerprint(model_text: str, world: World) -> str:
    """A digest of the model and of all code and data that make episodes, 16 hex digits."""
    libraries = ' '.join(version(name) for name in LIBRARIES)
    robot = simulated_robot(world)
    digest = sha256(f'{BUDGET} {THRESHOLD} {libraries} {robot} {model_text}'.encode())
    for source in SOURCES:
        package, _, folder = source.partition('.')
        digest.update(folder_digest(Path(str(files(package))) / folder))
    return digest.hexdigest()[:16]


def folder_digest(folder: Path) -> bytes:
    """A digest of the names and contents of all files but those that only ROS nodes use."""
    digest = sha256()
    for path in _files(folder):
        digest.update(f'{path.relative_to(folder)}\0'.encode())
        digest.update(sha256(path.read_bytes()).digest())
    return digest.digest()


def _files(folder: Path) -> Iterator[Path]:
    for path in sorted(folder.rglob('*')):
        parts = path.relative_to(folder).parts
        ros = 'ros' in parts or path.stem.endswith('_node')
        if path.is_file() and not ros and '__pycache__' not in parts:
            yield path


def document_of(episode: ImitationEpisode) -> dict[str, Any]:
    """JSON-ready."""
    return {
        'case': list(episode.case),
        'seed': episode.seed,
        'acts': [list(each) for each in episode.perceived],
        'endings': {
            estimate: {mode.value: list(result) for mode, result in results.items()}
            for estimate, results in episode.results.items()
        },
    }


def episode_of(document: dict[str, Any], world: World) -> ImitationEpisode:
    """The episode of a document.

    Raises:
        ValueError, KeyError, TypeError: the document is not an episode.
    """
    name, x_i, x_f, manner = document['case']
    results = {
        estimate: {
            Mode(mode): ImitationResult(tuple(actions), tuple(states), asked, helped, refused)
            for mode, (actions, states, asked, helped, refused) in modes.items()
        }
        for estimate, modes in document['endings'].items()
    }
    perceived = tuple(PerceivedDemonstration(*each) for each in document['acts'])
    case = DemonstrationCase(name, world.state(x_i), world.state(x_f), Manner(manner))
    return ImitationEpisode(case, document['seed'], perceived, results)


def _read(path: Path, world: World) -> Iterable[tuple[EpisodeTask, ImitationEpisode]]:
    for document in json_lines.documents(path):
        try:
            episode = episode_of(document, world)
        except (ValueError, KeyError, TypeError):
            # Of another format: the episode is made again.
            continue
        yield EpisodeTask(episode.case, episode.seed), episode
