"""What moves when motion is allowed again."""

from __future__ import annotations

NOTHING = 'Motion is allowed already: nothing changes.'


def resume_notice(
    held: bool | None,
    hand: bool | None,
    arm: bool | None,
    questions: int | None,
    turn: str = '',
) -> list[str]:
    """The sentences an operator reads before or with a resume.

    Args:
        held: whether motion is held; None: not known.
        hand: whether the person's hand is over the table; None: not known.
        arm: whether the robot's arm is; None: not known.
        questions: open ones; None: not known.
        turn: object whose demonstration the robot may act on; empty: none that is known.
    """
    if held is False:
        return [NOTHING]
    there = [name for name, seen in (('hand', hand), ('arm', arm)) if seen]
    if there:
        leaves = f'The {" and the ".join(there)} over the table moves away from it at once.'
    elif arm is None:
        leaves = 'If hand or arm is over the table, it moves away from it at once.'
    else:
        leaves = 'Hand and arm are off the table: nothing moves at once.'
    sentences = [
        leaves,
        'What was stopped is not continued, and no decision is carried out again.',
    ]
    if questions:
        sentences.append('An answer `try` to the open question moves the arm.')
    elif turn:
        sentences.append(f'When the {turn} is put back, the robot may act on what it was shown.')
    else:
        sentences.append('The next demonstration may lead to a motion.')
    return sentences
