"""A study at the table: what pages ask participants, step by step, and the monitor of the experimenter."""

from __future__ import annotations

import asyncio
import logging
import secrets
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Annotated, Any

import msgspec
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import JSONResponse, RedirectResponse, Response
from starlette.routing import Route

from swarm_pz.errors import ConfigError, OutputError, ProtocolError, RecordingError, SwarmError
from swarm_pz.play import protocol
from swarm_pz.play.server.limits import AddressLimits
from swarm_pz.play.server.lobby import Lobby
from swarm_pz.play.server.middleware import page
from swarm_pz.play.server.study_games import StudyGames
from swarm_pz.play.studies.folder import StudyFolder
from swarm_pz.play.studies.forms import MOST_TEXT, Form, Item
from swarm_pz.play.studies.progress import Progress, Step
from swarm_pz.play.studies.texts import html_of

LEASE_S = 8.0
"""Seconds for which a window that says nothing is still the participant's: pages say something every two."""
MOST_WRONG_CODES, WRONG_CODES_S = 20, 100.0
"""Wrong codes of an address in so many seconds: a class behind one mistypes some, and a guesser tries millions."""
_MOST_BYTES = 4096
"""Of what a page says, but for answers."""
_PART_S = 10.0
"""Seconds within which all of it must have come."""
_HEADINGS = {"consent": "Do you want to take part?", "text": "Please read", "break": "Time for a rest"}
_GAMES = ("game", "practice")
log = logging.getLogger("swarm_pz.play")


class PageMessage(msgspec.Struct):
    """What a participant's page says: its window, when that was loaded there, and what it does."""

    window: str = ""
    loaded: Annotated[float, msgspec.Meta(ge=0, le=1e15)] = 0.0
    here: bool = False
    """It takes the session over from another window."""
    step: str = ""
    answers: Any = msgspec.field(default_factory=dict)


_page_messages = msgspec.json.Decoder(PageMessage)
Action = Callable[[int, PageMessage], Awaitable[dict[str, Any]]]


@dataclass
class Visitor:
    """A participant's page.

    - `window`: what no other window of a browser has.
    - `loaded`: when the page was loaded there, by its clock: a tab that was copied has the same name.
    - `seen`: when it last said something.
    - `wants`: the game of two that it is ready for.
    """

    window: str = ""
    loaded: float = 0.0
    seen: float = -1e9
    wants: str = ""

    def claim(self, window: str, loaded: float, now: float, *, takes_over: bool, is_busy: bool) -> bool:
        """Take a window for the participant's, and tell whether it is; another one that is there comes first."""
        is_same = window == self.window
        is_there = bool(self.window) and (is_busy or now - self.seen < LEASE_S)
        if (is_same and loaded < self.loaded) or (not is_same and is_there and not takes_over):
            return False
        self.window, self.loaded, self.seen = window, loaded, now
        return True


class StudyHost:
    """A study as it is served.

    - `lobby`: whose rooms are this study's games.
    - `token`: opens the monitor.
    """

    def __init__(self, folder: StudyFolder, lobby: Lobby) -> None:
        self.folder, self.study = folder, folder.study
        self.games = StudyGames(folder, lobby)
        self.token = secrets.token_urlsafe(12)
        self._visitors = [Visitor() for _ in range(self.study.participants)]
        self._guesses = AddressLimits(MOST_WRONG_CODES, WRONG_CODES_S)
        self._longest = _MOST_BYTES + max((_bytes_of(asked.form) for asked in self.study.forms), default=0)
        """Bytes that answers may have."""
        self._turns = [asyncio.Lock() for _ in self._visitors[::2]]
        """Of two who may meet: one at a time, or what is left of a game would be looked for in a new one."""

    def routes(self) -> list[Route]:
        """Return its pages, and what they ask for."""
        return [
            Route("/", lambda _: RedirectResponse("/study")),
            page("/study", "study.html"),
            page("/study/monitor", "monitor.html"),
            Route("/study/monitor/data", self._monitor),
            page("/study/{code}", "study.html"),
            page("/study/{code}/game", "index.html"),
            Route("/study/{code}/state", self._answer(self._look), methods=["POST"]),
            Route("/study/{code}/done", self._answer(self._finish, self._longest), methods=["POST"]),
            Route("/study/{code}/play", self._answer(self._play), methods=["POST"]),
        ]

    # --- participants -----------------------------------------------------------------------------

    def _answer(self, act: Action, most: int = _MOST_BYTES) -> Callable[[Request], Awaitable[Response]]:
        async def answer(request: Request) -> Response:
            try:
                message = await _read(request, most)
                address = request.client.host if request.client is not None else ""
                number = self._number_of(request.path_params["code"], message.window, address)
                return JSONResponse(await self._obey(number, message, act))
            except HTTPException as error:
                return JSONResponse({"fault": error.detail}, error.status_code)
            except Exception as error:
                status, told = _fault_of(error)
                return JSONResponse({"fault": told}, status)

        return answer

    def _number_of(self, code: str, window: str, address: str) -> int:
        """Return whose code it is.

        After too many wrong ones an address opens no session, with a right one neither: else it would go on guessing.
        Whoever is known by their window goes on.

        Raises HTTPException if it is nobody's, or of somebody who has withdrawn, or may not be said.
        """
        try:
            number, fault = self.folder.number_of(code), ""
        except ConfigError as error:
            number, fault = -1, str(error)
        if number >= 0 and window and window == self._visitors[number].window:
            return number
        self._guesses.forget()
        guesses = self._guesses.of(address)
        if guesses.is_reached():
            raise HTTPException(429, "too many wrong codes came from your network: wait for two minutes")
        if number < 0:
            guesses.take()
            raise HTTPException(404, fault)
        if number in self.folder.withdrawn:
            raise HTTPException(410, "who had this code has withdrawn from the study, and nothing of theirs is kept")
        return number

    async def _obey(self, number: int, message: PageMessage, act: Action) -> dict[str, Any]:
        visitor, now = self._visitors[number], time.monotonic()
        async with self._turns[number // 2]:
            is_busy = self.games.is_played_by(number)
            if not visitor.claim(message.window, message.loaded, now, takes_over=message.here, is_busy=is_busy):
                return {"code": self.folder.codes[number], "title": self.study.title, "elsewhere": True}
            more = await act(number, message)
            return await self._state(number) | more

    async def _look(self, number: int, message: PageMessage) -> dict[str, Any]:
        return {}

    async def _finish(self, number: int, message: PageMessage) -> dict[str, Any]:
        """Keep what was answered, unless it is known already: an answer of ours may have been lost."""
        progress = await self._progress(number)
        step = progress.next
        if step is None or message.step != step.id or step.kind in _GAMES:
            return {}
        if step.kind == "break" and self._rest_s(progress) > 0.0:
            return {"refused": "the break is not over yet"}
        told = {"answers": message.answers} if step.kind == "form" else {}
        try:
            await asyncio.to_thread(progress.finish, step, **told)
        except ConfigError as error:
            return {"refused": str(error)}
        return {}

    async def _play(self, number: int, message: PageMessage) -> dict[str, Any]:
        """Begin a game, once everybody who plays it is ready."""
        game = self.games.of(number)
        if game is not None and not game.fault:
            return {}
        if game is not None:
            self.games.drop(game)
        progress = await self._progress(number)
        step = progress.next
        if step is None or message.step != step.id or step.kind not in _GAMES:
            return {}
        self._visitors[number].wants = step.id
        players = self.folder.players(number, step)
        if all(one == number or self._is_ready(one, step) for one in players):
            try:
                self.games.open(players, step)
            except SwarmError as error:
                log.error("%s", error)
                return {"refused": f"the game cannot begin: {error}. Please tell whoever runs the study"}
        return {}

    def _is_ready(self, number: int, step: Step) -> bool:
        visitor = self._visitors[number]
        is_there = time.monotonic() - visitor.seen < LEASE_S
        if not is_there or visitor.wants != step.id or self.games.of(number) is not None:
            return False
        try:
            due = self.folder.progress(number).next
        except RecordingError:  # they are told
            return False
        return due is not None and due.id == step.id

    async def _progress(self, number: int) -> Progress:
        """Return how far somebody is, with what was left of a game taken up if none is played."""
        if self.games.of(number) is None:
            await asyncio.to_thread(self.folder.settle, number)
        return self.folder.progress(number)

    def _rest_s(self, progress: Progress) -> float:
        """Return how long a break still lasts; it began when what came before it was done."""
        began = max((float(line["at"]) for line in progress.done.values() if "at" in line), default=time.time())
        return min(max(began + self.study.break_s - time.time(), 0.0), self.study.break_s)

    # --- what pages are told ----------------------------------------------------------------------

    async def _state(self, number: int) -> dict[str, Any]:
        progress = await self._progress(number)
        step, steps = progress.next, progress.steps
        done = len(progress.done)
        told: dict[str, Any] = {"code": self.folder.codes[number], "title": self.study.title, "done": done}
        told["of"] = max(len(steps), done + (step is not None))
        if step is None:
            return told
        told["step"] = {"id": step.id, "kind": step.kind, "heading": self._heading(step)}
        if step.text:
            told["step"]["html"] = html_of(self.study.text(step.text))
        if step.form is not None:
            told["step"]["items"] = step.form.to_dict()["items"]
        if step.kind == "break":
            told["step"]["seconds"] = self._rest_s(progress)
        if step.kind in _GAMES:
            told["game"] = self._game(number, step)
        return told

    def _heading(self, step: Step) -> str:
        if step.form is not None:
            return step.form.title or step.form.name
        if step.kind == "practice":
            return f"Practice game {step.game + 1}"
        if step.kind == "game":
            return f"Game {step.game + 1} of {self.study.games}"
        return _HEADINGS[step.kind]

    def _game(self, number: int, step: Step) -> dict[str, Any]:
        """Return how the game stands that comes next: its seat, whom it waits for, or what keeps it."""
        game = self.games.of(number)
        if game is not None:
            return {"phase": game.phase, "seat": game.seat_of(number), "fault": game.fault}
        players, practice = self.folder.players(number, step), self.study.practice
        others = [one for one in players if one != number]
        wants = self._visitors[number].wants == step.id
        met = all(self._is_ready(one, step) for one in others)
        until = f"until you have won {practice.wins}, or played {practice.most}" if step.kind == "practice" else ""
        return {
            "phase": "waiting" if others and wants and not met else "before",
            "of_two": bool(others),
            "until": until,
            "again": self.folder.was_broken_off(number, step),
        }

    # --- the monitor ------------------------------------------------------------------------------

    async def _monitor(self, request: Request) -> Response:
        given = request.headers.get("authorization", "").removeprefix("Bearer ")
        if not secrets.compare_digest(given.encode(), self.token.encode()):
            return JSONResponse({"fault": "this page's address ends in #token, as the terminal shows it"}, 403)
        rows = []
        for number in range(self.study.participants):
            rows.append(self._row(number))
            await asyncio.sleep(0.0)  # games have their turn: there may be thousands of rows
        return JSONResponse({"title": self.study.title, "games": self.study.games, "rows": rows})

    def _row(self, number: int) -> dict[str, Any]:
        ago = time.monotonic() - self._visitors[number].seen
        is_playing = self.games.is_played_by(number)
        where = "in a game" if is_playing else "here" if ago < LEASE_S else "away"
        seen = 0.0 if is_playing else ago if ago < 1e8 else None
        return self.folder.summary(number) | {"where": where, "seen_s": seen}


def _fault_of(error: Exception) -> tuple[int, str]:
    """Return the status and the words by which a page hears of an error: without words it would ask again for ever."""
    if isinstance(error, ConfigError):
        return 400, str(error)
    is_known = isinstance(error, SwarmError | OSError)
    log.error("a page's message was not obeyed: %s", error, exc_info=None if is_known else error)
    ask = "please tell whoever runs the study"
    if isinstance(error, RecordingError):
        return 409, f"what you have done so far cannot be read here: {ask}"
    if isinstance(error, OutputError | OSError):
        return 503, f"this could not be written down: {ask}"
    return 500, f"the server could not do that: {ask}"


def _bytes_of(form: Form) -> int:
    """Return the bytes that answers to a form may have, every character written as six."""

    def characters(item: Item) -> int:
        return MOST_TEXT if item.kind == "text" else max(map(len, item.choices), default=20)

    return sum(6 * (len(item.id) + characters(item)) + 16 for item in form.items)


async def _read(request: Request, most: int) -> PageMessage:
    """Return what a page says.

    Raises ConfigError if it does not fit, is too large, or does not come.
    """
    data = bytearray()
    try:
        async with asyncio.timeout(_PART_S):
            async for part in request.stream():
                data += part
                if len(data) > most:
                    raise ConfigError(f"a page may say {most} bytes here, and this is more")
    except TimeoutError as error:
        raise ConfigError(f"what a page says must come within {_PART_S:g} seconds") from error
    try:
        return protocol.decode(_page_messages, bytes(data), most)
    except ProtocolError as error:
        raise ConfigError(f"what the page said does not fit: {error}") from error
