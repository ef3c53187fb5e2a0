"""One game's tick, in the order of the rules, and the loop over games that Python calls.

`change_team` carries out a capture, and `capture` decides it. A game ends here when a team owns every drone; the time
limit is enforced by `swarm_pz.envs.batch_env`, and by `swarm_pz.play.game` at the table.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from swarm_pz.kernels import entry_point, kernel, loop
from swarm_pz.kernels.arrays import Bools, Float32s, Float64s, Int8s, Int16s, Int64s, Integers, Uint64s
from swarm_pz.kernels.capture import Boards, FieldScratch, find_captured, make_field_scratch
from swarm_pz.kernels.controllers.communication import ergodic_among_heard
from swarm_pz.kernels.controllers.ergodic import ErgodicParameters, Scratch, ergodic, make_scratch, saturate
from swarm_pz.kernels.controllers.plans import plans_of
from swarm_pz.kernels.dynamics import move
from swarm_pz.kernels.fourier import differ
from swarm_pz.kernels.reconstruction import find_captured_by_density, rebuild_field
from swarm_pz.kernels.rng import FAILURE, draw
from swarm_pz.kernels.swarm import Swarm, with_teams
from swarm_pz.kernels.trails import cell_of, extend_trails, forget_trail, hand_over_trail, take_back_newest

ERGODIC = 0
"""Control system of a team: the ergodic controller, in this loop."""
DIRECT = 1
"""Control system whose commands are the accelerations, in this loop, too."""
GIVEN = 2
"""From this number on, a control system outside the kernels chooses the accelerations."""


class Games(NamedTuple):
    """The state of E games; copying these arrays copies the games."""

    ticks: Int64s
    """(E,) ticks since the start."""
    positions: Float32s
    """(E, N, 2) map widths."""
    velocities: Float32s
    """(E, N, 2) map widths per second, over the speed factor."""
    accelerations: Float32s
    """(E, N, 2) map widths per second squared, held between solves."""
    altitudes: Float32s
    """(E, N) only shown; distinct within a game."""
    teams: Int8s
    """(E, N) 0 red, 1 blue."""
    trails: Int16s
    """(E, T, N) grid cells, -1 where there is none."""
    occupancy: Integers
    """(E, 2, G + 4, G + 4) ticks that each team's trails count in each cell, framed as in `capture`."""
    peaks: Int64s
    """(E, 2) the cell where each team's capture field was highest when it was last computed."""
    memory: Float32s
    """(E, K, K, N') the controller's decayed sums of F_k over the past; N' is `room_for(N)`."""
    memory_weight: Float32s
    """(E, N) their weight."""
    plans: Float32s
    """(E, N, H, 2) accelerations that each drone's last solve planned, if solves start warm; else (E, N, 0, 2)."""
    targets: Float64s
    """(E, 2, A, A) each team's command in force, summing to 1."""
    coefficients: Float32s
    """(E, 2, K, K) Fourier coefficients phi_k of the targets, times their mass."""
    capture_ticks: Int64s
    """(E, N) tick of each drone's last capture."""
    captures: Int64s
    """(E, 2) drones that each team has captured since the start."""
    recaptures: Int64s
    """(E, 2) of these, drones that the team had lost within the last second."""
    seeds: Uint64s
    """(E,) of random events during the game; see `swarm_pz.kernels.rng`."""
    failed: Bools
    """(E, N) drones that do not work now."""
    flown_by: Int8s
    """(E, 2) each team's control system: `ERGODIC`, `DIRECT`, or a number from `GIVEN` on."""
    followed: Float64s
    """(E, 2, A, A) each team's target at the last solve, if commands make it forget; else (E, 2, 0, 0)."""
    sent: Bools
    """(E, 2) whether each team was sent a command since its last solve, if that makes it forget."""
    reconstruction: Float32s
    """(E, 2, G, G) each team's capture field, if it is made of densities; else (E, 2, 0, 0)."""
    given: Float32s
    """(E, N, 2) accelerations by systems other than the ergodic controller; (E, 0, 2) if there are none."""
    commands: Float64s
    """(E, 2, S) the commands in force of teams that such systems fly, padded with zeros; else (E, 2, 0)."""
    former: Float64s
    """(E, 2, S) the commands before those."""
    commanded: Int64s
    """(E, 2) the ticks at which the commands in force came."""


class RuleParameters(NamedTuple):
    """Numbers of the rules, ready for the kernels."""

    tick: np.float32
    drift: np.float32
    """Map widths travelled in a tick per unit of velocity."""
    min_speed: np.float32
    """In units of velocity; 0: drones may stop."""
    ticks_per_control_period: int
    ticks_per_second: int
    capture_enabled: bool
    capture_threshold: float
    ring_weights: Integers
    """(G * G,) see `swarm_pz.kernels.capture.Boards`."""


class RuleVariants(NamedTuple):
    """Options that the preset `paper` does not use; None if none is used, and their code is not compiled."""

    reconstructs: bool
    """True: capture fields are made of densities, and not of trails."""
    capture_forgets: tuple[bool, bool]
    """(trail, memory) that a capture empties."""
    command_forgets: tuple[bool, bool]
    """(trail, memory) of the team that a new command empties."""
    sending_forgets: tuple[bool, bool]
    """(trail, memory) of the team that any command empties, even an unchanged one."""
    can_fail: bool
    failure_chance: float
    """Of a working drone in a control period."""
    repair_chance: float
    """Of a failed one."""
    is_local: bool
    """True: some drones may not receive the messages of all team-mates. Failed ones neither send nor receive."""
    radius: float
    """Map widths that a message reaches."""
    is_given: bool
    """True: another system than the ergodic controller flies some team."""
    unit: float
    """Map widths per second squared of a `DIRECT` command of 1."""
    is_ergodic: bool
    """True: the ergodic controller's memories are needed."""


@kernel
def swarm_of(games: Games, e: int, warm_start: bool | None) -> Swarm:
    """Return the drones of game `e`, with plans if solves start warm."""
    return Swarm(
        games.positions[e],
        games.velocities[e],
        games.teams[e],
        games.memory[e],
        games.memory_weight[e],
        games.accelerations[e],
        plans_of(games.plans, e, warm_start),
    )


@loop
def has_loser(teams: Int8s) -> bool:
    """Test that one team owns every drone."""
    blue = 0
    for i in range(teams.shape[0]):
        blue += teams[i]
    return blue == 0 or blue == teams.shape[0]


@loop
def forget(games: Games, e: int, drone: int, what: tuple[bool, bool], boards: Boards) -> None:
    """Empty a drone's trail and the controller's memory of it, as far as asked."""
    if what[0]:
        forget_trail(games.trails[e], drone, games.teams[e, drone], boards)
    if what[1]:
        games.memory[e, :, :, drone] = 0.0
        games.memory_weight[e, drone] = 0.0


@kernel
def take_up_commands(games: Games, e: int, variants: RuleVariants, boards: Boards) -> None:
    """Empty what a team forgets because of its commands since the last solve."""
    on_new, on_any = variants.command_forgets, variants.sending_forgets
    for team in range(2):
        is_new, is_sent = differ(games.targets[e, team], games.followed[e, team]), games.sent[e, team]
        games.followed[e, team] = games.targets[e, team]
        games.sent[e, team] = False
        what = ((is_new and on_new[0]) or (is_sent and on_any[0]), (is_new and on_new[1]) or (is_sent and on_any[1]))
        if what[0] or what[1]:
            for i in range(games.teams.shape[1]):
                if games.teams[e, i] == team:
                    forget(games, e, i, what, boards)


@kernel
def fail_and_repair(games: Games, e: int, variants: RuleVariants, boards: Boards) -> None:
    """Let drones fail and others return to work; failed ones are at rest, with an empty memory and no plan."""
    for i in range(games.teams.shape[1]):
        chance = draw(games.seeds[e], FAILURE, games.ticks[e], i, 0)
        if games.failed[e, i]:
            games.failed[e, i] = chance >= variants.repair_chance
        else:
            games.failed[e, i] = chance < variants.failure_chance
        if games.failed[e, i]:
            games.velocities[e, i] = games.accelerations[e, i] = 0.0
            games.plans[e, i] = 0.0
            forget(games, e, i, (False, True), boards)


@kernel
def at_work(teams: Int8s, failed: Bools) -> Int8s:
    """Return each drone's team, -1 for those that have failed."""
    crew = teams.copy()
    for i in range(teams.shape[0]):
        if failed[i]:
            crew[i] = -1
    return crew


@kernel
def pass_on_commands(games: Games, e: int, unit: float) -> None:
    """Write the accelerations in the command's rows for those drones of `DIRECT` teams that work."""
    for i in range(games.teams.shape[1]):
        team = games.teams[e, i]
        if games.flown_by[e, team] == DIRECT and not games.failed[e, i]:
            for axis in range(2):
                games.given[e, i, axis] = np.float32(games.commands[e, team, 2 * i + axis] * unit)


@kernel
def solve_with_variants(
    games: Games, e: int, variants: RuleVariants, controller: ErgodicParameters, scratch: Scratch, boards: Boards
) -> None:
    """Choose all accelerations where rules differ from the preset `paper`.

    If `is_ergodic`, the ergodic controller runs for all drones, since memories and coefficients are kept for those of
    other systems, too. Drones of other systems then get the accelerations in `given`, and no plan to follow.
    """
    swarm = swarm_of(games, e, controller.warm_start)
    if variants.is_given:
        pass_on_commands(games, e, variants.unit)
    if games.followed.shape[2]:
        take_up_commands(games, e, variants, boards)
    if variants.can_fail:
        fail_and_repair(games, e, variants, boards)
    if not variants.is_ergodic:
        swarm = with_teams(swarm, at_work(swarm.teams, games.failed[e]))
        swarm.accelerations[:] = np.float32(0.0)
    elif variants.is_local:
        swarm = with_teams(swarm, at_work(swarm.teams, games.failed[e]))
        ergodic_among_heard(swarm, games.coefficients[e], controller, scratch, variants.radius)
    else:
        ergodic(swarm, games.coefficients[e], controller, scratch)
    if variants.is_given:
        for i in range(games.teams.shape[1]):
            if games.flown_by[e, games.teams[e, i]] != ERGODIC and not games.failed[e, i]:
                games.accelerations[e, i] = games.given[e, i]
                games.plans[e, i] = 0.0
    if variants.reconstructs:
        for team in range(2):
            rebuild_field(scratch.means[team], games.reconstruction[e, team])


@kernel
def find_captured_with_variants(
    games: Games,
    e: int,
    threshold: float,
    variants: RuleVariants,
    boards: Boards,
    fields: FieldScratch,
    captured: Bools,
) -> bool:
    """Mark the drones that are captured under rule variants, and return whether there are any."""
    positions, teams = games.positions[e], games.teams[e]
    cells = np.empty(teams.shape[0], np.int16)  # not from the trails: failed drones leave none
    for i in range(teams.shape[0]):
        cells[i] = cell_of(positions[i, 0], positions[i, 1])
    if variants.reconstructs:
        return find_captured_by_density(cells, teams, games.reconstruction[e], threshold, captured)
    return find_captured(cells, teams, boards, threshold, games.peaks[e], fields, captured)


@kernel
def change_team(
    games: Games, e: int, drone: int, rules: RuleParameters, boards: Boards, variants: RuleVariants | None
) -> None:
    """Let a captured drone join the other team, with its trail unless that is forgotten."""
    loser = games.teams[e, drone]
    winner = 1 - loser
    forgets = (False, True)
    if variants is not None:
        forgets = variants.capture_forgets
    forget(games, e, drone, forgets, boards)
    if not forgets[0]:
        hand_over_trail(games.trails[e], drone, loser, winner, boards)
    games.teams[e, drone] = winner
    games.captures[e, winner] += 1
    if games.ticks[e] - games.capture_ticks[e, drone] <= rules.ticks_per_second:
        games.recaptures[e, winner] += 1
    games.capture_ticks[e, drone] = games.ticks[e]


@kernel
def advance_game(
    games: Games,
    e: int,
    swarm: Swarm,
    ticks: int,
    rules: RuleParameters,
    controller: ErgodicParameters,
    scratch: Scratch,
    variants: RuleVariants | None,
    fields: FieldScratch,
    captured: Bools,
) -> None:
    """Advance game `e` by some ticks, or to the tick that decides it."""
    positions, teams, accelerations, trails = swarm.positions, swarm.teams, swarm.accelerations, games.trails[e]
    motion = positions.reshape(-1), swarm.velocities.reshape(-1), accelerations.reshape(-1)
    boards = Boards(games.occupancy[e].reshape(2, -1), rules.ring_weights)
    num_drones, peaks = teams.shape[0], games.peaks[e]

    for _ in range(ticks):
        if rules.capture_enabled and has_loser(teams):
            return
        if games.ticks[e] % rules.ticks_per_control_period == 0:
            if variants is None:
                ergodic(swarm, games.coefficients[e], controller, scratch)
            else:
                solve_with_variants(games, e, variants, controller, scratch, boards)
            saturate(accelerations, controller.max_acceleration)
        move(motion[0], motion[1], motion[2], rules.tick, rules.drift, rules.min_speed)
        slot = games.ticks[e] % trails.shape[0]
        extend_trails(positions, teams, slot, trails, boards)
        # Not in one line: the compiler decides only a test for None that stands alone.
        if variants is not None:  # noqa: SIM102
            if variants.can_fail:
                take_back_newest(games.failed[e], teams, slot, trails, boards)
        games.ticks[e] += 1
        if not rules.capture_enabled:
            continue
        threshold = rules.capture_threshold
        if variants is None:
            found = find_captured(trails[slot], teams, boards, threshold, peaks, fields, captured)
        else:
            found = find_captured_with_variants(games, e, threshold, variants, boards, fields, captured)
        if not found:
            continue
        for i in range(num_drones):
            if captured[i]:
                change_team(games, e, i, rules, boards, variants)


@kernel
def advance_games(
    games: Games,
    rows: Int64s,
    ticks: Int64s,
    rules: RuleParameters,
    controller: ErgodicParameters,
    variants: RuleVariants | None,
) -> None:
    """Advance the games `rows`, each by its own number of ticks (indexed by game)."""
    scratch = make_scratch(games.teams.shape[1], controller)
    fields, captured = make_field_scratch(games.occupancy, rules.ring_weights), np.empty(games.teams.shape[1], np.bool_)
    for row in rows:
        swarm = swarm_of(games, row, controller.warm_start)
        advance_game(games, row, swarm, ticks[row], rules, controller, scratch, variants, fields, captured)


@entry_point
def take_up(
    asked: Float64s,
    rows: Int64s,
    teams: Int64s,
    holds: bool,
    ticks: Int64s,
    flown_by: Int8s,
    commands: Float64s,
    former: Float64s,
    commanded: Int64s,
) -> None:
    """Put commands `asked` (n, t, S) in force for teams that systems other than the ergodic controller fly.

    `rows` (n,) are the games, and `teams` (t,) the teams of each. If `holds`, a command that is in force already
    changes nothing. The other arrays are those of `Games`; the last three are updated.
    """
    for place in range(len(rows)):
        e = rows[place]
        for number in range(len(teams)):
            team = teams[number]
            if flown_by[e, team] == ERGODIC:
                continue
            is_held = holds
            for k in range(asked.shape[2]):  # one by one: copying whole arrays takes seconds to compile
                is_held = is_held and asked[place, number, k] == commands[e, team, k]
            if is_held:
                continue
            for k in range(asked.shape[2]):
                former[e, team, k] = commands[e, team, k]
                commands[e, team, k] = asked[place, number, k]
            commanded[e, team] = ticks[e]


@entry_point
def are_decided(teams: Int8s) -> Bools:
    """Return for teams (n, N) of drones a mask (n,) of the games that one team has won."""
    decided = np.empty(len(teams), np.bool_)
    for place in range(len(teams)):
        decided[place] = has_loser(teams[place])
    return decided
