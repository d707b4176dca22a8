"""The parts of the desk's screen as lines of text, each of a given width and height."""

from __future__ import annotations

import math
from collections.abc import Sequence

from likeme_core.world import World
from likeme_core.world.values import UNKNOWN
from likeme_inference.tabletop.values import Reply
from likeme_operator.desk_view import (
    DeskView,
    MadeDecision,
    OpenQuestion,
    SeenObject,
    ShownAttempt,
    TableBelief,
)
from likeme_operator.table_plan import table_plan
from likeme_operator.text_bars import ago, bar, evidence_bar, short
from likeme_operator.what_if import Alternative

#: Words of the modes' decisions.
CHOSE = {
    'EXECUTE': 'ACTS',
    'ASK_HUMAN': 'ASKS',
    'AT_GOAL': 'AT THE GOAL',
    'NO_ACTION': 'CAN DO NOTHING',
}
KEYS = 'SPACE HOLD NOW  r resume  ,.m what if  ↑↓ past  w why  h history  ? help  q quit'


def header_line(view: DeskView, clock: str, width: int) -> str:
    """Whether motion is allowed, and what the cell does."""
    motion = 'MOTION ALLOWED' if view.motion.allowed else view.motion.why.upper()
    if not view.reached:
        motion = 'NO CELL'
    camera = f'camera {view.camera_rate:.0f} Hz' if view.table else 'no camera'
    mode = view.decision.mode if view.decision else ''
    moving = f'MOVING {view.moving}' if view.moving else 'arm idle'
    left = f'LikeMe  domain {view.domain}  {motion}  {moving}  {camera}  {mode}'
    return _ends(left, clock, width)


def alarm_line(view: DeskView, chosen: OpenQuestion | None, width: int) -> str:
    """What is wrong, and what is open."""
    others = f'also here: {", ".join(view.operators)}' if view.operators else ''
    if view.problems:
        more = f' (+{len(view.problems) - 1}: n)' if len(view.problems) > 1 else ''
        return _ends(f'! ALARM {view.problems[0]}{more}', others, width)
    asked = '  '.join(
        f'{">" if question == chosen else " "}[{number}] {question.key.object} {ago(question.age)}'
        for number, question in enumerate(view.questions, 1)
    )
    return _ends(f'no alarm   open: {asked or "no question"}', others, width)


def table_lines(view: DeskView, world: World | None, width: int, height: int) -> list[str]:
    """The plan, a line for each object, and the age of the frame."""
    if view.table is None:
        return ['No table state was heard yet.']
    objects, table = view.table.objects, view.table
    asked = view.decision.object if view.decision else ''
    seen = f'{"hand" if table.hand else "no hand"}, {"arm" if table.arm else "no arm"}'
    told = [_object_line(item) for item in objects][: max(1, height - 4)]
    foot = f'frame {table.age:.1f} s old, {seen}'
    rows = height - len(told) - 1
    if world is None:
        plan = ['No file of this world here: no plan (--world FILE).'][:rows]
    else:
        plan = table_plan(world, objects, width, rows, asked)
    return [line[:width] for line in (*plan, *told, table.reason or foot)]


def _object_line(item: SeenObject) -> str:
    if item.state == UNKNOWN:
        return f'{item.name:7} UNKNOWN'
    place = '' if math.isnan(item.x) else f'x{item.x:5.2f} y{item.y:5.2f}'
    return f'{item.name:7} {item.state:8}{short(item.probability)} {place}'


def why_lines(view: DeskView, width: int, height: int) -> list[str]:
    """What was shown, what is wanted, what each action is worth, and the rule that decided."""
    decision = view.decision
    shown = _shown_line(view)
    if decision is None:
        return [
            shown,
            'No decision yet. To get one, show an act:',
            './scripts/show.sh pear right left',
        ][:height]
    head = f'#{decision.id} {decision.object}: {decision.x_i} now, wanted {decision.goal}'
    goals = [
        f'{"goal" if n == 0 else "":5}{name:9}{bar(p, max(4, width - 20))}{short(p)}'
        for n, (name, p) in enumerate(decision.goals)
    ]
    rule = rule_line(decision)
    room = height - len(goals) - 4
    actions = action_lines(decision, width)[: max(1, room)]
    lines = [head, shown, *goals, _action_head(width), *actions, rule]
    return [line[:width] for line in lines]


def belief_lines(
    belief: TableBelief, attempt: ShownAttempt | None, width: int, height: int
) -> list[str]:
    """What the person who acts does and wants, so far, of the whole table."""
    head = [f'the person acts ({belief.acts} so far)']
    if attempt is not None:
        head.append(_attempt_line(attempt))
    head.append('wanted:')
    foot = ['none of these, by what was done'] if belief.none_of_these else []
    size = max(4, width // 4)
    room = width - size - 6
    named = [
        (words if len(words) <= room else f'{words[: room - 1]}…', p) for words, p in belief.goals
    ]
    goals = [f'{words:{room}} {bar(p, size)}{short(p)}' for words, p in named]
    return [line[:width] for line in (*head, *goals[: height - len(head) - len(foot)], *foot)]


def _attempt_line(attempt: ShownAttempt) -> str:
    how = f' {attempt.manner}{short(attempt.manner_probability)}' if attempt.manner else ''
    if not attempt.x_f:
        return f'now: {attempt.object} {attempt.x_i}>{attempt.towards}?{how}'
    tried = ''
    if attempt.towards not in ('', attempt.x_f):
        tried = f' (tried {attempt.towards})'
    return f'{attempt.object} {attempt.x_i}>{attempt.x_f}{tried}{how}'


def belief_page(belief: TableBelief | None) -> list[str]:
    """All of the newest joint belief."""
    if belief is None:
        return ['Nobody has moved anything yet.']
    lines = [belief.sentence, '', f'What must change, after {belief.acts} events:']
    lines += [f'  {p:.3f}  {words}' for words, p in belief.goals]
    if belief.none_of_these:
        lines += ['', 'What was done is too unlikely for any of these: none of them, it seems.']
    lines += ['', 'Of each object:']
    for name, regions in belief.wanted:
        lines.append(f'  {name:10} ' + '  '.join(f'{region} {p:.2f}' for region, p in regions))
    return lines


def _shown_line(view: DeskView) -> str:
    if view.shown is None:
        return 'No demonstration was seen yet.'
    act = view.shown
    sure = short(act.manner_probability).strip()
    return f'shown {act.object} {act.x_i}>{act.x_f} {act.manner} {sure}, {ago(act.age)} ago'


def _action_head(width: int) -> str:
    return f'{"action":15}works{" " * max(1, width - 37)}trials   95 %'


def action_lines(decision: MadeDecision, width: int) -> list[str]:
    """A line for each action, the best first."""
    if not decision.evidence:
        ordered = sorted(decision.success, key=lambda each: -each[1])
        return [f'{_mark(name, decision)}{name:14}{short(p)}' for name, p in ordered]
    size = max(3, width - 36)
    threshold = decision.threshold if decision.mode == 'interactive' else None
    rows = sorted(decision.evidence, key=lambda row: (row.action != decision.action, -row.success))
    return [
        f'{_mark(row.action, decision)}{row.action:14}{short(row.success)} '
        f'{evidence_bar(row.success, row.low, row.high, size, threshold)}'
        f'{row.successes:>3}/{row.trials:<3}{short(row.low)}-{short(row.high).strip()}'
        for row in rows
    ]


def _mark(action: str, decision: MadeDecision) -> str:
    return '>' if action == decision.action else ' '


def rule_line(decision: MadeDecision) -> str:
    """Why it acts or asks, in one line."""
    chose = CHOSE.get(decision.kind, decision.kind)
    if decision.kind not in ('EXECUTE', 'ASK_HUMAN'):
        return chose
    sure, threshold = short(decision.sure).strip(), short(decision.threshold).strip()
    if decision.mode not in ('interactive', 'sequential'):
        return f'{decision.mode} never asks: {chose}'
    sign = '<' if decision.sure < decision.threshold else '>='
    many = f' in {decision.actions_left} actions' if decision.mode == 'sequential' else ''
    return f'{sure}{many} {sign} threshold {threshold}: {chose}'


def what_if_lines(
    supposed: Alternative | None, modes: Sequence[Alternative], width: int
) -> list[str]:
    """What another threshold and the other modes would decide."""
    if supposed is None:
        return ['No record of this decision is known here: whatif cannot tell.', '']
    rule = f'{supposed.mode.name.lower()}, threshold < {supposed.threshold:.2f} >'
    action = (
        ''
        if supposed.decision is None or supposed.decision.action is None
        else (f', {supposed.decision.action.name}, p {supposed.sure:.2f}')
    )
    others = '  '.join(
        f'{each.mode.name.lower()} {each.verb} {short(each.sure).strip()}'
        for each in modes
        if each.mode != supposed.mode
    )
    return [f'{rule}: {supposed.verb.upper()}{action}'[:width], others[:width]]


def history_lines(
    view: DeskView, chosen: int | None, width: int, height: int, skip: int = 0
) -> list[str]:
    """The newest decisions, the oldest of them first; skip: leave out so many of the newest."""
    rows = view.history[: len(view.history) - skip] if skip else view.history
    if not rows:
        return ['Nothing was decided yet.']
    return [
        (
            f'{">" if row.id == chosen else " "}{row.time or "earlier":8.8} #{row.id:<3}'
            f'{row.object:8.8} {row.change:14.14} {row.action:14.14}{short(row.p)} '
            f'{row.how:12.12} {row.result}'
        )[:width]
        for row in rows[-height:]
    ]


def option_lines(question: OpenQuestion | None, decision: MadeDecision | None) -> list[str]:
    """The answers that can be given with what each leads to."""
    if question is None:
        return [
            'No open question.',
            'Next: show the robot something (./scripts/show.sh pear right left).',
        ]
    key = question.key
    after = ''
    if decision is not None and decision.id == key.id:
        after = ', '.join(f'{name} {p:.2f}' for name, p in decision.predicted if p > 0)
    name, goal = key.object, question.goal
    follows = {
        Reply.DONE_BY_HAND: f'd  I did it by hand: the robot looks whether the {name} is {goal}',
        Reply.TRY_ANYWAY: f't  TRY: the robot will {key.action} the {name}: {after}',
        Reply.SKIP: 's  skip: nothing moves    g  name the goal that is meant',
    }
    return [line for reply, line in follows.items() if reply in question.options]


def _ends(left: str, right: str, width: int) -> str:
    room = width - len(right) - (1 if right else 0)
    return f'{left[:room]:{room}} {right}' if right else left[:width]
