"""What ``export`` writes and refuses."""

import pytest

from swarm_pz.cli import export, main
from swarm_pz.policies import exporting


def test_a_pickle_is_not_opened_before_it_is_trusted(monkeypatch, capsys):
    opened = []

    def load(path):
        opened.append(path)
        raise SystemExit(3)

    monkeypatch.setattr(exporting, "load_model", load)
    with pytest.raises(SystemExit, match="2"):
        main(["export", "model.zip", "out"])
    assert "model.zip is a pickle" in capsys.readouterr().err and not opened
    with pytest.raises(SystemExit, match="3"):
        main(["export", "model.zip", "out", "--trust"])
    assert opened


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("ring out", "only networks can be exported"),
        ("master out", "it plans. Export 'veteran' instead"),
        ("champion out.onnx", "expected a folder"),
        ("champion full", "holds something already"),
        ("nobody out", "there is no policy 'nobody'"),
    ],
)
def test_what_cannot_be_exported_is_named(words, message, tmp_path, monkeypatch, capsys):
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "notes.txt").write_text("mine")
    if words.startswith("champion"):  # before libraries are imported, which takes seconds
        monkeypatch.setattr(export, "require_extra", lambda *_: pytest.fail("it imports libraries"))
    with pytest.raises(SystemExit, match="2"):
        main(["export", *words.split()])
    assert message in capsys.readouterr().err


def test_a_learned_policy_is_exported_and_plays(capsys):
    main(["export", "champion", "mine"])
    assert "evaluate mine" in capsys.readouterr().out
    main(["evaluate", "mine", "--games", "2", "--game.time-limit", "3", "--threads", "1"])
    assert "champion" in capsys.readouterr().out
