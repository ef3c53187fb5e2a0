"""The pages of a study: steps of the participants, and the monitor of the experimenter."""

from __future__ import annotations

import asyncio
import html
import logging
import secrets
import time
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Annotated, Any

import msgspec
from starlette.exceptions import HTTPException
from starlette.middleware.gzip import GZipMiddleware
from starlette.requests import Request
from starlette.responses import HTMLResponse, JSONResponse, RedirectResponse, Response
from starlette.routing import BaseRoute, Mount, Route
from starlette.staticfiles import StaticFiles

from swarm_pz.errors import ConfigError, OutputError, ProtocolError, RecordingError, SwarmError
from swarm_pz.play import protocol
from swarm_pz.play.server.lobby import Lobby
from swarm_pz.play.server.middleware import page
from swarm_pz.play.server.rate_limit import AddressLimits
from swarm_pz.play.server.study_games import StudyGames
from swarm_pz.play.site import STATIC
from swarm_pz.play.studies import PAGES
from swarm_pz.play.studies.folder import StudyFolder
from swarm_pz.play.studies.progress import Progress, Step, items_of
from swarm_pz.play.studies.texts import html_of
from swarm_pz.play.studies.withdrawal import delete

LEASE_S = 8.0
"""Seconds for which a silent window counts as present; pages send a message every two."""
MOST_WRONG_CODES, WRONG_CODES_S = 20, 100.0
"""Wrong codes of an address, within so many seconds: a class behind one mistypes some; a guesser tries millions."""
_MOST_BYTES = 2**19
"""Bytes of a page's message: answers to a form of twenty long texts have fewer."""
_PART_S = 10.0
"""Seconds within which a message must have come."""
_HEADINGS = {
    "consent": "Do you want to take part?",
    "text": "Please read",
    "break": "Time for a rest",
    "debriefing": "About this study",
}
_GAMES = ("game", "practice")
log = logging.getLogger("swarm_pz.play")


class PageMessage(msgspec.Struct):
    """The message of a participant's page.

    `here` takes the session over from another window; with `delete`, a participant who stops withdraws.
    """

    window: str = ""
    loaded: Annotated[float, msgspec.Meta(ge=0, le=1e15)] = 0.0
    here: bool = False
    step: str = ""
    delete: bool = False
    answers: Any = msgspec.field(default_factory=dict)


_page_messages = msgspec.json.Decoder(PageMessage)
Action = Callable[[int, PageMessage], Awaitable[dict[str, Any]]]


@dataclass
class Visitor:
    """A participant's page.

    - `window`: its unique name in a browser.
    - `loaded`: time at which it was loaded, by the browser's clock: a copied tab has the same name.
    - `seen`: time of its latest message.
    - `wants`: the step whose game it is ready for.
    """

    window: str = ""
    loaded: float = 0.0
    seen: float = -1e9
    wants: str = ""

    def claim(self, window: str, loaded: float, now: float, *, takes_over: bool, is_busy: bool) -> bool:
        """Make a window the participant's, and return true unless another one is in use."""
        is_same = window == self.window
        is_there = bool(self.window) and (is_busy or now - self.seen < LEASE_S)
        if (is_same and loaded < self.loaded) or (not is_same and is_there and not takes_over):
            return False
        self.window, self.loaded, self.seen = window, loaded, now
        return True


class StudyHost:
    """A study as it is served; `token` opens the monitor."""

    def __init__(self, folder: StudyFolder, lobby: Lobby) -> None:
        self.folder, self.study = folder, folder.study
        self.games = StudyGames(folder, lobby)
        self.token = secrets.token_urlsafe(12)
        self._visitors = [Visitor() for _ in range(self.study.participants)]
        self._guesses = AddressLimits(MOST_WRONG_CODES, WRONG_CODES_S)
        self._turns = [asyncio.Lock() for _ in self._visitors[::2]]
        """One for each pair that may meet: without it, one could open a game while the other's is settled."""

    def routes(self) -> list[BaseRoute]:
        """Return its pages and their requests."""
        return [
            Route("/", lambda _: RedirectResponse("/study")),
            page("/study", PAGES / "study.html"),
            page("/study/monitor", PAGES / "study.html"),
            Route("/study/monitor/data", self._monitor),
            page("/study/{code}", PAGES / "study.html"),
            page("/study/{code}/game", STATIC / "index.html"),
            Route("/study/{code}/state", self._answer(None), methods=["POST"]),
            Route("/study/{code}/done", self._answer(self._finish), methods=["POST"]),
            Route("/study/{code}/play", self._answer(self._play), methods=["POST"]),
            Route("/study/{code}/stop", self._answer(self._stop), methods=["POST"]),
            Route("/study/{code}/consent", self._consent),
            Mount("/study-pages", GZipMiddleware(StaticFiles(directory=PAGES))),
        ]

    # --- participants -----------------------------------------------------------------------------

    def _answer(self, act: Action | None) -> Callable[[Request], Awaitable[Response]]:
        async def answer(request: Request) -> Response:
            try:
                message = await _read(request)
                address = request.client.host if request.client is not None else ""
                number = self._number_of(request.path_params["code"], message.window, address)
                return JSONResponse(await self._obey(number, message, act))
            except HTTPException as error:
                return JSONResponse({"fault": error.detail}, error.status_code)
            except Exception as error:
                status, fault = _fault_of(error)
                return JSONResponse({"fault": fault}, status)

        return answer

    def _number_of(self, code: str, window: str, address: str) -> int:
        """Return the number of the participant with a code.

        After too many wrong codes, an address cannot open a new session, so that guessing is useless.

        Raises HTTPException if the code is unknown or withdrawn, or comes from such an address.
        """
        try:
            number, fault = self.folder.number_of(code), ""
        except ConfigError as error:
            number, fault = -1, str(error)
        is_known = number >= 0 and bool(window) and window == self._visitors[number].window
        if is_known and number not in self.folder.withdrawn:
            return number
        self._guesses.forget()
        guesses = self._guesses.of(address)
        if guesses.is_reached():
            raise HTTPException(429, "too many wrong codes came from your network: wait for two minutes")
        if number < 0:
            guesses.take()
            raise HTTPException(404, fault)
        self._check_is_in(number)
        return number

    def _check_is_in(self, number: int) -> None:
        if number in self.folder.withdrawn:
            raise HTTPException(
                410, "whoever had this code has withdrawn from the study, and nothing of theirs is kept"
            )

    async def _obey(self, number: int, message: PageMessage, act: Action | None) -> dict[str, Any]:
        visitor, now = self._visitors[number], time.monotonic()
        async with self._turns[number // 2]:
            self._check_is_in(number)  # the participant may have withdrawn meanwhile
            is_busy = self.games.is_played_by(number)
            if not visitor.claim(message.window, message.loaded, now, takes_over=message.here, is_busy=is_busy):
                return {"code": self.folder.codes[number], "title": self.study.title, "elsewhere": True}
            more = await act(number, message) if act is not None else {}
            state = {} if number in self.folder.withdrawn else await self._state(number)
            return state | self.study.phrases | more

    async def _finish(self, number: int, message: PageMessage) -> dict[str, Any]:
        """Store the answers of a step, unless it is done: the page repeats a request if the reply was lost."""
        progress = await self._progress(number)
        step = progress.next
        if step is None or message.step != step.id or step.kind in _GAMES:
            return {}
        if step.kind == "break" and self._rest_s(progress) > 0.0:
            return {"refused": "the break is not over yet"}
        answers = {"answers": message.answers} if step.kind == "form" else {}
        try:
            await asyncio.to_thread(progress.finish, step, **answers)
        except ConfigError as error:
            return {"refused": str(error)}
        return {}

    async def _play(self, number: int, message: PageMessage) -> dict[str, Any]:
        """Begin a game, once all of its players are ready."""
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

    async def _stop(self, number: int, message: PageMessage) -> dict[str, Any]:
        """Let a participant stop for good; their data is kept, or deleted."""
        if not (await self._progress(number)).may_stop:
            return {}
        await self.games.leave(number)
        if not message.delete:
            await asyncio.to_thread((await self._progress(number)).stop)
            return {}
        await asyncio.to_thread(delete, self.folder, number)
        text = html_of(self.study.text(self.study.debriefing)) if self.study.debriefing else ""
        return {"code": self.folder.codes[number], "title": self.study.title, "withdrawn": True, "html": text}

    async def _consent(self, request: Request) -> Response:
        """Return a participant's copy of the consent."""
        code, address = request.path_params["code"], request.client.host if request.client is not None else ""
        number = self._number_of(code, "", address)
        at = self.folder.progress(number).done.get("consent", {}).get("at") if self.folder.has_come(number) else None
        if at is None:
            raise HTTPException(404, "nobody has agreed here")
        when = f"{time.strftime('%Y-%m-%d %H:%M', time.gmtime(at))} UTC"
        title, text = html.escape(self.study.title), html_of(self.study.text(self.study.consent))
        agreed = f"<p>{self.folder.codes[number]}: &#10003; {when}</p>"
        return HTMLResponse(f"<!doctype html><meta charset=utf-8><title>{title}</title><p>{title}</p>{text}{agreed}")

    def _is_ready(self, number: int, step: Step) -> bool:
        visitor = self._visitors[number]
        is_there = time.monotonic() - visitor.seen < LEASE_S
        if not is_there or visitor.wants != step.id or self.games.of(number) is not None:
            return False
        try:
            due = self.folder.progress(number).next
        except RecordingError:
            return False
        return due is not None and due.id == step.id

    async def _progress(self, number: int) -> Progress:
        """Return a participant's progress, once an interrupted game is settled."""
        if self.games.of(number) is None:
            await asyncio.to_thread(self.folder.settle, number)
        return self.folder.progress(number)

    def _rest_s(self, progress: Progress) -> float:
        """Return the seconds left of a break, which began with the end of the step before."""
        began = max((float(line["at"]) for line in progress.done.values() if "at" in line), default=time.time())
        return min(max(began + self.study.break_s - time.time(), 0.0), self.study.break_s)

    # --- state ------------------------------------------------------------------------------------

    async def _state(self, number: int) -> dict[str, Any]:
        progress = await self._progress(number)
        step, steps = progress.next, progress.steps
        done = len(progress.done)
        state: dict[str, Any] = {"code": self.folder.codes[number], "title": self.study.title, "done": done}
        state |= {"of": max(len(steps), done + (step is not None)), "may_stop": progress.may_stop}
        state["consented"] = "consent" in progress.done
        if step is None:
            return state | {"completion": "" if progress.has_ended_early else self.study.completion}
        state["step"] = {"id": step.id, "kind": step.kind, "heading": self._heading(step)}
        if step.text:
            state["step"]["html"] = html_of(self.study.text(step.text))
        if step.form is not None:
            items = [item.to_dict() for item in items_of(self.study, number, step)]
            state["step"]["items"] = [{name: one for name, one in item.items() if name != "correct"} for item in items]
            state["step"]["attempt"] = step.attempt
        if step.kind == "break":
            state["step"]["seconds"] = self._rest_s(progress)
        if step.kind in _GAMES:
            state["game"] = self._game(number, step)
        return state

    def _heading(self, step: Step) -> str:
        if step.form is not None:
            return step.form.title or step.form.name
        if step.kind == "practice":
            return f"Practice game {step.game + 1}"
        if step.kind == "game":
            return f"Game {step.game + 1} of {self.study.games}"
        return _HEADINGS.get(step.id) or _HEADINGS[step.kind]

    def _game(self, number: int, step: Step) -> dict[str, Any]:
        """Return the state of a participant's next game."""
        game = self.games.of(number)
        if game is not None:
            return {"phase": game.phase, "seat": game.seat_of(number), "fault": game.fault}
        players, practice = self.folder.players(number, step), self.study.practice
        others = [one for one in players if one != number]
        wants = self._visitors[number].wants == step.id
        are_ready = all(self._is_ready(one, step) for one in others)
        until = f"until you have won {practice.wins}, or played {practice.most}" if step.kind == "practice" else ""
        return {
            "phase": "waiting" if others and wants and not are_ready else "before",
            "of_two": bool(others),
            "until": until,
            "again": self.folder.was_broken_off(number, step),
        }

    # --- the monitor ------------------------------------------------------------------------------

    async def _monitor(self, request: Request) -> Response:
        token = request.headers.get("authorization", "").removeprefix("Bearer ")
        if not secrets.compare_digest(token.encode(), self.token.encode()):
            return JSONResponse({"fault": "this page's address ends in #token, as the terminal shows it"}, 403)
        rows = []
        for number in range(self.study.participants):
            rows.append(self._row(number))
            await asyncio.sleep(0.0)  # games go on: there may be thousands of rows
        return JSONResponse({"title": self.study.title, "games": self.study.games, "rows": rows})

    def _row(self, number: int) -> dict[str, Any]:
        ago = time.monotonic() - self._visitors[number].seen
        is_playing = self.games.is_played_by(number)
        where = "in a game" if is_playing else "here" if ago < LEASE_S else "away"
        seen_s = 0.0 if is_playing else ago if ago < 1e8 else None
        return self.folder.summary(number) | {"where": where, "seen_s": seen_s}


def _fault_of(error: Exception) -> tuple[int, str]:
    """Return the status and the message of an error: without a message the page would ask for ever."""
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


async def _read(request: Request) -> PageMessage:
    """Return a page's message.

    Raises ConfigError if it does not fit, is too large, or does not come.
    """
    data = bytearray()
    try:
        async with asyncio.timeout(_PART_S):
            async for part in request.stream():
                data += part
                if len(data) > _MOST_BYTES:
                    raise ConfigError(f"a page may say {_MOST_BYTES} bytes here, and this is more")
    except TimeoutError as error:
        raise ConfigError(f"what a page says must come within {_PART_S:g} seconds") from error
    try:
        return protocol.decode(_page_messages, bytes(data), _MOST_BYTES)
    except ProtocolError as error:
        raise ConfigError(f"what the page said does not fit: {error}") from error
