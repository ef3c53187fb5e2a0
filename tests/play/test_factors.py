"""Factors of a seat are read, checked, and kept in a table's configuration."""

import pytest

from swarm_pz.config import GameConfig
from swarm_pz.errors import ConfigError
from swarm_pz.play.factors import Factors, read_factors
from swarm_pz.play.game import TableConfig
from swarm_pz.play.protocol import Settings
from swarm_pz.play.server.room_settings import settings_of, table_config
from swarm_pz.play.studies.design import Condition

NONE = Factors()


def write(folder, text):
    path = folder / "factors.toml"
    path.write_text(text)
    return path


def test_a_file_has_a_table_for_each_side_that_varies(tmp_path):
    path = write(tmp_path, '[blue]\ncommand_delay_ms = 300\nhide = ["opponents", "trails"]\n')
    assert read_factors(path) == (NONE, Factors(command_delay_ms=300, hide=("opponents", "trails")))


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[green]\nspeed = 2", "got 'green'"),
        ("[red]\nframe_rate = 0", r"frame_rate .* \[1, 30\], got 0"),
        ("[red]\nshare = 0.5", "helper"),
        (None, "holds no factors"),
    ],
)
def test_a_file_that_says_what_cannot_be_is_refused_by_its_name(text, told, tmp_path):
    with pytest.raises(ConfigError, match=told) as refused:
        read_factors(write(tmp_path, text) if text else tmp_path / "factors.toml")
    assert "factors.toml" in str(refused.value)


def test_a_table_keeps_them_and_those_of_a_study_s_condition_alone():
    condition = Condition(title="late", opponent="ring", command_delay_ms=300.0)
    for factors, kept in (
        ((NONE, Factors(hide=("ground",))), NONE),
        ((condition, NONE), Factors(command_delay_ms=300.0)),
    ):
        table = TableConfig(factors=factors)
        assert type(table.factors[0]) is Factors and table.factors[0] == kept
        assert table.varies and TableConfig.from_dict(table.to_dict()) == table != TableConfig()
    assert not TableConfig().varies


def test_the_clock_is_one_for_both_seats():
    table = TableConfig(factors=(NONE, Factors(speed=0.5)))
    assert table.speed == 0.5
    room = table_config(Settings(speed=2.0), table)
    assert room.speed == settings_of(room).speed == 0.5, "and no room chooses another"
    with pytest.raises(ConfigError, match="the same for both seats"):
        TableConfig(factors=(Factors(speed=2.0), Factors(speed=0.5)))


def test_only_densities_are_shared():
    helped = Factors(share=0.5, helper="ring")
    attractors = GameConfig(controllers=("ergodic", "flocking"))
    assert TableConfig(game=attractors, factors=(helped, NONE)).varies
    with pytest.raises(ConfigError, match=r"blue .* ring: .* flocking, .*'attractors'"):
        TableConfig(game=attractors, factors=(NONE, helped))
