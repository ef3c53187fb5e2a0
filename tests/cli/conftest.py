import pytest

from swarm_pz.cli import main
from swarm_pz.play.server import serve


def run(words):
    main(words.split())


@pytest.fixture
def refused(capsys):
    """Run a command that is refused, and return its error; it has said nothing else."""

    def refused(words):
        capsys.readouterr()
        with pytest.raises(SystemExit, match="2"):
            run(words)
        said = capsys.readouterr()
        assert not said.out
        return said.err

    return refused


@pytest.fixture
def served(monkeypatch):
    """Give what the server is called with; it ends at once."""
    calls = []
    for command in ("play", "studies"):
        monkeypatch.setattr(f"swarm_pz.cli.{command}.known", lambda: {"uniform": "everywhere"})
    monkeypatch.setattr(serve, "serve", lambda loader, policies, **how: calls.append((loader, policies, how)))
    return calls
