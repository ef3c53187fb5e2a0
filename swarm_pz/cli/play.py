"""Commands of the web page: ``play``, ``replay`` and ``site``."""

from __future__ import annotations

import contextlib
import functools
import io
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any
from urllib.parse import quote

import tyro

from swarm_pz.cli.options import HERE, AddressOptions
from swarm_pz.cli.player_options import known
from swarm_pz.cli.report import in_seconds, need, say
from swarm_pz.config import GameConfig
from swarm_pz.config.base import check, check_count, check_number
from swarm_pz.errors import CommandError, SwarmError, require_extra
from swarm_pz.play.robots import Lab, RobotsConfig
from swarm_pz.policy import about

if TYPE_CHECKING:
    from swarm_pz.play.game import TableConfig
    from swarm_pz.play.protocol import Card
    from swarm_pz.play.recordings.verification import Verification

_ROSBRIDGE = 9090


def play(
    opponent: Annotated[str | None, tyro.conf.arg(metavar="PLAYER")] = None,
    at: AddressOptions = HERE,
    allowed_hosts: tuple[str, ...] = (),
    min_command_interval: float = 0.5,
    countdown: float = 3.0,
    out: Path = Path("runs/games"),
    record_labels: bool = False,
    factors: Path | None = None,
    embed: tuple[str, ...] = (),
    rosbridge: Annotated[int | None, tyro.conf.arg(metavar="PORT")] = None,
    ros_opponent: Annotated[str | None, tyro.conf.arg(metavar="PLAYER")] = None,
    ros_origin: Annotated[tuple[str, ...], tyro.conf.arg(metavar="ADDRESS"), tyro.conf.UseAppendAction] = (),
    poses: bool = False,
    robots: RobotsConfig = RobotsConfig(),  # noqa: B008  (frozen)
    game: GameConfig = GameConfig(),  # noqa: B008  (frozen)
) -> None:
    """Serve the web page: play in a browser, against a person or a policy; every game is recorded.

    Args:
        opponent: Open the page in a game against this policy, a folder that training wrote, or FILE.py:NAME.
            With "none", it opens in a practice arena without opponents.
        allowed_hosts: Host names of proxies or tunnels that lead to this server, such as play.example.org.
        min_command_interval: Least time between two commands of a team, in seconds of game.
        countdown: Seconds of countdown before each game, while its start is shown.
        out: Folder of the recordings.
        record_labels: Write the players' labels into recordings; by default, only people in the room see them.
        factors: File with the controlled factors of red's and blue's seats: delays, hidden things, shared control.
        embed: Origins of pages that may show this page in a frame, such as https://lab.example.
        rosbridge: Let ROS programs, such as the paper's tablet app, play and watch through a rosbridge at this port.
            The usual port is 9090; 0 takes any free one.
        ros_opponent: Policy or training folder that plays against ROS programs; by default, the other side is free.
        ros_origin: Let pages of this address connect to the rosbridge, such as https://app.foxglove.dev.
            Some desktop programs need file://; pages of this machine, and other programs, need nothing.
        poses: Let robots fly the games: the rosbridge reads their poses from the lab and publishes setpoints for them.
            Its port is 9090 if none is given.
        robots: The lab, in m and s.
        game: The rules; each room sets its own team sizes and time limit.
    """
    need_play()
    from swarm_pz import policies
    from swarm_pz.evaluation.ledger import folder_lock
    from swarm_pz.play.factors import Factors, read_factors
    from swarm_pz.play.game import TableConfig
    from swarm_pz.play.server.robots import Robots
    from swarm_pz.play.server.server_context import check_folder

    check_folder(out)
    check_number(countdown, "countdown", 0.0, 60.0)
    if poses and rosbridge is None:
        rosbridge = _ROSBRIDGE
    if ros_opponent is not None and rosbridge is None:
        raise CommandError(f"--ros-opponent {ros_opponent} plays against ROS programs: give --rosbridge a port, too")
    if ros_origin and rosbridge is None:
        raise CommandError(f"--ros-origin {ros_origin[0]} opens a rosbridge to pages: give --rosbridge a port, too")
    installed = known()
    for name in (opponent, ros_opponent):
        if name is not None and name != "none":
            policies.load(name, game, game.team_systems[1])
            installed |= {name: about(name)}
    varied = read_factors(factors) if factors is not None else (Factors(), Factors())
    speed = robots.speed if poses else 1.0
    table = TableConfig(game=game, min_command_interval=min_command_interval, factors=varied, speed=speed)
    for team, own in enumerate(varied):
        if own.share > 0.0:
            policies.load(own.helper, game, game.team_systems[team])
    flown = Robots(robots) if poses else None
    lab = (robots, flown.token) if flown is not None else None
    with folder_lock(out):
        serve(
            installed,
            robots=flown,
            host=at.host,
            port=at.port,
            allowed_hosts=allowed_hosts,
            folder=out,
            page=f"play={quote(opponent, safe=':/')}" if opponent is not None else "",
            countdown_s=countdown,
            table=table,
            cards=_cards(),
            record_labels=record_labels,
            embedders=embed,
            greeting=f"rules: {game.rules_hash} (rules_hash of rooms as they are set at first)",
            beside=_beside(at.host, rosbridge, ros_opponent, ros_origin, table, lab),
        )


def replay(
    recording: Annotated[Path, tyro.conf.Positional],
    /,
    verify: bool = False,
    film: Path | None = None,
    mcap: Path | None = None,
    positions: Path | None = None,
    speed: float = 2.0,
    at: AddressOptions = HERE,
) -> None:
    """Watch a recorded game in a browser, or verify, film or export it.

    Args:
        recording: File of a recorded game, .jsonl.
        verify: Only check that simulating the game here gives the same game.
        film: Only write the game as a film: .gif, .mp4 or .webp.
        mcap: Only write the game as ROS 2 messages: .mcap.
        positions: Only write the drones' positions, 30 times a second: .csv.
        speed: Seconds of game per second of film.
    """
    need_play()
    from swarm_pz.play.recordings.folder import checked_name
    from swarm_pz.play.recordings.playback import Playback
    from swarm_pz.play.recordings.recording import Recording

    check(speed > 0, "speed", speed, "above 0")
    is_shown = film is None and mcap is None and positions is None and not verify
    read = Recording.read(recording)
    if film is not None:
        with in_seconds() as show:
            Playback(read).film(film, speed, show)
        print(f"film: {film}")
    if mcap is not None:
        require_extra("rosbags.typesys", "lab")
        from swarm_pz.play.ros.mcap import write

        with in_seconds("writing messages") as show:
            count = write(read, mcap, show)
        print(f"{count} messages: {mcap}")
    if positions is not None:
        Playback(read).write_positions(positions)
        print(f"positions: {positions}")
    if verify:
        _print_verified(recording, Playback(read).verify())
    if is_shown:
        page, folder = f"replay={checked_name(recording.name)}", recording.parent
        serve(known(), host=at.host, port=at.port, folder=folder, page=page, cards=_cards(), record_labels=False)


def site(out: Annotated[Path, tyro.conf.Positional], /, *, address: str = "") -> None:
    """Write the web page as a folder for any file host; games run in the browser.

    Args:
        out: Folder of the page.
        address: Address of the published page, such as https://example.org/game/; links to it then show a picture.
    """
    need_play()
    from swarm_pz.play.site import write

    fits = not address or (address.startswith(("https://", "http://")) and address.endswith("/"))
    check(fits, "address", address, "an address that begins with https:// and ends with /")
    size = write(out, site_files(address))
    print(f"site: {out}, {size / 1000:.0f} kB; try it with: python -m http.server --directory {out}")


def site_files(address: str = "") -> dict[str, bytes]:
    """Return the files that `site` writes, by path."""
    from swarm_pz.play.site import files_of
    from swarm_pz.policies import zoo

    weights = {path.parent.name: path for path in Path(zoo.__file__).parent.glob("*/policy.safetensors")}
    return files_of(known(), _cards(), weights, address)


def _print_verified(recording: Path, result: Verification) -> None:
    """Print that a recording verifies, or raise a SwarmError with all its faults."""
    faults = list(result.faults)
    if result.first_difference is not None:
        faults.append(
            f"it plays differently here from tick {result.first_difference} on: it was changed, or recorded by "
            "another version or on another kind of processor"
        )
    if not result.finished:
        faults.append(f"it is unfinished: it breaks off after {result.frames} frames, without the game's end")
    if not result.frames:
        faults.append("it shows nothing that could be compared")
    if faults:
        raise SwarmError("\n  ".join([f"{recording} does not verify:", *faults]))
    how = "as recorded"
    if result.in_page:
        how = "as recorded, each but for rounding from the one before it, since the game was played in a page"
    print(f"verified: {result.frames} frames of {recording} come out {how}")


def _beside(
    host: str, port: int | None, opponent: str | None, origins: Sequence[str], table: TableConfig, lab: Lab | None
) -> Callable[[str], AbstractContextManager[None]]:
    """Return the maker of a context that serves ROS programs beside the server; without a port, it is empty."""
    if port is None:
        return lambda _: contextlib.nullcontext()
    require_extra("rosbags.typesys", "lab")
    from swarm_pz.play.ros import bridge
    from swarm_pz.play.ros.rosbridge import origins_of

    check_count(port, "rosbridge", 0, 65535)
    allowed = origins_of(host, origins)
    return functools.partial(bridge.rosbridge, bridge.listen(host, port), opponent, table, allowed, lab)


def serve(installed: dict[str, str], **options: Any) -> None:
    """Run the server, with the installed policies, until it is stopped."""
    from swarm_pz import policies
    from swarm_pz.play.server import serve as server

    server.serve(policies.load, installed, say=say, draw_code=draw_code, **options)


def need_play() -> None:
    """Raise a MissingExtraError if the extra `play` is missing."""
    need("play", "msgspec", "segno", "starlette", "uvicorn", "websockets")


def _cards() -> dict[str, Card]:
    """Return the cards of the policies on the ladder by name; `python -m benchmarks.policy_cards` makes them."""
    import msgspec

    from swarm_pz import policies
    from swarm_pz.play.protocol import Card

    return msgspec.json.decode(Path(policies.__file__).with_name("cards.json").read_bytes(), type=dict[str, Card])


def draw_code(address: str) -> str:
    """Return an address as a QR code made of text."""
    picture = io.StringIO()
    require_extra("segno", "play").make(address).terminal(picture, compact=True)
    return picture.getvalue()
