"""Pages over the desk: help, history, health, why."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar

from rich.text import Text
from textual.app import ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import VerticalScroll
from textual.screen import ModalScreen
from textual.widgets import Static

from likeme_operator.desk_view import DeskView, MadeDecision
from likeme_operator.panels import rule_line
from likeme_operator.text_bars import evidence_bar

#: s between two updates.
PERIOD = 0.5
HELP = [
    'SPACE      hold: stop every motion at once, from any page',
    'r Enter    resume: read what moves, then Enter',
    'd t s      choose an answer: done by hand, try, skip; Enter gives it',
    'g 1 ... 9  answer with the goal that is meant; Enter gives it',
    '1 ... 9    choose the question',
    ', .        what if the threshold were lower, higher',
    'm          what if the mode were another one',
    'Up Down    look at an earlier, a later decision; Esc: the newest',
    'w          why: all numbers of the decision that is looked at',
    'j          what is wanted of the whole table',
    'h          history',
    'n          health of the nodes, and all alarms',
    'l          what this desk told',
    'Esc        close a page, or go back to the newest decision',
    'q Ctrl-C   quit; the cell goes on',
    '',
    'Bars: █ predicted success, ▒ the rest of its 95 % interval, | the threshold.',
    'trials 4/10: four of ten tries of this action from this state ended at the goal.',
    '(pear): not seen in this frame; it was there when it last was.',
    'A question stays open until somebody answers; while it is, nothing moves.',
    'What was typed before a question was on the screen is not its answer.',
]


class Page(ModalScreen[None]):
    """Lines to read; the arrow keys scroll, Esc closes."""

    CSS = (
        'Page { background: black; } VerticalScroll { height: 1fr; } Page > Static { height: 1; }'
    )
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding('escape', 'dismiss', 'close'),
        Binding('enter', 'dismiss', 'close', show=False),
    ]

    def __init__(self, title: str, lines: Callable[[], Sequence[str]]) -> None:
        """lines: made anew while the page is open."""
        super().__init__()
        self._title, self._lines = title, lines

    def compose(self) -> ComposeResult:
        """The title, the lines and the keys."""
        yield Static(Text(f'── {self._title} ', style='bold'))
        with VerticalScroll():
            yield Static(id='lines', markup=False)
        yield Static(Text('Esc closes   ↑↓ scroll   SPACE HOLD NOW', style='dim'))

    def on_mount(self) -> None:
        """Begin to update."""
        self.set_interval(PERIOD, self._update)
        self._update()

    def _update(self) -> None:
        self.query_one('#lines', Static).update(Text('\n'.join(self._lines())))


def health_lines(view: DeskView) -> list[str]:
    """All alarms, and the state of each node."""
    alarms = [f'! ALARM {problem}' for problem in view.problems] or ['no alarm']
    motion = 'Motion is allowed.' if view.motion.allowed else f'Motion: {view.motion.why}.'
    nodes = [
        f'{name:18} {node.state:10} {node.version:8} restarts {node.restarts}  {node.message}'
        for name, node in view.nodes
    ]
    others = ', '.join(view.operators) or 'nobody'
    return [
        *alarms,
        '',
        motion,
        f'Other operators here: {others}.',
        f'World: {view.world}',
        '',
        *nodes,
    ]


def why_page(decision: MadeDecision) -> list[str]:
    """All numbers of a decision."""
    lines = [decision.sentence, '', rule_line(decision), '', 'Goal, given what was shown:']
    lines += [f'  {name:16} {p:.3f}' for name, p in decision.goals]
    lines += ['', f'Actions from {decision.x_i} to {decision.goal}:']
    lines += [
        f'  {row.action:16} {row.success:.3f}  '
        f'{evidence_bar(row.success, row.low, row.high, 20)}  '
        f'{row.successes}/{row.trials} trials, 95 % {row.low:.2f} to {row.high:.2f}'
        for row in decision.evidence
    ] or [f'  {name:16} {p:.3f}  trials not known' for name, p in decision.success]
    if decision.predicted:
        lines += ['', f'After {decision.action} the {decision.object} is:']
        lines += [f'  {name:16} {p:.3f}' for name, p in decision.predicted]
    lines += ['', f'The whole story: ./scripts/operator.sh why {decision.id}']
    return lines
