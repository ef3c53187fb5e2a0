"""The table's server: rooms, the clients in them, and games in real time.

===================  ==========================================================================
`serve`, `app`       where it listens, and its pages; `middleware` and `limits` guard them
`client_handler`     what one client says is obeyed, or refused to it alone; `connection` sends
`lobby`              all rooms, and the recorded games
`room`               two seats and their games, one after the other, by its `room_settings`
`audience`           who is in a room, and what they are told
`seat`               one side of a room, and its automatic `responses`
`seat_view`          what a seat's client is shown
`live_session`       a game in real time; `game_log` writes it down
`rendered_command`   from what a client sends to a command
`incoming_commands`  commands on their way into a game, with its `delays`
`worker`             a thread for what takes long
`policy_workers`     the processes in which policies think
`views`              what is shown of a game
`replays`            recorded games that are watched
`studies`            the pages of a study, and its `study_games`
`server_context`     what all games share, their clocks and the folder of their recordings
===================  ==========================================================================
"""
