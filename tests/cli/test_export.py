"""What ``export`` writes and refuses."""

from __future__ import annotations

import contextlib

import pytest

from swarm_pz.cli import export, main
from swarm_pz.policies import exporting


def test_a_file_is_not_opened_before_it_is_trusted(tmp_path, monkeypatch, capsys):
    def opened(path):
        raise AssertionError("it ran")

    monkeypatch.setattr(exporting, "load_model", opened)
    with pytest.raises(SystemExit):
        main(["export", "model.zip", str(tmp_path / "out")])
    assert "model.zip is a pickle, and opening it runs whatever code it holds" in capsys.readouterr().err
    with pytest.raises(AssertionError, match="it ran"):
        main(["export", "model.zip", str(tmp_path / "out"), "--trust"])


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["ring", "out"], "only networks can be exported, and 'ring' is none"),
        (["master", "out"], "'master' is more than one: it plans. Export 'veteran' instead"),
        (["champion", "out.onnx"], "expected a folder, got 'out.onnx'"),
        (["champion", "full"], "holds something already"),
        (["nobody", "out"], "there is no policy 'nobody'"),
    ],
)
def test_what_cannot_be_exported_is_named(words, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "notes.txt").write_text("mine")
    with pytest.raises(SystemExit):
        main(["export", *words])
    assert message in capsys.readouterr().err


def test_the_folder_is_looked_at_before_anything_is_imported(monkeypatch, capsys):
    def asked(*_):
        raise AssertionError("it imports libraries")

    monkeypatch.setattr(export, "require_extra", asked)
    with pytest.raises(SystemExit):
        main(["export", "champion", "out.onnx"])
    assert "expected a folder, got 'out.onnx'" in capsys.readouterr().err


def test_a_learned_policy_is_exported_and_plays(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    shown = []
    monkeypatch.setattr(export, "progress", lambda *what: shown.append(what) or contextlib.nullcontext())
    main(["export", "champion", "mine"])
    assert "evaluate mine" in capsys.readouterr().out
    assert shown == [("files", "exporting")]  # it takes seconds, and showed nothing
    main(["evaluate", "mine", "--games", "2", "--game.time-limit", "3", "--threads", "1"])
    assert "champion" in capsys.readouterr().out
