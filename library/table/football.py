"""The rules of the table: goals and own goals, kick-off, dead ball, ball off the table, and when a match ends.

They edit frame k before it is solved, in every node alike, with all their memory in the frame. Ties of time are ticks.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Final

from foosim.common.keyed_random import draw_key, draw_words, unit_interval
from foosim.library.table.ball import Ball
from foosim.library.table.rod import RodRobot, line_x_m
from foosim.library.table.settings import TEAMS, places_between_lines, rod_reach, table_of
from foosim.world.component_types.descriptions import ENTITY, NO_ENTITY
from foosim.world.component_types.registry import rule
from foosim.world.component_types.settings import RuleSettings
from foosim.world.components.base import Rule, slot
from foosim.world.components.entities import Marked, MarkKind, RuleMounting, mounting_of
from foosim.world.components.view import View, WritableView
from foosim.world.layout import WORLD, Entity
from foosim.world.scene import ORIGIN, Vector
from foosim.world.spec import WorldSpec

if TYPE_CHECKING:
    from foosim.world.frame import Frame

OF_BALL: Final = {"still_ticks": 1, "out_ticks": 1, "wait_ticks": 1, "spot": 2, "serve": 1, "touched_by": ENTITY}
"""Ticks that a ball has been at rest or off the table, and that it still has to wait for its kick-off; where that is
(x, y) and towards which end (-1, 1, or 0 for a draw); and the rod that touched it last since then."""
LAST_SUBSTEP: Final = 2
"""Where a contact log has the last substep with a contact, -1 for none."""
GOAL, OWN_GOAL, KICKOFF, OUT, DEAD, END = "goal", "own_goal", "kickoff", "out", "dead", "end"


class FootballSettings(RuleSettings):
    """Counts goals and kicks off; the numbers are the table's `rules`."""


def kickoff_ticks(spec: WorldSpec) -> int:
    """Return how many ticks a ball rests at the kick-off spot."""
    return max(1, table_of(spec).rules.kickoff_delay_ns // spec.tick_ns)


@rule("football", FootballSettings, each={"ball": OF_BALL}, writes=("ball",), kit="table")
class Football(Rule):
    """Goal and own goal, kick-off, dead ball, ball off the table, clock and end of a match."""

    mark_kinds: ClassVar = {
        GOAL: MarkKind("score", "goals", is_cut=True),
        OWN_GOAL: MarkKind("score", "own goals", is_cut=True),
        KICKOFF: MarkKind("start", "kick-offs", is_cut=True),
        OUT: MarkKind("away", "out", is_cut=True),
        DEAD: MarkKind("rest", "lay still", is_cut=True),
        END: MarkKind("rest", "ends of matches", is_cut=True),
    }
    score, own_goals = slot(2), slot(2)
    """Goals of red and blue, and own goals of their figures."""
    kickoffs, played_ticks, is_over, end_tick = slot(), slot(), slot(), slot()
    """Kick-offs; ticks with a ball in play; whether the match is over, and since which tick."""

    def __init__(self, settings: FootballSettings, at: RuleMounting) -> None:
        spec = at.spec
        self._name = at.name
        table, tick_ns = table_of(spec), spec.tick_ns
        rules, match = table.rules, table.rules.match
        self._goal_x_m = table.field.length / 2 + table.ball.radius
        self._goal_y_m = table.goal.width / 2
        self._goal_z_m = table.goal.height
        self._end_x_m = table.field.length / 2 + table.walls.thickness + table.goal.depth
        self._side_y_m = table.field.width / 2
        self._kickoff_speed = rules.kickoff_speed
        self._is_conceders = rules.kickoff == "conceded"
        self._dead_speed = rules.dead_ball_speed
        self._dead_ticks = max(1, rules.dead_ball_after_ns // tick_ns)
        self._between_lines = places_between_lines(table) if rules.dead_ball == "lines" else ()
        self._out_ticks = max(1, rules.off_table_after_ns // tick_ns)
        self._wait_ticks = kickoff_ticks(spec)
        self._match_ticks = None if match is None or match.duration_ns is None else -(-match.duration_ns // tick_ns)
        self._match_goals = None if match is None else match.goals
        self._tick_s = tick_ns / 1e9
        self._radius = table.ball.radius
        self._key = draw_key(spec.seed, "kickoff")
        self._balls = [_Ball(at, entity) for entity in at.layout.of("ball")]
        self._touches = _Touches(at)

    def place(self, view: WritableView) -> None:
        """Let all balls wait for their kick-off."""
        for ball in self._balls:
            view.write(ball.wait, float(self._wait_ticks))

    def apply(self, view: WritableView) -> None:
        """Apply every rule to every ball, and count the time of play, until the match is over."""
        numbers = view.numbers
        if numbers[self.is_over.at] != 0.0:
            return
        is_played = False
        for ball in self._balls:
            if ball.entity.is_absent(numbers):
                continue
            is_played = is_played or numbers[ball.wait.at] == 0.0
            self._apply_to(ball, view)
        if is_played:
            view.write(self.played_ticks, numbers[self.played_ticks.at] + 1.0)
        if self._is_decided(view):
            self._end(view)

    def _apply_to(self, ball: _Ball, view: WritableView) -> None:
        numbers = view.numbers
        waits = numbers[ball.wait.at]
        if waits > 0.0:
            view.write(ball.wait, waits - 1.0)
            if waits == 1.0:
                self._kick_off(ball, view)
            return
        start = ball.position
        x, y, z = numbers[start : start + 3]
        if numbers[ball.touch] >= 0.0:
            self._touches.note(ball, x, view)
        if self._goal_x_m < abs(x) <= self._end_x_m and abs(y) < self._goal_y_m and 0.0 < z < self._goal_z_m:
            self._count_goal(ball, 0 if x > 0.0 else 1, view)
            return
        self._count_out(ball, view, x, y, z)
        self._count_still(ball, view, x, y)

    def _count_goal(self, ball: _Ball, team: int, view: WritableView) -> None:
        """A goal counts for the team that attacks it; after a last touch by the other team it is that team's own
        goal."""
        other = 1 - team
        view.write(self.score, *_one_more(view.read(self.score), team))
        if self._touches.team_of(view.numbers[ball.touched_by.at]) == other:
            view.write(self.own_goals, *_one_more(view.read(self.own_goals), other))
        self._to(ball, view, serve=(1.0 if team == 0 else -1.0) if self._is_conceders else 0.0)

    def _count_out(self, ball: _Ball, view: WritableView, x: float, y: float, z: float) -> None:
        """A ball beyond the walls or below the floor for long enough returns to the spot; so does one in quarantine."""
        numbers = view.numbers
        inside = abs(x) <= self._end_x_m and abs(y) <= self._side_y_m and z > 0.0
        out = 0.0 if inside and numbers[ball.quarantined] <= 0.0 else numbers[ball.out.at] + 1.0
        if out != numbers[ball.out.at]:
            view.write(ball.out, out)
            if out >= self._out_ticks:
                self._to(ball, view)

    def _count_still(self, ball: _Ball, view: WritableView, x: float, y: float) -> None:
        """A ball at rest for long enough is dead and comes back."""
        numbers, start = view.numbers, ball.velocity
        vx, vy, vz = numbers[start : start + 3]
        slow = vx * vx + vy * vy + vz * vz < self._dead_speed * self._dead_speed
        still = numbers[ball.still.at] + 1.0 if slow else 0.0
        if still != numbers[ball.still.at]:
            view.write(ball.still, still)
            if still >= self._dead_ticks:
                place = self._place_near(x, y)
                self._to(ball, view, place, serve=(place[0] < 0.0) - float(place[0] > 0.0))

    def _place_near(self, x: float, y: float) -> tuple[float, float]:
        """Return where a ball comes back that lay dead: at the spot, or at its y midway between the nearest lines."""
        if not self._between_lines:
            return 0.0, 0.0
        middle, y_max = min(self._between_lines, key=lambda place: (abs(place[0] - x), place[0]))
        return middle, min(max(y, -y_max), y_max)

    def _to(self, ball: _Ball, view: WritableView, place: tuple[float, float] = (0.0, 0.0), serve: float = 0.0) -> None:
        """Lay a ball down to wait for its kick-off, from a place (x, y) and towards an end of the field."""
        ball.place(view, (*place, self._radius))
        view.write(ball.wait, float(self._wait_ticks))
        view.write(ball.spot, *place)
        view.write(ball.serve, serve)

    def _kick_off(self, ball: _Ball, view: WritableView) -> None:
        """Roll the ball from where it waits; an unset direction is drawn by the kick-off's number."""
        (kickoffs,) = view.read(self.kickoffs)
        words = draw_words(self._key, int(kickoffs))
        view.write(self.kickoffs, kickoffs + 1.0)
        (serve,), (x, y) = view.read(ball.serve), view.read(ball.spot)
        along = serve or (1.0 if words[0] & 1 else -1.0)
        across = 2.0 * unit_interval(words[1]) - 1.0
        ball.place(view, (x, y, self._radius), (along * self._kickoff_speed, across * self._kickoff_speed, 0.0))

    def _is_decided(self, view: WritableView) -> bool:
        """Whether the time is over, or a team has as many goals as end the match."""
        ticks, goals = self._match_ticks, self._match_goals
        return (ticks is not None and view.numbers[self.played_ticks.at] >= ticks) or (
            goals is not None and max(view.read(self.score)) >= goals
        )

    def _end(self, view: WritableView) -> None:
        """Lay the balls on the middle line, at rest, where no figure reaches them."""
        view.write(self.is_over, 1.0)
        view.write(self.end_tick, float(view.tick))
        for number, ball in enumerate([ball for ball in self._balls if not ball.entity.is_absent(view.numbers)]):
            aside = 2.0 * self._radius * (number + number % 2) * (-1.0) ** number
            ball.place(view, (0.0, aside, self._radius))

    def status(self, view: View) -> dict[str, Any]:
        """Return goals and own goals of both teams, the time of play (s), whether it is over, and who has won (None: a
        draw, or not yet known)."""
        score, own_goals = (
            dict(zip(TEAMS, map(int, view.read(slot)), strict=True)) for slot in (self.score, self.own_goals)
        )
        (played,), (is_over,) = view.read(self.played_ticks), view.read(self.is_over)
        first, second = score.values()
        winner = None if not is_over or first == second else TEAMS[0 if first > second else 1]
        return {
            "score": score,
            "own_goals": own_goals,
            "clock_s": round(played * self._tick_s, 9),
            "is_over": bool(is_over),
            "winner": winner,
        }

    @staticmethod
    def text(status: dict[str, Any]) -> str:
        """Return `red 1 : 0 blue`, at the end with who has won."""
        (red, ours), (blue, theirs) = status["score"].items()
        end = "" if not status["is_over"] else f", {status['winner']} has won" if status["winner"] else ", a draw"
        return f"{red} {ours} : {theirs} {blue}{end}"

    # --- events ------------------------------------------------------------------------------------------------------

    def marks(self, before: Frame, after: Frame) -> Iterator[Marked]:
        """Yield goals, kick-offs and why balls came back, to the tick, by the counted ticks."""
        wait = f"{self._name}.wait_ticks"
        returned: list[tuple[int, str]] = []
        kickoffs = 0
        for ball in after.layout.of("ball"):
            if ball.is_absent(before.numbers) or ball.is_absent(after.numbers):
                continue
            waits, waited = int(after.at(ball.name, wait)), int(before.at(ball.name, wait))
            if waits > waited or (waits and not waited):
                returned.append((after.tick - (self._wait_ticks - waits), ball.name))
            if waited and before.tick + waited <= after.tick:
                kickoffs += 1
                yield before.tick + waited, KICKOFF, f"kick-off of {ball.name}"
        since = int(after.at(WORLD, f"{self._name}.end_tick"))
        is_end = bool(after.at(WORLD, f"{self._name}.is_over") > before.at(WORLD, f"{self._name}.is_over"))
        goals = self._goals(before, after, [*(tick for tick, _ in returned), *([since] if is_end else [])])
        yield from goals
        scored = {tick for tick, _, _ in goals}
        for tick, name in returned:
            if tick not in scored:
                yield self._back(before, tick, name)
        if is_end:
            score = map(int, after.vector(WORLD, f"{self._name}.score", 2))
            yield since, END, f"end of the match, {' : '.join(map(str, score))}"
        counted = f"{self._name}.kickoffs"
        for _ in range(kickoffs, int(after.at(WORLD, counted) - before.at(WORLD, counted))):
            yield after.tick, KICKOFF, "kick-off"

    def _goals(self, before: Frame, after: Frame, returned: Sequence[int]) -> list[Marked]:
        """Return the goals between two frames, each at the tick at which a ball came back, where that is known.

        Of several goals of a team, those are own goals that came first.
        """
        ticks, goals = sorted(returned), []
        (was, score), (owned, own) = (
            [list(map(int, frame.vector(WORLD, f"{self._name}.{slot}", 2))) for frame in (before, after)]
            for slot in ("score", "own_goals")
        )
        for team, name in enumerate(TEAMS):
            other = 1 - team
            while was[team] < score[team]:
                was[team] += 1
                tick = ticks.pop(0) if ticks else after.tick
                is_own = owned[other] < own[other]
                owned[other] += is_own
                kind, text = (OWN_GOAL, f"own goal of {TEAMS[other]}") if is_own else (GOAL, f"goal of {name}")
                goals.append((tick, kind, f"{text}, {was[0]} : {was[1]}"))
        return goals

    def _back(self, before: Frame, tick: int, ball: str) -> Marked:
        """Return why a ball came back to the spot without a goal."""
        if before.at(ball, f"{self._name}.still_ticks") > before.at(ball, f"{self._name}.out_ticks"):
            return tick, DEAD, f"{ball} lay still"
        return tick, OUT, f"{ball} left the table"


class _Ball:
    """The places of a ball's numbers, and of the rules' memory of it."""

    def __init__(self, at: RuleMounting, entity: Entity) -> None:
        self.entity = entity
        self.still, self.out, self.wait, self.spot, self.serve, self.touched_by = (
            at.of(entity, field) for field in OF_BALL
        )
        self.position, self.velocity = entity.offsets["position"], entity.offsets["linear_velocity"]
        self.quarantined = entity.offsets["quarantined"]
        self.touch = entity.offsets["contacts"] + LAST_SUBSTEP
        self._model = Ball(None, mounting_of(at.spec, at.layout, entity))

    def place(self, view: WritableView, position: Vector, velocity: Vector = ORIGIN) -> None:
        """Set it to a place (m) with a velocity (m/s), and reset its counts and its last touch."""
        self._model.place_at(view, position, velocity)
        for count in (self.still, self.out, self.wait):
            view.write(count, 0.0)
        view.write(self.touched_by, NO_ENTITY)


class _Touches:
    """Which rod has touched a ball, by the contact logs of the last tick.

    A rod touches nothing but balls. So where a ball has a contact and one rod has, too, they are each other's, and the
    ball is within the rod's reach. Of several such rods it is the one that was in contact last, to the substep; of
    these the nearest one to the ball along the field, and the first by name. With several balls a rod within reach
    that touched another ball, in the very tick in which this one touched a wall, counts as well.
    """

    def __init__(self, at: RuleMounting) -> None:
        spec = at.spec
        table = table_of(spec)
        self._rods: list[tuple[int, float, float]] = []
        self._teams: dict[float, int] = {}
        for entity in at.layout.of("rod"):
            settings = spec.settings_of(entity.name)
            assert isinstance(settings, RodRobot), entity.name
            index = float(entity.index)
            self._rods.append((entity.offsets["contacts"] + LAST_SUBSTEP, line_x_m(spec, settings), index))
            self._teams[index] = TEAMS.index(settings.team)
        a_tick = table.ball.speed_limit * spec.tick_ns / 1e9
        self._reach_m = rod_reach(table.rod) + table.ball.radius + a_tick

    def note(self, ball: _Ball, x: float, view: WritableView) -> None:
        """Note the rod, if any, that touched a ball which had a contact in the last tick and is at x (m) now."""
        numbers = view.numbers
        touched = [
            (-numbers[log], abs(x - axis), index)
            for log, axis, index in self._rods
            if numbers[log] >= 0.0 and abs(x - axis) <= self._reach_m
        ]
        if touched:
            view.write(ball.touched_by, min(touched)[2])

    def team_of(self, rod: float) -> int | None:
        """Return the team, by its number, of a rod; None of no rod."""
        return self._teams.get(rod)


def _one_more(counts: Sequence[float], place: int) -> tuple[float, float]:
    """Return two counts, one of them one higher."""
    first, second = counts
    return first + (place == 0), second + (place == 1)
