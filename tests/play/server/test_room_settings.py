"""A room's settings, and the table that they ask for."""

from swarm_pz.config import CaptureConfig, GameConfig
from swarm_pz.play import protocol
from swarm_pz.play.game import TableConfig
from swarm_pz.play.server.room_settings import settings_of, table_config


def test_settings_leave_the_rules_of_the_house_alone():
    released = GameConfig.preset("released")
    table = table_config(protocol.Settings(red=3, time_limit=60.0), TableConfig(game=released))
    assert table.game == released.replace(drones_per_team=(3, 10), time_limit=60.0)


def test_settings_come_back_from_the_table():
    systems = {"red_system": "direct", "blue_system": "ergodic"}
    settings = protocol.Settings(red=1, blue=19, time_limit=None, mapping="paper", speed=0.5, **systems)
    house = TableConfig(min_command_interval=0.25)
    table = table_config(settings, house)
    assert settings_of(table) == settings and table.min_command_interval == 0.25
    calm = TableConfig(game=GameConfig(capture=CaptureConfig(enabled=False)))
    assert not table_config(settings, calm).game.capture.enabled, "the house's rules"
    assert not table_config(protocol.Settings(blue=0), TableConfig()).game.capture.enabled
