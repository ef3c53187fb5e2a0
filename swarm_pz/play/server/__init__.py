"""The table's server: rooms, the clients in them, and games in real time.

===================  ==========================================================================
`serve`, `app`       where it listens, and its pages; `middleware` and `sockets` guard them
`client_handler`     what one client says, obeyed or refused (`refusal`) to it alone
`connection`         what one client is sent
`lobby`              all rooms, and the recorded games
`room`               what clients do in a room, whose `room_settings` say how it plays
`seat`               one side of it: who has it, its policy (`seat_policy`), its automatic `responses`
`seat_view`          what a seat's client is shown
`audience`           who is in a room, and what they are told
`room_games`         its games, one after the other
`live_session`       a game in real time, by its `game_clock`
`orders`, `painter`  from what a client asks for to a command
`incoming_commands`  commands on their way into a game, with its `delays`
`thinkers`, `pilot`  who asks a game's policies, and its control systems
`policy_workers`     the processes in which policies think
`views`              what is shown of a game
`game_log`           what is written down of it, in the `games_folder`
`replay_session`     a recorded game, shown to one client
`climbing`           the ladder
`studies`            the pages of a study, and its `study_games`
`server_context`     what all games share
===================  ==========================================================================
"""
