"""The history that the decision log of this host has of a cell."""

from __future__ import annotations

from contextlib import closing
from datetime import datetime

from likeme_core.state_folder import state_folder
from likeme_inference.experience.decision_log import LOG_FILE, DecisionLog
from likeme_inference.experience.store_error import StoreError
from likeme_operator.history import KEPT, History


def add_logged(history: History, domain: int, namespace: str) -> str:
    """Add the newest decisions of a log to a history; why there are none, or nothing."""
    try:
        place = str(state_folder(domain, namespace) / LOG_FILE)
        with closing(DecisionLog(place, create=False)) as log:
            for entry in log.entries(['decision', 'answer', 'outcome'], 3 * KEPT):
                data = entry.data
                if entry.kind == 'decision':
                    made = data['decision']
                    told = {**made, 'choice': made['kind'], 'p': made['predicted_success']}
                    history.decided(clock(entry.time), told)
                elif entry.kind == 'answer':
                    history.answered(data['request']['id'], data['reply'], data['answered_by'])
                else:
                    history.ended(data['decision_id'], data['result'])
    except (StoreError, OSError, KeyError, TypeError, ValueError) as error:
        return str(error)
    return ''


def clock(nanoseconds: int) -> str:
    """The time of the day; of another day the date."""
    then = datetime.fromtimestamp(nanoseconds / 1e9)
    today = then.date() == datetime.now().date()
    return then.strftime('%H:%M:%S' if today else '%m-%d')
