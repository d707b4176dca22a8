"""Episodes kept as they are made, a line of JSON each, so that a stopped run goes on.

A journal is of one model and one state of the software: whatever could change how an episode ends
is part of its name.
"""

from __future__ import annotations

from collections.abc import Iterable
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from typing import Any

import likeme_arm
import likeme_arm_sim
import likeme_core
import likeme_experiments
import likeme_inference
import likeme_perception
from likeme_core.tabletop import Manner, Mode, State
from likeme_experiments import json_lines
from likeme_experiments.evaluation.episode import Act, Ending, Episode
from likeme_experiments.evaluation.forecast import BUDGET, THRESHOLD, Case
from likeme_experiments.imitation.episodes import Task

#: What decides how an episode ends: folders of each package.
_DECIDES = (
    (likeme_core, ''),
    (likeme_arm, ''),
    (likeme_arm_sim, ''),
    (likeme_perception, ''),
    (likeme_inference, 'tabletop'),
    (likeme_experiments, 'imitation'),
    (likeme_experiments, 'learning'),
)


class Journal:
    """The episodes of one model, in a file that grows by whole lines."""

    def __init__(self, folder: Path, model_text: str) -> None:
        """Open it, in `folder`, or begin it.

        Raises:
            OSError: it cannot be read or made.
        """
        folder.mkdir(parents=True, exist_ok=True)
        self.path = folder / f'{fingerprint(model_text)}.jsonl'
        self.episodes = dict(_read(self.path))

    def add(self, episode: Episode) -> None:
        """Keep one more.

        Raises:
            OSError: it cannot be written.
        """
        self.episodes[Task(episode.case, episode.seed)] = episode
        json_lines.append(self.path, document_of(episode))


def fingerprint(model_text: str) -> str:
    """A name that changes with the model and with the code that makes episodes."""
    digest = sha256(f'{BUDGET} {THRESHOLD} {model_text}'.encode())
    for package, folder in _DECIDES:
        root = files(package) / folder
        for path in sorted(Path(str(root)).rglob('*.py')):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:16]


def document_of(episode: Episode) -> dict[str, Any]:
    """JSON-ready."""
    return {
        'case': list(episode.case),
        'seed': episode.seed,
        'acts': [list(act) for act in episode.acts],
        'endings': {
            estimate: {mode.value: list(ending) for mode, ending in endings.items()}
            for estimate, endings in episode.endings.items()
        },
    }


def episode_of(document: dict[str, Any]) -> Episode:
    """The episode of a document.

    Raises:
        ValueError, KeyError, TypeError: it is none.
    """
    name, x_i, x_f, manner = document['case']
    endings = {
        estimate: {
            Mode(mode): Ending(tuple(actions), tuple(states), asked, helped)
            for mode, (actions, states, asked, helped) in modes.items()
        }
        for estimate, modes in document['endings'].items()
    }
    acts = tuple(Act(*act) for act in document['acts'])
    case = Case(name, State(x_i), State(x_f), Manner(manner))
    return Episode(case, document['seed'], acts, endings)


def _read(path: Path) -> Iterable[tuple[Task, Episode]]:
    for document in json_lines.documents(path):
        try:
            episode = episode_of(document)
        except (ValueError, KeyError, TypeError):
            # Not one of this software's: its episode is made again.
            continue
        yield Task(episode.case, episode.seed), episode
