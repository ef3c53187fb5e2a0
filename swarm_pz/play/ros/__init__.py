"""Games for ROS programs: messages of standard types, a rosbridge server, recordings as MCAP.

=================  ==========================================================================
`definitions`      the message types, as ROS 2 writes them, and messages as bytes (CDR)
`messages`         a moment of a game as messages of these types
`commands`         messages of ROS programs as commands
`rosbridge`        the rosbridge protocol, independent of games
`seat`             a seat of the game server that a client plays
`robots`           robots of a lab: their poses and setpoints
`bridge`           all of these together, in a process beside a game server
`mcap`             a recorded game as a file that ROS tools read
=================  ==========================================================================
"""
