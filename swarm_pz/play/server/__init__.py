"""The server: rooms, their clients, and games in real time.

===================  =======================================================================
`serve`, `app`       the start of the server; its pages, behind `middleware`
`client_handler`     one client's messages, obeyed or refused; `connection` sends to it
`lobby`              all rooms, and the recorded games
`room`               two seats and their games, by a plan of `room_settings`
`audience`           everybody in a room
`seat`               one side of a room; its client's `seat_view`
`live_session`       a game in real time; `game_log` records it
`rendered_command`   commands made of clients' messages
`incoming_commands`  commands on their way into a game: mixed, with `delays`
`worker`             a thread for slow work
`policy_workers`     processes in which policies load and act
`views`              frames, capture fields and targets
`studies`            the pages of a study, and its `study_games`
`server_context`     clock, folder and policies, for all games
===================  =======================================================================
"""
