import pytest

from swarm_pz.cli import main
from swarm_pz.play.server import serve


def run(words):
    main(words.split())


@pytest.fixture
def refused(capsys):
    """Run a command that must be refused and print nothing else; return its error."""

    def refused(words):
        capsys.readouterr()
        with pytest.raises(SystemExit, match="2"):
            run(words)
        printed = capsys.readouterr()
        assert not printed.out
        return printed.err

    return refused


@pytest.fixture
def served(monkeypatch):
    """Return the calls of the server, which ends at once."""
    calls = []
    for command in ("play", "studies"):
        monkeypatch.setattr(f"swarm_pz.cli.{command}.known", lambda: {"uniform": "everywhere"})
    monkeypatch.setattr(serve, "serve", lambda loader, policies, **options: calls.append((loader, policies, options)))
    return calls
